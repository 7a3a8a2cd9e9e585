"""A swing of a pen without files: recorded image by image, and solved now and then."""

from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

import numpy as np
from PySide6.QtCore import QObject, Signal

from lightpen.detection.pen_detection import PenDetection
from lightpen.detection.pixel_box import RegionOfInterest
from lightpen.detection.spots import Spots
from lightpen.errors import FileError
from lightpen.formats.decoding import encode_png
from lightpen.formats.files import mark_simulated, write_whole
from lightpen.formats.images import IMAGE_FOLDER
from lightpen.formats.opened_files import OpenedFiles, open_files
from lightpen.formats.pen_files import write_pen
from lightpen.formats.rig_files import write_camera
from lightpen.live.pipeline import LiveImage
from lightpen.messages import Message
from lightpen.model.rigid import Posture, posture_of
from lightpen.record.swings.writing import make_record_folder
from lightpen.swing.preparation import SourceChoice, SourceKind
from lightpen_app.look.languages import worded
from lightpen_app.work.job import LatestJob, Report
from lightpen_app.work.live_view import Mailbox
from lightpen_app.work.workbench import Workbench
from lightpen_extensions.discover.discover import discover
from lightpen_extensions.discover.found import Discovery, Guide, guide_of
from lightpen_extensions.discover.scale import Request
from lightpen_extensions.discover.tracks import sightings_of_spots

DISCOVERIES = "discoveries"  # in the data folder
FIRST_TRIAL, LATER = 60, 1.5  # images at the first trial; times as many at the next
N_USUAL, N_MOST = 300, 600  # images


@dataclass(frozen=True, eq=False)
class DiscoveryState:
    """State of a swing without files."""

    is_capturing: bool = False
    n_images: int = 0  # recorded so far
    # Solution of the images up to the last trial; relative during the capture.
    found: Discovery | None = None
    # Postures so far, and the next one; None before the first solution.
    guide: Guide | None = None
    posture: Posture | None = None  # of the pen in the last image
    progress: float | None = None  # of the final computation; None before and after
    fault: str = ""  # why the last trial found nothing
    # Whether its files are in use, and the images are being opened.
    is_saved: bool = False

    @property
    def is_final(self) -> bool:
        """Whether pen and camera are found to scale."""
        return self.found is not None and not self.found.is_relative


@dataclass(eq=False)
class _Recording:
    """Images of a swing: spots and pose by image, and the folder in which they are."""

    folder: Path
    size: tuple[int, int] = (0, 0)
    spots: list[Spots] = field(default_factory=list)
    detections: list[PenDetection | None] = field(default_factory=list)


