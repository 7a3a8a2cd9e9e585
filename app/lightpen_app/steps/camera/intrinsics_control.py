"""Intrinsics of the step Camera: read from a file, or calibrated."""

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TypeAlias

from PySide6.QtCore import QObject, Qt
from PySide6.QtWidgets import QWidget

from lightpen.formats.camera_file_writing import write_window
from lightpen.formats.opened_files import CameraFile
from lightpen_app.face import Services
from lightpen_app.steps.camera.intrinsics_panel import IntrinsicsPanel
from lightpen_app.steps.camera.part_dialog import PartDialog
from lightpen_app.work.job import LatestJob
from lightpen_app.work.workbench import Workbench

Region: TypeAlias = tuple[int, int, int, int]  # x, y, width and height, px


class IntrinsicsControl(QObject):
    """Carries out requests of the intrinsics panel."""

    def __init__(
        self,
        workbench: Workbench,
        panel: IntrinsicsPanel,
        services: Services,
        page: QWidget,
    ) -> None:
        super().__init__(page)
        self._selection, self._services = workbench.selection, services
        self._panel = panel
        self._page = page
        self._reading = LatestJob(self)

        # Connections
        workbench.selection.station_changed.connect(self._forget_file)
        panel.path_chosen.connect(self._on_path_chosen)
        panel.part_requested.connect(self._on_part_requested)
        panel.calibration_requested.connect(self._on_calibration_requested)

    def shut_down(self) -> None:
        """Cancel reading."""
        self._reading.cancel()

    def _forget_file(self) -> None:
        """Clear the message on a file that was chosen at another station."""
        self._reading.cancel()
        self._panel.forget_refused()

    def _on_path_chosen(self, path: str) -> None:
        self._reading.start(
            lambda _: CameraFile.read(Path(path)),
            self._on_file_read,
            self._panel.set_problem,
        )

    def _on_part_requested(self) -> None:
        file = self._selection.preparation.camera_file
        if file is None:
            return
        dialog = PartDialog(file.camera, self._page)
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.given.connect(partial(self._on_part_given, file.path))
        dialog.open()

    def _on_part_given(self, path: Path, binning: int, region: Region) -> None:
        self._reading.start(
            lambda _: CameraFile.read(write_window(path, binning, region)),
            self._on_file_read,
            self._panel.set_problem,
        )

    def _on_calibration_requested(self) -> None:
        for each in self._services:
            if each.calibrates_cameras:
                each.calibrate_camera(self._page, self._on_path_chosen)

    def _on_file_read(self, camera_file: CameraFile) -> None:
        now = self._selection.preparation
        self._selection.set_preparation(replace(now, camera_file=camera_file))
