"""A sentence over the page that waits to be read, and stops nothing."""

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QFrame, QHBoxLayout, QWidget

from lightpen_app.look.announcements import announce
from lightpen_app.look.theme import GRID, TextSize, Tone, set_tone, text_label
from lightpen_app.widgets.push_button import PushButton
from lightpen_app.widgets.translated import Translated


class NoticeBar(Translated, QFrame):
    """Hidden until it has something to say; Close puts it away.

    Signals
    -------
    value_changed(str)
        What it says; empty once it says nothing any more.
    """

    value_changed = Signal(str)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setProperty("area", "notice")

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

    def close_text(self) -> str:
        """Return the word on the button that puts it away."""
        return self._close.text()

    def show_text(self, text: str, tone: Tone = Tone.BAD) -> None:
        """Say a sentence, instead of an earlier one."""
        self._text.setText(text)
        self._text.setAccessibleName(text)
        set_tone(self, tone)
        self.show()
        announce(self, text)
        self.value_changed.emit(text)

    def clear(self) -> None:
        """Say nothing."""
        self._text.clear()
        self.hide()
        self.value_changed.emit("")

    def _retranslate(self) -> None:
        self._close.setText(self.tr("Close"))
