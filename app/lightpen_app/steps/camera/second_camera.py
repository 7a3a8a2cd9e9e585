"""The choice of a second camera: whether there is one, its source, and the rig file."""

from pathlib import Path

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QVBoxLayout, QWidget

from lightpen.cameras.pairing import not_synchronised
from lightpen.formats.rig_files import RigFile, read_rig
from lightpen.live.looking import LiveImage
from lightpen.swing.preparation import SourceChoice, SourceKind
from lightpen_app.look.theme import GRID
from lightpen_app.steps.camera.rig_panel import RigPanel
from lightpen_app.steps.camera.source_panel import SourcePanel
from lightpen_app.work.job import Job
from lightpen_app.work.workbench import Workbench


class SecondCameraChoice(QWidget):
    """Shows and changes the second camera of the preparation.

    Signals
    -------
    chosen()
        Another one is wanted, or none any more.
    search_requested()
        The cameras of its source are to be looked for.
    """

    chosen = Signal()
    search_requested = Signal()

    def __init__(self, workbench: Workbench, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._workbench = workbench
        self._reading: Job | None = None

        # Widgets
        self._rig = RigPanel()
        self._source = SourcePanel(is_second=True)

        # Layout
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(2 * GRID)
        layout.addWidget(self._rig)
        layout.addWidget(self._source)

        # Connections
        self._rig.wanted.connect(self._on_wanted)
        self._rig.path_chosen.connect(self._on_path_chosen)
        self._source.value_changed.connect(self._on_source_chosen)
        self._source.retry_requested.connect(workbench.open_camera)
        self._source.search_requested.connect(self.search_requested)
        workbench.changed.connect(self._on_workbench_changed)
        workbench.station_left.connect(self.shut_down)

        self._on_workbench_changed()

    def source(self) -> SourcePanel:
        """Return the choice of its source."""
        return self._source

    def tell_step(self, seen: LiveImage) -> None:
        """Tell whether two cameras take their images at the same moment.

        Parameters
        ----------
        seen : LiveImage
            The newest image, which tells how far away the pen is.
        """
        live = self._workbench.live
        if live.n_cameras == 1:
            return
        lag_ms, px_per_mm = live.lag_ms, None
        camera = self._workbench.preparation.camera
        if camera is not None and seen.sighting is not None and seen.sighting.has_pose:
            px_per_mm = camera.fx / float(seen.sighting.translation[2])
        n_unpaired = None if lag_ms is None else live.stats.unpaired
        self._rig.set_step(not_synchronised(lag_ms, px_per_mm), n_unpaired)

    def forget_step(self) -> None:
        """Know nothing of their moments: no images come."""
        self._rig.set_step(None, None)

    def shut_down(self) -> None:
        """Read no more."""
        if self._reading is not None:
            self._reading.cancel()

    def _on_workbench_changed(self) -> None:
        now = self._workbench.preparation
        self._rig.set_value(now.second is not None, now.rig_file)
        self._source.setVisible(now.second is not None)
        if now.second is not None:
            self._source.set_value(now.second.source)

    def _on_wanted(self, is_wanted: bool) -> None:
        now = self._workbench.preparation
        self._on_source_chosen(SourceChoice(now.source.kind) if is_wanted else None)

    def _on_source_chosen(self, source: SourceChoice | None) -> None:
        self.chosen.emit()
        chosen = self._workbench.preparation.with_second(source)
        self._workbench.set_preparation(chosen)
        is_simulated = source is not None and source.kind == SourceKind.SIMULATED
        if is_simulated and chosen.rig_file is None:
            self._workbench.use_sample_files()

    def _on_path_chosen(self, path: str) -> None:
        self.shut_down()
        self._reading = job = Job(lambda _: read_rig(Path(path)), self)

        # Connections
        job.succeeded.connect(self._on_rig_read)
        job.failed.connect(self._on_rig_refused)
        job.start()

    def _on_rig_read(self, rig_file: RigFile) -> None:
        self._reading = None
        now = self._workbench.preparation
        self._workbench.set_preparation(now.with_rig(rig_file))

    def _on_rig_refused(self, why: str) -> None:
        self._reading = None
        self._rig.set_problem(why)
