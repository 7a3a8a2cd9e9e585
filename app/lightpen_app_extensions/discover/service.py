"""Tip, pen and camera without files, for the window."""

from typing import TYPE_CHECKING

from PySide6.QtWidgets import QWidget
from typing_extensions import override

from lightpen_app.face import WindowService

if TYPE_CHECKING:
    from lightpen_app_extensions.discover.window import DiscoveryWindow


class DiscoverService(WindowService["DiscoveryWindow"]):
    """Finds tip, pen and camera by one swing, in a window of its own."""

    discovers = True

    @override
    def discover(self, window: QWidget, *, is_camera_known: bool) -> None:
        def make() -> "DiscoveryWindow":
            # It takes long to be imported, and is seldom wanted.
            from lightpen_app_extensions.discover.window import DiscoveryWindow

            made = DiscoveryWindow(self._workbench, window)
            made.continued.connect(lambda: self.step_requested.emit("swing"))
            return made

        self._show_window(make).set_camera_known(is_camera_known)
