"""A remark on the LEDs, with the button that mends what it tells."""

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QVBoxLayout, QWidget

from lightpen.pen_check.match import Finding, What
from lightpen_app.look.theme import GRID
from lightpen_app.widgets.push_button import PushButton
from lightpen_app.widgets.sign_label import Remark, SignLabel
from lightpen_app.widgets.translated import Translated


class MendableRemark(Translated, QWidget):
    """Shows a remark; hidden while there is none.

    Signals
    -------
    mend_requested(Finding)
        The button was pressed.
    """

    mend_requested = Signal(object)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._finding: Finding | None = None

        # Widgets
        self._remark = SignLabel()
        self._mend = PushButton()

        # Layout
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(GRID)
        layout.addWidget(self._remark)
        layout.addWidget(self._mend)

        # Connections
        self._mend.clicked.connect(self._on_mend_clicked)

        self.hide()
        self._retranslate()

    def text(self) -> str:
        """Return what is said."""
        return self._remark.value().text

    def set_value(self, remark: Remark) -> None:
        """Show another remark."""
        self._remark.set_value(remark)
        self.setVisible(bool(remark.text))

    def set_mendable(self, finding: Finding | None) -> None:
        """Offer to mend what was found, or nothing."""
        self._finding = finding
        self._mend.setVisible(finding is not None)
        if finding is not None:
            self._mend.setText(self._verb(finding))

    def _verb(self, finding: Finding) -> str:
        if finding.what is What.EXCHANGED:
            return self.tr("Exchange {0} and {1}").format(*finding.leds)
        return self.tr("Use the measured place")

    def _on_mend_clicked(self) -> None:
        self.mend_requested.emit(self._finding)

    def _retranslate(self) -> None:
        self.set_mendable(self._finding)
