"""Progress of a board calibration: variation of the views, and missing views."""

from PySide6.QtWidgets import QProgressBar, QWidget
from typing_extensions import override

from lightpen.intrinsics.view_progress import ViewProgress
from lightpen_app.look.layouts import grid_layout
from lightpen_app.look.signs import Sign
from lightpen_app.look.theme import GRID, Tone
from lightpen_app.widgets.labelled import field_label
from lightpen_app.widgets.sign_label import SignLabel, StatusMessage
from lightpen_app.widgets.translated import Translated


class BoardProgress(Translated, QWidget):
    """Shows position, size and skew of the views as bars, with a verdict."""

    def __init__(self) -> None:
        super().__init__()
        self._value = ViewProgress()

        # Widgets
        self._bars = [QProgressBar() for _ in range(4)]
        self._labels = [field_label(bar) for bar in self._bars]
        self._verdict = SignLabel()

        # Layout
        layout = grid_layout(self, spacing=(GRID, GRID // 2))
        for row, (label, bar) in enumerate(zip(self._labels, self._bars, strict=True)):
            bar.setTextVisible(False)
            layout.addWidget(label, row, 0)
            layout.addWidget(bar, row, 1)
        layout.addWidget(self._verdict, 4, 0, 1, 2)
        layout.setColumnStretch(1, 1)

        self._retranslate()

    def value(self) -> ViewProgress:
        """Return the displayed value."""
        return self._value

    def verdict(self) -> StatusMessage:
        """Return the shortfall of the views, or that they suffice."""
        return self._verdict.value()

    def set_value(self, value: ViewProgress) -> None:
        """Show other progress."""
        self._value = value
        self._retranslate()

    @override
    def _retranslate(self) -> None:
        value = self._value
        shares = (value.x, value.y, value.size, value.skew)
        names = (self.tr("X"), self.tr("Y"), self.tr("Size"), self.tr("Skew"))
        for label, bar, name, share in zip(
            self._labels, self._bars, names, shares, strict=True
        ):
            label.setText(name)
            bar.setAccessibleName(name)
            bar.setValue(round(100 * share))
        missing = (
            self.tr("at the left and right edges"),
            self.tr("at the top and bottom edges"),
            self.tr("closer to the camera"),
            self.tr("tilted"),
        )
        wanted = [
            text for text, share in zip(missing, shares, strict=True) if share < 1.0
        ]
        if wanted:
            text = self.tr("Add views {0}.").format(", ".join(wanted))
            self._verdict.set_value(StatusMessage(text, Sign.RING, Tone.PLAIN))
        else:
            text = self.tr("Good: the views vary enough.")
            self._verdict.set_value(StatusMessage.good(text))
