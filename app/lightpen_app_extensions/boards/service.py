"""Camera calibration with boards, for the window."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from PySide6.QtWidgets import QWidget
from typing_extensions import override

from lightpen_app.face import WindowService

if TYPE_CHECKING:
    from lightpen.record.folder import CalibratedCamera
    from lightpen_app_extensions.boards.window import BoardWindow


class BoardsService(WindowService["BoardWindow"]):
    """Calibrates a camera by views of a board, in a window of its own."""

    calibrates_cameras = True

    @override
    def calibrate_camera(self, page: QWidget, on_saved: Callable[[str], None]) -> None:
        def make() -> "BoardWindow":
            # A camera is calibrated once a year; it is not waited for at each start.
            from lightpen_app_extensions.boards.window import BoardWindow

            window = BoardWindow(self._workbench.live, self._workbench.save_place, page)
            window.saved.connect(on_saved)
            window.concluded.connect(self._on_concluded)
            return window

        self._show_window(make)

    def _on_concluded(self, camera: "CalibratedCamera") -> None:
        names = self._workbench.selection.preparation.names
        self._workbench.archive_writer.keep_camera_calibration(camera, names)
