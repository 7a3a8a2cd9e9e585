"""The tips of a pen that can be calibrated next, each by one click."""

from collections.abc import Sequence

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QHBoxLayout, QWidget

from lightpen.record.results import Result
from lightpen_app.look.theme import GRID, TextSize, Tone, text_label
from lightpen_app.look.words import shortened
from lightpen_app.widgets.push_button import PushButton
from lightpen_app.widgets.translated import Translated

LONGEST = 12  # characters of a tip on its button


class NextTipsRow(Translated, QWidget):
    """Shows the results of other tips; hidden while there is none.

    Signals
    -------
    chosen(Result)
        The tip of this result is to be calibrated.
    """

    chosen = Signal(object)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._value: tuple[Result, ...] = ()
        self._buttons: list[PushButton] = []

        # Widgets
        self._label = text_label(TextSize.SMALL, Tone.QUIET)

        # Layout
        self._layout = QHBoxLayout(self)
        self._layout.setContentsMargins(0, 0, 0, 0)
        self._layout.setSpacing(GRID)
        self._layout.addWidget(self._label)

        self._retranslate()
        self.hide()

    def value(self) -> tuple[Result, ...]:
        """Return the results whose tips are shown."""
        return self._value

    def set_value(self, value: Sequence[Result]) -> None:
        """Show other tips, or none."""
        self._value = tuple(value)
        while self._buttons:
            button = self._buttons.pop()
            self._layout.removeWidget(button)
            button.deleteLater()
        for result in self._value:
            button = PushButton(0)
            button.clicked.connect(
                lambda _=False, result=result: self.chosen.emit(result)
            )
            self._buttons.append(button)
            self._layout.addWidget(button)
        self.setVisible(bool(value))
        self._retranslate()

    def _retranslate(self) -> None:
        self._label.setText(self.tr("Next tip"))
        for button, result in zip(self._buttons, self._value, strict=True):
            tip = result.names.tip
            button.setText(shortened(tip, LONGEST))
            button.setAccessibleName(self.tr("Next tip {0}").format(tip))
            button.setToolTip(
                self.tr(
                    "Calibrate tip {0} next, with its ball and nominal centre"
                ).format(tip)
            )