class DiscoveryRun(QObject):
    """Records and solves a swing of an unknown pen."""

    changed = Signal()  # `state` is different
    found_changed = Signal()  # the result has changed
    # Both files and the images are in use, and the first of these was read.
    saved = Signal()
    _unwritten = Signal(object)

    def __init__(self, workbench: Workbench, parent: QObject) -> None:
        super().__init__(parent)
        self._workbench, self._live = workbench, workbench.live
        self.keeps_camera = False  # the selected camera file is taken as known
        self._state = DiscoveryState()
        self._recording: _Recording | None = None
        self._job = LatestJob(self)
        self._next_trial = FIRST_TRIAL
        self._taken = Mailbox(self)  # the GUI may be slower than the images

        # Connections
        self._taken.ready.connect(self._on_taken)
        self._unwritten.connect(self._on_unwritten)
        workbench.selection.changed.connect(self._on_selected)

    @property
    def state(self) -> DiscoveryState:
        """The present state."""
        return self._state

    def start(self) -> None:
        """Begin a new recording; the one before stays on the disk."""
        self.give_up()
        names = self._workbench.selection.preparation.names
        root, now = self._workbench.folder / DISCOVERIES, self._workbench.around.now()
        is_simulated = self._live.operator is not None

        def make(_: Report) -> Path:
            folder = make_record_folder(root, names, now)
            (folder / IMAGE_FOLDER).mkdir()
            if is_simulated:
                mark_simulated(folder)
            return folder

        self._job.start(make, self._on_begun, self._on_failed)

    def stop(self) -> None:
        """End the capture."""
        if self._state.is_capturing:
            self._live.set_sink(None)
            self._become(is_capturing=False)
            if self._live.operator is not None:
                self._live.operator.seat()

    def give_up(self) -> None:
        """End capture and computation, and detect what is selected again."""
        self.stop()
        self._job.cancel()
        self._recording = None
        self._live.set_region(self._workbench.selection.preparation.region)
        self._become(**vars(DiscoveryState()))

    def solve(self, request: Request) -> None:
        """Find pen and camera to scale, by all images."""
        self.stop()
        self._become(progress=0.0, fault="", is_saved=False)
        self._try(request, lambda done: self._become(progress=done))

    def cancel(self) -> None:
        """End the computation; what was found before stays."""
        self._job.cancel()
        self._become(progress=None)

    def save(self) -> None:
        """Write both files beside the images, and use all of them."""
        recording, found = self._recording, self._state.found
        if recording is None or found is None:
            return
        folder, serial = recording.folder, self._live.serial

        def write(_: Report) -> OpenedFiles:
            camera, pen = folder / "camera.yaml", folder / "pen.json"
            write_camera(replace(found.camera, serial=serial), camera)
            write_pen(found.pen, pen)
            return open_files(camera, pen)

        self._job.start(write, self._on_saved, self._on_failed)

    def _become(self, **changes: object) -> None:
        before, self._state = self._state, replace(self._state, **changes)  # type: ignore[arg-type]
        self.changed.emit()
        if self._state.found is not before.found:
            self.found_changed.emit()

    def _on_begun(self, folder: Path) -> None:
        self._recording = recording = _Recording(folder)
        self._next_trial = FIRST_TRIAL
        self._live.set_region(RegionOfInterest())
        if self._live.operator is not None:
            self._live.operator.swing()
        self._become(is_capturing=True)
        self._live.set_sink(partial(self._record_image, recording))

    def _record_image(self, recording: _Recording, seen: LiveImage) -> None:
        """Record an image, on the thread of the images."""
        height, width = seen.frame.image.shape
        if recording.size not in ((0, 0), (width, height)):
            return
        number = len(recording.spots) + 1
        path = recording.folder / IMAGE_FOLDER / f"{number:06}.png"
        try:
            write_whole(path, encode_png(seen.frame.image))
        except FileError as error:
            self._unwritten.emit(error.message)
            return
        recording.size = width, height
        recording.detections.append(seen.detection)
        recording.spots.append(seen.spots)
        self._taken.put(recording)

    def _on_taken(self) -> None:
        recording, state = self._recording, self._state
        if recording is not self._taken.take() or not state.is_capturing:
            return
        assert recording is not None
        n_images, guide, posture = len(recording.spots), state.guide, None
        new = recording.detections[state.n_images : n_images]
        seen = [each.rotation for each in new if each is not None and each.has_pose]
        if guide is not None and seen:
            guide = guide.with_postures(np.array(seen))
            posture = posture_of(guide.pen, seen[-1])
        self._become(n_images=n_images, guide=guide, posture=posture)
        if n_images >= self._next_trial and not self._job.is_running:
            self._next_trial = round(LATER * n_images)
            self._try(Request((), 0.0))
        is_covered = guide is not None and guide.is_complete
        if n_images >= (N_USUAL if is_covered else N_MOST):
            self.stop()

    def _on_unwritten(self, why: Message) -> None:
        if self._state.is_capturing:
            self.stop()
            self._become(fault=worded(why))

    def _try(self, request: Request, progressed: Report | None = None) -> None:
        recording = self._recording
        if recording is None:
            return
        spots, size = tuple(recording.spots), recording.size
        camera = self._workbench.selection.preparation.camera
        if self.keeps_camera and camera is not None and camera.image_size == size:
            request = replace(request, camera=camera)

        def find(report: Report) -> Discovery:
            names = tuple(f"{number:06}.png" for number in range(1, len(spots) + 1))
            return discover(sightings_of_spots(names, spots, size), request, report)

        self._job.start(find, self.adopt, self._on_failed, progressed=progressed)

    def adopt(self, found: Discovery) -> None:
        """Take over pen, camera and tip as found."""
        guide = guide_of(found)
        mask = self._workbench.selection.preparation.mask
        self._live.set_region(RegionOfInterest(found.camera, found.pen, mask))
        self._become(found=found, guide=guide, fault="", progress=None)

    def _on_failed(self, sentence: str) -> None:
        self._become(fault=sentence, progress=None)

    def _on_saved(self, opened: OpenedFiles) -> None:
        """Use the files with the camera, then with the images."""
        recording, selection = self._recording, self._workbench.selection
        if opened.faults:
            self._become(fault=worded(opened.faults[0]))
        if recording is None or opened.camera_file is None or opened.pen_file is None:
            return
        files = {"camera_file": opened.camera_file, "pen_file": opened.pen_file}
        now = replace(selection.preparation, **files)  # type: ignore[arg-type]
        selection.set_preparation(now)
        self._workbench.pens.keep(opened.pen_file)
        place = str(recording.folder / IMAGE_FOLDER)
        recorded = now.with_source(SourceChoice(SourceKind.RECORDED, place))
        selection.set_preparation(replace(recorded, **files))  # type: ignore[arg-type]
        self._become(is_saved=True)

    def _on_selected(self) -> None:
        """Announce the files with the first recorded image."""
        now = self._workbench.selection.preparation
        if self._state.is_saved and now.image_size is not None:
            self._become(is_saved=False)
            self.saved.emit()
