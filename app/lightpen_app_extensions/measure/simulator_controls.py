"""Buttons for the simulated operator who probes."""

from PySide6.QtWidgets import QToolButton
from typing_extensions import override

from lightpen_app.look.layouts import horizontal_layout
from lightpen_app.look.theme import GRID
from lightpen_app.steps.simulator_controls import SimulatorControls, set_words
from lightpen_app.widgets.push_button import PushButton
from lightpen_app_extensions.measure.service import MeasureService


class ProbingSimulatorControls(SimulatorControls):
    """Lets the simulated operator touch, or lift the pen; hidden with a real pen."""

    def __init__(self, service: MeasureService) -> None:
        super().__init__(service.workbench.live)
        self._service = service
        self.setProperty("area", "panel")

        # Widgets
        self._touch = PushButton(checkable=True)
        self._touch.setProperty("inviting", True)
        self._lift = QToolButton()

        # Layout
        margins = (GRID, GRID // 2, GRID, GRID // 2)
        cells = self._touch, 1, self._lift
        horizontal_layout(self, *cells, spacing=2 * GRID, margins=margins)

        # Connections
        self._touch.toggled.connect(service.set_touching)
        self._lift.clicked.connect(self._on_lift_clicked)

        self._retranslate()
        self._follow_connection()

    def stop(self) -> None:
        """Release the simulated operator."""
        self._touch.setChecked(False)

    @override
    def _retranslate(self) -> None:
        self.setAccessibleName(self.tr("Simulated pen"))
        set_words(
            self._touch,
            self.tr("Let the simulated operator probe"),
            self.tr("Probes all tasks automatically."),
        )
        set_words(
            self._lift, self.tr("Lift"), self.tr("Take the tip away for a moment.")
        )

    @override
    def _follow_connection(self) -> None:
        super()._follow_connection()
        if self._touch.isChecked():  # of a camera opened again
            self._service.set_touching(self._live.operator is not None)

    def _on_lift_clicked(self) -> None:
        self._command(lambda hand: hand.lift())
