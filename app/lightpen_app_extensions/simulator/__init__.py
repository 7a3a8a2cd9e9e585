"""The simulated operator in the window, and the demo, in which he uses it."""

from lightpen_app.faced import Face, Faced
from lightpen_extensions.simulator.extension import SIMULATOR as CORE


def _load() -> "Face":
    from lightpen_app_extensions.simulator.service import SimulatorService

    return SimulatorService


SIMULATOR = Faced(CORE, _load)
