"""Camera calibration in the window."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from PySide6.QtWidgets import QWidget
from typing_extensions import override

from lightpen.record.folder.camera_calibrations import CameraTrial
from lightpen_app.face import Service
from lightpen_app.work.workbench import Workbench

if TYPE_CHECKING:
    from lightpen_app_extensions.boards.board_window import BoardWindow


class BoardsService(Service):
    """Calibrates a camera by views of a board, in a window of its own."""

    calibrates_cameras = True

    def __init__(self, workbench: Workbench) -> None:
        super().__init__(workbench)
        self._workbench = workbench
        self._window: BoardWindow | None = None  # created on demand

    @override
    def calibrate_camera(self, page: QWidget, on_saved: Callable[[str], None]) -> None:
        if self._window is None:
            # A camera is calibrated once a year; it is not waited for at each start.
            from lightpen_app_extensions.boards.board_window import BoardWindow

            bench = self._workbench
            self._window = BoardWindow(bench.live, bench.save_place, page)

            # Connections
            self._window.saved.connect(on_saved)
            self._window.concluded.connect(self._on_concluded)
        self._window.show()
        self._window.raise_()

    @override
    def close(self) -> None:
        if self._window is not None:
            self._window.close()

    def _on_concluded(self, trial: CameraTrial) -> None:
        names = self._workbench.selection.preparation.names
        self._workbench.archive_writer.keep_camera_trial(trial, names)
