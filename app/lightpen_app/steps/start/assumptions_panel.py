"""Whether a station assumes what is usual, and the way to change it."""

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QGroupBox, QHBoxLayout, QWidget

from lightpen.model.assumptions import USUAL, Assumptions
from lightpen_app.look.theme import GRID, TextSize, Tone, text_label
from lightpen_app.steps.start.assumptions_dialog import AssumptionsDialog
from lightpen_app.widgets.push_button import PushButton
from lightpen_app.widgets.translated import Translated


class AssumptionsPanel(Translated, QGroupBox):
    """Opens what is assumed of a station.

    Signals
    -------
    value_changed()
        The user chose other assumptions.
    """

    value_changed = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)

        # Widgets
        self._words = text_label(TextSize.SMALL, Tone.QUIET)
        self._change = PushButton()
        self._dialog = AssumptionsDialog(self)

        # Layout
        layout = QHBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(2 * GRID)
        layout.addWidget(self._words, 1)
        layout.addWidget(self._change)

        # Connections
        self._change.clicked.connect(self._dialog.open)
        self._dialog.value_changed.connect(self._on_dialog_changed)

        self._retranslate()

    def value(self) -> Assumptions:
        """Return the assumptions."""
        return self._dialog.value()

    def set_value(self, assumptions: Assumptions) -> None:
        """Show other assumptions."""
        self._dialog.set_value(assumptions)
        self._retranslate()

    def dialog(self) -> AssumptionsDialog:
        """Return the dialog that changes them."""
        return self._dialog

    def _on_dialog_changed(self) -> None:
        self._retranslate()
        self.value_changed.emit()

    def _retranslate(self) -> None:
        self.setTitle(self.tr("Where files say nothing"))
        self._words.setText(
            self.tr("The usual uncertainties are assumed.")
            if self.value() == USUAL
            else self.tr("Uncertainties of this station are assumed.")
        )
        self._change.setText(self.tr("Change"))
        self._change.setAccessibleName(self.tr("Change what is assumed"))
        self._change.setToolTip(
            self.tr(
                "Focal length, scale, warmth, ball and cone: how uncertain each is "
                "where no file says it."
            )
        )
