"""The page area: notice, title, lead and page."""

from PySide6.QtCore import QCoreApplication, Qt, Signal
from PySide6.QtWidgets import QBoxLayout, QFrame, QSizePolicy, QStackedWidget, QWidget

from lightpen_app.look.announcements import announce
from lightpen_app.look.layouts import horizontal_layout, vertical_layout
from lightpen_app.look.theme import GRID, TextSize, Tone, set_tone, text_label
from lightpen_app.widgets.responsive_layout import SizeClass
from lightpen_app.widgets.translated import Translated


class NoticeBar(Translated, QFrame):
    """Bar for a message, hidden without one; Close hides it.

    While the data folder cannot be written, a message on it says where to choose
    another one, and appears once.
    """

    value_changed = Signal(str)  # its text; empty if it shows none

    def __init__(self) -> None:
        super().__init__()
        self.setProperty("area", "notice")
        self._unwritable = self._fault = ""  # the data folder, and why

        # Widgets
        self._text = text_label(TextSize.BODY)
        self._text.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self._close = self.make_button(self.tr("Close"), self.clear)

        # Layout
        margins = (2 * GRID, GRID, GRID, GRID)
        horizontal_layout(
            self, (self._text, 1), self._close, spacing=2 * GRID, margins=margins
        )

        self.hide()

    def text(self) -> str:
        """Return the message; empty while hidden."""
        return self._text.text()

    def show_text(self, text: str, tone: Tone = Tone.BAD) -> None:
        """Say a sentence, instead of an earlier one."""
        shown, is_of_folder = self.text(), self._with_way(text) != text
        if is_of_folder and shown == self._with_way(self._fault):
            return
        text = self._with_way(text)
        self._text.setText(text)
        self._text.setAccessibleName(text)
        set_tone(self, tone)
        self.show()
        announce(self, text)
        self.value_changed.emit(text)

    def drop(self, text: str) -> None:
        """Remove a message whose cause has ended."""
        if self.text() in (text, self._with_way(text)):
            self.clear()

    def set_unwritable(self, folder: str, fault: str) -> None:
        """Show why the data folder cannot be written; an empty text ends it."""
        if fault:
            self._unwritable, self._fault = folder, fault
            self.show_text(fault)
        else:
            self.drop(self._fault)
            self._unwritable = self._fault = ""

    def clear(self) -> None:
        """Clear the message."""
        self._text.clear()
        self.hide()
        self.value_changed.emit("")

    def _with_way(self, text: str) -> str:
        """Return a sentence, of an unwritable data folder with the way to another."""
        if not self._unwritable or self._unwritable not in text:
            return text
        way = QCoreApplication.translate(
            "MainWindow",
            "Choose the data folder at Set up station or in the options (F10).",
        )
        return f"{text} {way}"


class PageArea(QFrame):
    """Shows one page of several.

    A notice stands above it and covers nothing; it takes no focus.
    """

    def __init__(self, page: QWidget) -> None:
        super().__init__()
        self.setObjectName("page_area")

        # Widgets: the order of making them is the order of the Tab key
        self.notice = NoticeBar()
        self._title = text_label(TextSize.TITLE)
        self._title.setWordWrap(False)
        self._lead = text_label(TextSize.BODY, Tone.QUIET)
        self._stack = QStackedWidget()
        self._stack.setMinimumSize(1, 1)  # the pages ask for none: they scroll
        self._stack.addWidget(page)

        # Layout
        self._layout = layout = vertical_layout(self, self.notice, margins=None)
        layout.addSpacing(GRID)
        self._heading = vertical_layout(
            layout, self._title, (self._lead, 1), spacing=-1
        )
        layout.addSpacing(GRID)
        layout.addWidget(self._stack, 1)

    def words(self) -> tuple[str, ...]:
        """Return the texts about the page."""
        return self.notice.text(), self._title.text(), self._lead.text()

    def add_page(self, page: QWidget) -> None:
        """Add a page without showing it."""
        _let_ask(page, False)
        self._stack.addWidget(page)

    def show_page(self, page: QWidget) -> None:
        """Show a page; only that one contributes to the size of the window."""
        before = self._stack.currentWidget()
        if before is not None:
            _let_ask(before, False)
        _let_ask(page, True)
        self._stack.setCurrentWidget(page)

    def set_heading(self, title: str, lead: str, tone: Tone = Tone.QUIET) -> None:
        """Show the title of the page and its instruction."""
        self._title.setText(title)
        self._lead.setText(lead)
        set_tone(self._lead, tone)
        self._lead.setVisible(bool(lead))

    def set_room(self, room: SizeClass) -> None:
        """Arrange title, lead and margins as the size of the window allows."""
        side = room.margin
        if room.is_low:
            self._layout.setContentsMargins(side, 0, side, GRID)
            self._heading.setDirection(QBoxLayout.Direction.LeftToRight)
            self._heading.setSpacing(3 * GRID)
        else:
            self._layout.setContentsMargins(side, 2 * GRID, side, 3 * GRID)
            self._heading.setDirection(QBoxLayout.Direction.TopToBottom)
            self._heading.setSpacing(GRID)


def _let_ask(page: QWidget, asks: bool) -> None:
    """Let a page contribute to the size of the window, or ignore its size."""
    policy = QSizePolicy.Policy
    wish = policy.Preferred if asks else policy.Ignored
    page.setSizePolicy(wish, wish)
