"""The simulated operator in the window."""

from typing_extensions import override

from lightpen_app.face import Service, SimulatorControls
from lightpen_app.work.workbench import Workbench


class SimulatorService(Service):
    """Adds buttons for the simulated operator to the step Swing."""

    def __init__(self, workbench: Workbench) -> None:
        super().__init__(workbench)
        self._live = workbench.live

    @override
    def swing_controls(self) -> SimulatorControls:
        from lightpen_app_extensions.simulator.swing_controls import (
            SwingSimulatorControls,
        )

        return SwingSimulatorControls(self._live)
