"""The page area with notice, title and lead, and the action bar below it."""

from collections.abc import Callable

from PySide6.QtCore import QDeadlineTimer, Qt, Signal
from PySide6.QtGui import QMouseEvent
from PySide6.QtWidgets import QFrame, QSizePolicy, QStackedWidget, QWidget
from typing_extensions import override

from lightpen_app.look.layouts import (
    announce,
    fill,
    horizontal_layout,
    set_stacked,
    vertical_layout,
)
from lightpen_app.look.theme import (
    GRID,
    TextSize,
    Tone,
    set_styled,
    set_tone,
    text_label,
)
from lightpen_app.widgets.controls import PushButton
from lightpen_app.widgets.fields import Translated
from lightpen_app.widgets.fitting import SizeClass
from lightpen_app.widgets.page import MainAction, Page


class NoticeBar(Translated, QFrame):
    """Bar for messages, hidden without one; Close shows the one before."""

    value_changed = Signal(str)  # its text; empty if it shows none

    def __init__(self) -> None:
        super().__init__()
        self.setProperty("area", "notice")
        self._open: dict[str, Tone] = {}  # messages not closed yet, the newest last

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
        """Say a sentence, before the earlier ones."""
        self._open.pop(text, None)
        self._open[text] = tone
        self._show_newest()
        announce(self, text)

    def drop(self, text: str) -> None:
        """Remove a message whose cause has ended."""
        if self._open.pop(text, None) is not None:
            self._show_newest()

    def clear(self) -> None:
        """Close the message that is shown."""
        self.drop(self.text())

    def _show_newest(self) -> None:
        text, tone = next(reversed(self._open.items()), ("", Tone.BAD))
        self._text.setText(text)
        self._text.setAccessibleName(text)
        set_tone(self, tone)
        self.setVisible(bool(text))
        self.value_changed.emit(text)


LONG_LEAD = 120  # letters, from which it has a row of its own


class PageArea(QFrame):
    """Shows one page of several.

    A notice stands above it and covers nothing; it takes no focus.
    """

    def __init__(self, page: QWidget) -> None:
        super().__init__()
        self.setObjectName("page_area")
        self._room = SizeClass()

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

    def order_tabs(self, *after: QWidget) -> None:
        """Let the Tab key reach these after the pages."""
        window = self.window()
        last = window.previousInFocusChain() or window
        while last.focusPolicy() is Qt.FocusPolicy.NoFocus:
            last = last.previousInFocusChain() or window
        for each in after:
            self.setTabOrder(last, each)
            last = each

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
        self.set_room(self._room)

    def set_room(self, room: SizeClass) -> None:
        """Arrange title, lead and margins as the size of the window allows."""
        self._room, side = room, room.margin
        if room.is_low:
            self._layout.setContentsMargins(side, 0, side, GRID)
        else:
            self._layout.setContentsMargins(side, 2 * GRID, side, 3 * GRID)
        is_beside = room.is_low and len(self._lead.text()) < LONG_LEAD
        self._heading.setSpacing(3 * GRID if is_beside else GRID)
        set_stacked(self._heading, not is_beside)


def focus_first(page: Page) -> bool:
    """Focus the control that a page chose, or its first; False without any."""
    first = page.first_control()
    if first is None:
        widget = page.nextInFocusChain()
        while widget is not None and page.isAncestorOf(widget):
            takes_tab = bool(widget.focusPolicy() & Qt.FocusPolicy.TabFocus)
            if takes_tab and widget.isEnabled() and widget.isVisibleTo(page):
                first = widget
                break
            widget = widget.nextInFocusChain()
    if first is not None:
        first.setFocus(Qt.FocusReason.TabFocusReason)
    return first is not None


def _let_ask(page: QWidget, asks: bool) -> None:
    """Let a page contribute to the size of the window, or ignore its size."""
    policy = QSizePolicy.Policy
    wish = policy.Preferred if asks else policy.Ignored
    page.setSizePolicy(wish, wish)


