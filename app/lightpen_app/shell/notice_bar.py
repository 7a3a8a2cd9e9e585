"""A sentence over the page that waits to be read, and stops nothing."""

from PySide6.QtCore import QCoreApplication, Qt, Signal
from PySide6.QtWidgets import QFrame, QHBoxLayout, QWidget

from lightpen_app.look.announcements import announce
from lightpen_app.look.theme import GRID, TextSize, Tone, set_tone, text_label
from lightpen_app.widgets.push_button import PushButton
from lightpen_app.widgets.translated import Translated


class NoticeBar(Translated, QFrame):
    """Hidden until it has something to say; Close puts it away.

    While nothing can be kept in the data folder, whatever is told of it says where
    another one is chosen, and is told once.

    Signals
    -------
    value_changed(str)
        What it says; empty once it says nothing any more.
    """

    value_changed = Signal(str)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setProperty("area", "notice")
        self._page: QWidget | None = None  # that raised it
        self._unwritable = self._trouble = ""  # the data folder, and why

        # Widgets
        self._text = text_label(TextSize.BODY)
        self._text.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self._close = PushButton()

        # Layout
        layout = QHBoxLayout(self)
        layout.setContentsMargins(2 * GRID, GRID, GRID, GRID)
        layout.setSpacing(2 * GRID)
        layout.addWidget(self._text, 1)
        layout.addWidget(self._close)

        # Connections
        self._close.clicked.connect(self.clear)

        self._retranslate()
        self.hide()

    def text(self) -> str:
        """Return what it says; empty while it is hidden."""
        return self._text.text()

    def show_text(
        self, text: str, tone: Tone = Tone.BAD, *, page: QWidget | None = None
    ) -> None:
        """Say a sentence, instead of an earlier one; of a page until another shows."""
        told, is_of_folder = self.text(), self._with_way(text) != text
        if is_of_folder and told == self._with_way(self._trouble):
            return
        self._page = page
        text = self._with_way(text)
        self._text.setText(text)
        self._text.setAccessibleName(text)
        set_tone(self, tone)
        self.show()
        announce(self, text)
        self.value_changed.emit(text)

    def drop(self, text: str) -> None:
        """Take a sentence away whose cause is gone, and no other."""
        if self.text() in (text, self._with_way(text)):
            self.clear()

    def clear_page(self, page: QWidget | None = None) -> None:
        """Say nothing that a page raised, or any where none is given."""
        if self._page is not None and page in (None, self._page):
            self.clear()

    def set_unwritable(self, folder: str, trouble: str) -> None:
        """Say why nothing can be kept in the data folder, until that is empty."""
        if trouble:
            self._unwritable, self._trouble = folder, trouble
            self.show_text(trouble)
        else:
            self.drop(self._trouble)
            self._unwritable = self._trouble = ""

    def clear(self) -> None:
        """Say nothing."""
        self._text.clear()
        self.hide()
        self.value_changed.emit("")

    def _with_way(self, text: str) -> str:
        """Return a sentence, of an unwritable data folder with the way to another."""
        if not self._unwritable or self._unwritable not in text:
            return text
        way = QCoreApplication.translate(
            "MainWindow",
            "The data folder is chosen at the step Start, or in the options (F10).",
        )
        return f"{text} {way}"

    def _retranslate(self) -> None:
        self._close.setText(self.tr("Close"))
