"""Two cameras: the rig file, and their synchronisation."""

from pathlib import Path

import numpy as np
from PySide6.QtWidgets import QCheckBox, QFileDialog, QGroupBox

from lightpen.cameras.pairing import not_synchronised
from lightpen.formats.rig_files import RigFile, read_rig
from lightpen.live.pipeline import LiveImage
from lightpen.messages import Message
from lightpen.model.rigid import Rig
from lightpen.swing.preparation import SourceChoice, SourceKind
from lightpen_app.look.languages import worded
from lightpen_app.look.layouts import vertical_layout
from lightpen_app.steps.camera.source_panel import SourcePanel
from lightpen_app.widgets.controls import FileDrops
from lightpen_app.widgets.fields import PathField, Translated
from lightpen_app.widgets.state_banner import SignLabel, StatusMessage
from lightpen_app.work.camera_setup import CameraSetup
from lightpen_app.work.chosen_files import ChosenFiles
from lightpen_app.work.job import LatestJob
from lightpen_app.work.selection import Selection

FILES = "*.json *.yaml *.yml"


class RigPanel(Translated, QGroupBox):
    """Chooses a second camera, by its own panel, and the rig file of both."""

    def __init__(
        self,
        selection: Selection,
        camera: CameraSetup,
        files: ChosenFiles,
        source: SourcePanel,
    ) -> None:
        super().__init__()
        self.say(self, self.tr("Two cameras"))
        self._selection, self._chosen_files = selection, files
        self._live, self._source = camera.live, source
        self._reading = LatestJob(self)
        self._file: RigFile | None = None
        self._late: Message | None = None
        self._n_unpaired: int | None = None

        # Widgets
        self._second = self.say(QCheckBox(), self.tr("Use a second camera"))
        self._path = self.say(PathField(), hint=self.tr("Rig file"))
        self._open = self.make_button(self.tr("Open..."), self._on_open_clicked)
        self._path.add_button(self._open)
        self._problem = SignLabel()
        self._remark_label = SignLabel()
        self._step = SignLabel()

        # Layout
        vertical_layout(
            self,
            self._second,
            self._path,
            self._problem,
            self._remark_label,
            self._step,
        )

        # Connections
        self._second.clicked.connect(self._on_second_clicked)
        self._path.path_chosen.connect(self._on_path_chosen)
        FileDrops(self).dropped.connect(self._path.accept)
        source.value_changed.connect(self._choose)
        source.retry_requested.connect(camera.open)
        selection.changed.connect(self._on_selected)
        selection.station_changed.connect(self.shut_down)

        self._on_selected()

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
        self.set_step(not_synchronised(lag_ms, px_per_mm), n_unpaired)

    def shut_down(self) -> None:
        """Cancel reading."""
        self._reading.cancel()

    def _on_selected(self) -> None:
        """Show whether there are two cameras, and their file.

        A complaint about a file that is not used goes away with another file in use,
        and with the second camera.
        """
        now = self._selection.preparation
        is_wanted, file = now.second is not None, now.rig_file
        self._second.setChecked(is_wanted)
        self._source.setVisible(is_wanted)
        if now.second is not None:
            self._source.set_value(now.second.source)
        if file is not self._file or not is_wanted:
            self._file = file
            self._path.set_value("" if file is None else str(file.path))
            self._set_problem("")
        self._refresh()

    def _set_problem(self, why: str) -> None:
        """Show why the selected file is not used; empty if it is."""
        self._path.set_faulty(bool(why))
        self._problem.set_value(StatusMessage.fault(why))
        self._refresh()

    def set_step(self, late: Message | None, n_unpaired: int | None) -> None:
        """Show the time lag and the number of unpaired images.

        Nothing is known yet of None of these.
        """
        if (late, n_unpaired) != (self._late, self._n_unpaired):
            self._late, self._n_unpaired = late, n_unpaired
            self._refresh_step()

    def _on_second_clicked(self, is_wanted: bool) -> None:
        now = self._selection.preparation
        self._choose(SourceChoice(now.source.kind) if is_wanted else None)

    def _choose(self, source: SourceChoice | None) -> None:
        chosen = self._selection.preparation.with_second(source)
        self._selection.set_preparation(chosen)
        is_simulated = source is not None and source.kind == SourceKind.SIMULATED
        if is_simulated and chosen.rig_file is None:
            self._chosen_files.use_samples()

    def _on_path_chosen(self, path: str) -> None:
        self._reading.start(
            lambda _: read_rig(Path(path)), self._on_rig_read, self._set_problem
        )

    def _on_rig_read(self, rig_file: RigFile) -> None:
        now = self._selection.preparation
        self._selection.set_preparation(now.with_rig(rig_file))

    def _on_open_clicked(self) -> None:
        self._path.pick(
            QFileDialog.FileMode.ExistingFile,
            self.tr("Rig file of both cameras"),
            self.tr("Rig files ({0})").format(FILES),
        )

    def _refresh(self) -> None:
        is_wanted = self._second.isChecked()
        for widget in (self._path, self._open):
            widget.setVisible(is_wanted)
        self._remark_label.set_value(self._checked() if is_wanted else StatusMessage())
        self._refresh_step()

    def _checked(self) -> StatusMessage:
        if self._file is None:
            words = self.tr(
                "Open the file with the extrinsics of both cameras. Create it from "
                'board images with "lightpen extrinsics LEFT RIGHT --board BOARD '
                '--out rig.json".'
            )
            return StatusMessage.warning(words)
        rig = self._file.rig
        words = self.tr("Baseline {2} ({0}-{1})").format(
            rig.names[0], rig.names[1], _baseline(rig)
        )
        if self._problem.value().text:
            words = self.tr("{0} remains in use: {1}").format(
                self._file.path.name, words
            )
        return StatusMessage.good(words)

    def _refresh_step(self) -> None:
        remark = StatusMessage()
        if self._second.isChecked() and self._n_unpaired is not None:
            if self._late is not None:
                remark = StatusMessage.warning(worded(self._late))
            else:
                words = self.tr("The cameras are synchronised.")
                remark = StatusMessage.good(words)
            if self._n_unpaired:
                words = self.tr("{0} Unpaired images: {1}.")
                text = words.format(remark.text, self._n_unpaired)
                remark = StatusMessage.warning(text)
        self._step.set_value(remark)


def _baseline(rig: Rig) -> str:
    """Return the baseline, and U of it if it is known."""
    shift = rig.translations[1]
    length = float(np.linalg.norm(shift))
    if rig.covariance is None:
        return f"{length:.1f} mm"
    along = shift / length
    sigma = float(np.sqrt(along @ rig.covariance[3:6, 3:6] @ along))
    return f"{length:.2f} \u00b1 {2 * sigma:.2f} mm (k = 2)"