MAIN_WIDTH = 22 * GRID + 34  # px; with the padding and the border
HEIGHT, LOW_HEIGHT = 9 * GRID, 8 * GRID  # px, at least
GUARD_MS = 800  # for which keys are ignored after the main button has changed


class ActionBar(Translated, QFrame):
    """One main button, with the reason when it cannot be pressed.

    Keys are ignored for a moment after the button or the page has changed, so that a
    second Enter does nothing.
    """

    main_pressed = Signal()
    back_pressed = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.setObjectName("bottom_bar")
        self._status_holds: Callable[[], bool] | None = None
        self._guard = QDeadlineTimer()  # expired

        # Widgets
        self._why_not = text_label(TextSize.BODY, Tone.WARN)
        self._status = text_label(TextSize.SMALL, Tone.QUIET)
        self._back = self.make_button(self.tr("Back"), self.back_pressed)
        self._main = _MainButton(MAIN_WIDTH)
        self._main.setObjectName("main_button")

        # Layout
        self._layout = horizontal_layout(self, spacing=2 * GRID)
        vertical_layout(
            self._layout, 1, self._why_not, self._status, 1, spacing=0, stretch=1
        )
        fill(self._layout, self._back, self._main)

        # Connections
        self._main.clicked.connect(self._on_main_clicked)

        self.set_room(SizeClass())
        self.set_status("")

    def set_action(self, action: MainAction, *, can_go_back: bool) -> None:
        """Show another main action."""
        if action.text != self._main.text():
            self.guard()
        self._main.setText(action.text)
        if action.why_not and self._main.hasFocus():
            self.setFocus()  # kept for the button, until it can be pressed again
        set_styled(self._main, "early", "true" if action.is_early else "")
        self._main.setEnabled(not action.why_not)
        if not action.why_not and self.hasFocus():
            self._main.setFocus()
        self._main.setAccessibleDescription(action.why_not)
        self._why_not.setText(action.why_not)
        self._why_not.setVisible(bool(action.why_not))
        if self._status_holds is not None and not self._status_holds():
            self.set_status("")
        self._refresh_status()
        self._back.setVisible(can_go_back)

    def set_status(self, text: str, holds: Callable[[], bool] | None = None) -> None:
        """Show a sentence in the status line, or none.

        It stays until there is another, or as long as it ``holds``.
        """
        self._status_holds = holds
        self._status.setText(text)
        self._status.setAccessibleName(text)
        self._refresh_status()

    def _visible_status(self) -> str:
        """Return the status, but not the same sentence twice."""
        text = self._status.text()
        return "" if text == self._why_not.text() else text

    def _refresh_status(self) -> None:
        self._status.setVisible(bool(self._visible_status()))

    def set_room(self, room: SizeClass) -> None:
        """Use less space in a small window."""
        self.setMinimumHeight(LOW_HEIGHT if room.is_low else HEIGHT)
        side = room.margin
        self._layout.setContentsMargins(side, GRID, side, GRID)

    def words(self) -> tuple[str, str]:
        """Return why the main button cannot be pressed, and the status."""
        return self._why_not.text(), self._visible_status()

    def press_main(self) -> None:
        """Press the main button, if it can be pressed."""
        if self._main.isEnabled():
            self._main.click()

    def guard(self) -> None:
        """Ignore the main button for a moment: it is about to do something else."""
        self._guard = QDeadlineTimer(GUARD_MS)

    def focus_main(self) -> None:
        """Put the focus on the main button."""
        self._main.setFocus(Qt.FocusReason.TabFocusReason)

    def _on_main_clicked(self) -> None:
        if self._guard.hasExpired():
            self.main_pressed.emit()


class _MainButton(PushButton):
    """Treats a double click as one: the second could press another page's button."""

    @override
    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        event.accept()
