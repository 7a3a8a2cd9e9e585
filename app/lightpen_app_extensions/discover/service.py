"""Pen and camera without files, in the window."""

from typing import TYPE_CHECKING

from PySide6.QtWidgets import QWidget
from typing_extensions import override

from lightpen_app.face import Service
from lightpen_app.work.workbench import Workbench

if TYPE_CHECKING:
    from lightpen_app_extensions.discover.discovery_window import DiscoveryWindow


class DiscoverService(Service):
    """Finds tip, pen and camera by one swing, in a window of its own."""

    discovers = True

    def __init__(self, workbench: Workbench) -> None:
        super().__init__(workbench)
        self._workbench = workbench
        self._window: DiscoveryWindow | None = None  # created on demand

    @override
    def discover(self, window: QWidget, *, is_camera_known: bool) -> None:
        if self._window is None:
            # It takes long to be imported, and is seldom wanted.
            from lightpen_app_extensions.discover.discovery_window import (
                DiscoveryWindow,
            )

            self._window = DiscoveryWindow(self._workbench, window)
            self._window.continued.connect(lambda: self.step_requested.emit("swing"))
        self._window.set_camera_known(is_camera_known)
        self._window.show()
        self._window.raise_()

    @override
    def close(self) -> None:
        if self._window is not None:
            self._window.close()
