"""Selection of a second camera: its source and the rig file."""

from pathlib import Path

from PySide6.QtWidgets import QWidget

from lightpen.cameras.pairing import not_synchronised
from lightpen.formats.rig_files import RigFile, read_rig
from lightpen.live.pipeline import LiveImage
from lightpen.swing.image_sources import SourceChoice, SourceKind
from lightpen_app.look.layouts import vertical_layout
from lightpen_app.look.theme import GRID
from lightpen_app.steps.camera.rig_panel import RigPanel
from lightpen_app.steps.camera.source_panel import SourcePanel
from lightpen_app.work.camera_setup import CameraSetup
from lightpen_app.work.chosen_files import ChosenFiles
from lightpen_app.work.job import LatestJob
from lightpen_app.work.selection import Selection


class SecondCameraChoice(QWidget):
    """Shows and changes the second camera of the preparation."""

    def __init__(
        self, selection: Selection, camera: CameraSetup, files: ChosenFiles
    ) -> None:
        super().__init__()
        self._selection, self._chosen_files = selection, files
        self._live = camera.live
        self._reading = LatestJob(self)

        # Widgets
        self._rig = RigPanel()
        self.source = SourcePanel(camera.sources, is_second=True)

        # Layout
        vertical_layout(self, self._rig, self.source, spacing=2 * GRID)

        # Connections
        self._rig.wanted.connect(self._on_wanted)
        self._rig.path_chosen.connect(self._on_path_chosen)
        self.source.value_changed.connect(self._on_source_chosen)
        self.source.retry_requested.connect(camera.open)
        selection.changed.connect(self._on_workbench_changed)
        selection.station_changed.connect(self.shut_down)

        self._on_workbench_changed()

    def show_step(self, seen: LiveImage) -> None:
        """Show by the newest image whether two cameras are synchronised."""
        live = self._live
        if live.n_cameras == 1:
            return
        lag_ms, px_per_mm = live.lag_ms, None
        camera = self._selection.preparation.camera
        if (
            camera is not None
            and seen.detection is not None
            and seen.detection.has_pose
        ):
            px_per_mm = camera.fx / float(seen.detection.translation[2])
        n_unpaired = None if lag_ms is None else live.stats.unpaired
        self._rig.set_step(not_synchronised(lag_ms, px_per_mm), n_unpaired)

    def forget_step(self) -> None:
        """Clear the lag: no images arrive."""
        self._rig.set_step(None, None)

    def shut_down(self) -> None:
        """Cancel reading."""
        self._reading.cancel()

    def _on_workbench_changed(self) -> None:
        now = self._selection.preparation
        self._rig.set_value(now.second is not None, now.rig_file)
        self.source.setVisible(now.second is not None)
        if now.second is not None:
            self.source.set_value(now.second.source)

    def _on_wanted(self, is_wanted: bool) -> None:
        now = self._selection.preparation
        self._on_source_chosen(SourceChoice(now.source.kind) if is_wanted else None)

    def _on_source_chosen(self, source: SourceChoice | None) -> None:
        chosen = self._selection.preparation.with_second(source)
        self._selection.set_preparation(chosen)
        is_simulated = source is not None and source.kind == SourceKind.SIMULATED
        if is_simulated and chosen.rig_file is None:
            self._chosen_files.use_samples()

    def _on_path_chosen(self, path: str) -> None:
        self._reading.start(
            lambda _: read_rig(Path(path)), self._on_rig_read, self._rig.set_problem
        )

    def _on_rig_read(self, rig_file: RigFile) -> None:
        now = self._selection.preparation
        self._selection.set_preparation(now.with_rig(rig_file))
