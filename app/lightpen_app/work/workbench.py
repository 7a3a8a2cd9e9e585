"""What the pages share: what was chosen, the live images, and the swing."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from time import monotonic

from PySide6.QtCore import QObject, QThreadPool, Signal

from lightpen.cameras.protocol import CameraSettings
from lightpen.cameras.source import Needs
from lightpen.formats.opened_files import OpenedFiles, open_files
from lightpen.live.sources import (
    Surroundings,
    cameras_of,
    files_of_before,
    sample_files,
)
from lightpen.model.assumptions import USUAL
from lightpen.model.due_rule import DueRule
from lightpen.model.limits import StationLimits, SwingLimits
from lightpen.model.origin import Origin
from lightpen.record.camera_calibrations import CameraTrial, keep_camera_trial
from lightpen.record.folder_archive import SIMULATED
from lightpen.record.leftovers import sweep_leftovers
from lightpen.record.names import Names
from lightpen.record.recordings import FilesBeside
from lightpen.record.standing import Standings
from lightpen.record.supervision import Supervision, read_supervision
from lightpen.sentences import Sentence
from lightpen.swing.preparation import (
    CameraInUse,
    Preparation,
    SourceChoice,
    SourceKind,
)
from lightpen.verification.choices import VerificationChoices
from lightpen_app.look.sentences import worded
from lightpen_app.work.camera_search import CameraSearch
from lightpen_app.work.file_reading import FileReading
from lightpen_app.work.folder_watch import FolderWatch
from lightpen_app.work.job import Job, Report
from lightpen_app.work.library_watch import LibraryWatch
from lightpen_app.work.live_view import CLOSING_TIME, LiveView, Shown
from lightpen_app.work.settings import Settings, Station
from lightpen_app.work.station_choices import choices_of, with_choices
from lightpen_app.work.station_preparation import preparation_of, station_of
from lightpen_app.work.streaming import Streaming
from lightpen_app.work.swing_run import SwingRun
from lightpen_app.work.verification_run import VerificationRun

LONGEST_FAREWELL = 2.0  # s that a camera may hold up the end of the program
# What is tried out goes by these, and nothing of it is remembered.
TRIAL = Names("Trial", "Trial", "SIM-1", "T-1", "C-1", 10.0)


@dataclass(frozen=True)
class Subject:
    """What is calibrated, for all that is shown besides the steps.

    Attributes
    ----------
    names : Names
        Of the swing there is; else those that are chosen.
    origin : Origin or None
        What its images are of; None where a swing of an earlier version does not say.
    standings : Standings
        How all tips stand.
    """

    names: Names
    origin: Origin | None
    standings: Standings = field(default_factory=Standings)


class Workbench(QObject):
    """The preparation as it is now; each choice is remembered for its station.

    Parameters
    ----------
    folder : Path
        For records, results and sample files.

    Signals
    -------
    changed()
        `preparation` is different.
    subject_changed(Subject)
        `subject` is different.
    troubled(str)
        A sentence to be read.
    station_left()
        Another station is chosen: files that are still being read are not for it.
    swing_wanted(Path)
        What leads to a recorded swing was opened from outside the program.
    relieved(str)
        A sentence of `troubled` whose cause is gone.
    """

    changed = Signal()
    subject_changed = Signal(object)
    station_left = Signal()
    swing_wanted = Signal(object)
    troubled = Signal(str)
    relieved = Signal(str)

    def __init__(
        self,
        settings: Settings,
        folder: Path,
        around: Surroundings | None = None,
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self._settings = settings
        self._folder = folder
        self._around = around or Surroundings()
        self._preparation = Preparation()
        self._is_started = False
        self._wants_samples = False
        self._reading = FileReading(self)
        self._read_for = SourceChoice()  # which was chosen when that began
        self._unread = Station()
        self._unsaved_told = ""
        self._subject_told: Subject | None = None
        self._verified_told: tuple[Path, ...] = ()
        self._choices = VerificationChoices()
        self._supervision = Supervision()
        self.run = SwingRun(folder, self._around.now, self)
        self.verification = VerificationRun(
            self.run.archive, folder, self._around.now, self
        )
        self.streaming = Streaming(self.run.archive, self._around.clock, self)
        self.live = LiveView(self.run, self.verification, self.streaming.stream, self)
        self.library = LibraryWatch(
            folder, self.run.logbook, settings.due_rule(), self._around.now, self
        )
        self.folder_watch = FolderWatch(folder, self)
        self.search = CameraSearch(self.live, self)
        self._in_force_told: tuple[object, object] = (None, None)

        # Connections
        self.live.image_shown.connect(self._on_image_shown)
        self.live.configured.connect(self._on_configured)
        self.live.troubled.connect(self.troubled)
        self.live.failed.connect(self.troubled)
        self.live.relieved.connect(self.relieved)
        self.run.troubled.connect(self.troubled)
        self.run.relieved.connect(self.relieved)
        self.verification.changed.connect(self._on_verification_changed)
        self.verification.troubled.connect(self.troubled)
        self.verification.relieved.connect(self.relieved)
        self.library.troubled.connect(self.troubled)
        self.library.relieved.connect(self.relieved)
        self.library.changed.connect(self._tell_subject)
        self._reading.troubled.connect(self.troubled)
        self._reading.relieved.connect(self.relieved)
        self.search.camera_wanted.connect(self.open_camera)
        self.run.changed.connect(self._tell_subject)
        self.run.changed.connect(self._follow_results)
        self.changed.connect(self._tell_subject)
        settings.troubled.connect(self._on_settings_troubled)
        settings.relieved.connect(self._on_settings_relieved)

    @property
    def preparation(self) -> Preparation:
        """What was chosen so far."""
        return self._preparation

    @property
    def choices(self) -> VerificationChoices:
        """What the tip is verified by."""
        return self._choices

    def set_choices(self, choices: VerificationChoices) -> None:
        """Take over other choices for verifications, and remember them."""
        self._choices = choices
        self._remember()
        self._tell_runners()
        self.changed.emit()

    @property
    def supervision(self) -> Supervision:
        """What supervisors have laid down for the data folder."""
        return self._supervision

    def set_supervision(self, supervision: Supervision) -> None:
        """Go by what supervisors have laid down, from now on."""
        self._supervision = supervision
        before = self._preparation
        self._preparation = replace(before, limits=self._limits_for(before).swing)
        self._choices = self._limited(self._choices)
        self._remember()
        self._follow(before)

    def _limits_for(self, preparation: Preparation) -> StationLimits:
        """Return what holds at a station: its own limits, or what was chosen."""
        chosen = StationLimits(preparation.limits, due=self._settings.due_rule())
        return self._supervision.limits_at(preparation.names.station, chosen)

    def _limited(self, choices: VerificationChoices) -> VerificationChoices:
        """Return choices with the limits of the station."""
        limits = self._limits_for(self._preparation).verification
        return replace(choices, limits=limits)

    @property
    def folder(self) -> Path:
        """For records, results and sample files."""
        return self._folder

    @property
    def subject(self) -> Subject:
        """What is calibrated: by the swing there is, else by what is chosen."""
        status, chosen = self.run.status, self._preparation
        standings = self.library.standings
        if status.state is not None:
            return Subject(status.names, status.origin, standings)
        return Subject(chosen.names, chosen.origin, standings)

    @property
    def around(self) -> Surroundings:
        """What simulated and recorded sources go by."""
        return self._around

    @property
    def is_reading(self) -> bool:
        """Whether the files of the station are being read, or sample files written."""
        return self._reading.is_under_way

    def start(self) -> None:
        """Take over what was chosen last, and open the camera."""
        if self._settings.trouble is not None:
            self._on_settings_troubled(self._settings.trouble)
        folder = self._folder  # a job that knew its parent would outlive it
        Job(lambda _: sweep_leftovers(folder), self).start()
        self.run.runner.open_logbook()
        self._read_supervision()
        self.library.refresh()
        self.folder_watch.start()
        self.choose_station(self._settings.last_station())
        self._wants_samples = True
        if not self.is_reading:
            self._fill_in_samples()
        self.open_camera()

    def stations(self) -> tuple[str, ...]:
        """Return the names of the stations that are known."""
        return self._settings.stations()

    def choose_station(self, name: str) -> None:
        """Take over what was chosen last at a station."""
        station = self._settings.station(name) if name else Station()
        before = self._preparation
        self._reading.relieve()
        self.station_left.emit()
        chosen = preparation_of(name, station, before)
        self._preparation = replace(chosen, limits=self._limits_for(chosen).swing)
        self._choices = self._limited(choices_of(station))
        self._open_files(station)
        self._remember_station()
        self._follow(before)

    def try_out(self) -> None:
        """Choose a simulated pen, names for it, and its files once they are read."""
        now = replace(
            self._preparation,
            names=TRIAL,
            camera_file=None,
            pen_file=None,
            nominal_tip=None,
            limits=SwingLimits(),
            assumptions=USUAL,
            second=None,
        )
        self.set_preparation(now.with_source(SourceChoice()))
        self.use_sample_files()
        if not self.live.is_open:
            self.open_camera()

    def set_preparation(self, preparation: Preparation) -> None:
        """Take over other choices, and remember them for the station."""
        before, self._preparation = self._preparation, preparation
        files = before.camera_file, before.pen_file, before.rig_file
        now = preparation.camera_file, preparation.pen_file, preparation.rig_file
        if now != files:
            self._reading.relieve()
        self._remember_station()
        self._remember()
        self._follow(before)

    def enter_owed(self) -> None:
        """Enter in the archive what files tell of that it does not yet."""
        logbook = self.run.logbook
        Job(lambda _: logbook.enter_owed(), self).start()

    def keep_camera_trial(self, trial: CameraTrial) -> None:
        """Keep what became of the calibration of a camera, and enter it."""
        logbook, folder, now = self.run.logbook, self._folder, self._around.now
        names = self._preparation.names

        def keep(_: Report) -> None:
            keep_camera_trial(folder, trial, names, now())
            logbook.enter_owed()

        job = Job(keep, self)

        # Connections
        job.failed.connect(self.troubled)
        job.start()

    def export_folder(self) -> str:
        """Return the folder that results were saved in last; empty at first."""
        return self._settings.export_folder()

    def set_export_folder(self, folder: str) -> None:
        """Remember where results are saved."""
        self._settings.set_export_folder(folder)

    def due_rule(self) -> DueRule:
        """Return how long a tip may be in force: as laid down, or as was chosen."""
        return self._limits_for(self._preparation).due

    def set_due_rule(self, rule: DueRule) -> None:
        """Remember how long a tip may be in force where nothing is laid down."""
        self._settings.set_due_rule(rule)
        self.library.set_rule(rule)

    def use_files(self, files: FilesBeside) -> None:
        """Choose the files that stand beside recorded images, once they are read."""
        self._reading.relieve()
        self._read(lambda _: open_files(files.camera, files.pen), self._on_chosen_read)

    def open_camera(self) -> None:
        """Open the source, or open it again after it failed; then follow its choice.

        A swing that is captured goes on with it.
        """
        self._is_started = True
        source, *others = self._preparation.sources
        if source.lacks_place:
            self.live.close()
            return
        there = [other for other in others if not other.lacks_place]
        cameras = cameras_of([source, *there], self._around)
        clock, known = self._around.clock, self._settings.cameras()
        self.live.open(cameras, CameraSettings(), clock, known)

    def use_sample_files(self) -> None:
        """Choose the files that go with the simulated camera, once they are written."""
        self._reading.relieve()
        self._write_samples()

    def _write_samples(self) -> None:
        around, folder = self._around, self._folder / SIMULATED
        self._read(lambda _: sample_files(around, folder), self._on_chosen_read)

    def _read(
        self,
        function: Callable[[Report], OpenedFiles],
        on_read: Callable[[OpenedFiles], None],
    ) -> None:
        self._read_for = self._preparation.source
        self._reading.start(function, on_read)

    def _still_wanted(self, opened: OpenedFiles) -> OpenedFiles:
        """Return what was read, without what another source chosen since rules out."""
        now = self._preparation
        held = replace(
            now,
            source=self._read_for,
            camera_file=opened.camera_file,
            pen_file=opened.pen_file,
        ).with_source(now.source)
        return replace(opened, camera_file=held.camera_file, pen_file=held.pen_file)

    def shut_down(self, timeout_s: float = CLOSING_TIME) -> bool:
        """Close the camera, cancel what is under way, and wait until all has ended.

        Returns
        -------
        bool
            Whether it has, the jobs of all pages included. What goes on may be left
            behind: all that was acknowledged is on the disk.
        """
        deadline = monotonic() + timeout_s
        for told in (self.run, self.verification):
            told.blockSignals(True)  # nothing more is begun because of what they tell
        self.folder_watch.stop()
        self.library.shut_down()
        self.run.runner.shut_down()
        self.verification.runner.shut_down()
        self.live.close()
        pool = QThreadPool.globalInstance()
        jobs_ended = pool.waitForDone(round(1000 * timeout_s))
        # A dead camera may take longer, and has nothing to tell any more.
        of_camera = min(max(0.0, deadline - monotonic()), LONGEST_FAREWELL)
        has_closed = self.live.await_closed(of_camera)
        has_ended = all(
            runner.await_end(max(0.0, deadline - monotonic()))
            for runner in (self.run.runner, self.verification.runner)
        )
        self.streaming.shut_down()
        self.folder_watch.leave()
        pool.waitForDone(round(1000 * max(0.0, deadline - monotonic())))
        is_saved = self._settings.await_saved(max(0.0, deadline - monotonic()))
        return jobs_ended and has_closed and has_ended and is_saved

    def _open_files(self, station: Station) -> None:
        """Read the files of a station; what cannot be read must be chosen again."""
        self._reading.cancel()
        self._unread = station
        camera_path = Path(station.camera_file) if station.camera_file else None
        pen_path = Path(station.pen_file) if station.pen_file else None
        units = station.pen_units or None
        rig_path = Path(station.rig_file) if station.rig_file else None
        if any(path is not None for path in (camera_path, pen_path, rig_path)):
            samples = self._folder / SIMULATED
            self._read(
                lambda _: files_of_before(
                    *(samples, camera_path, pen_path, units, rig_path)
                ),
                self._on_files_read,
            )

    def _on_files_read(self, opened: OpenedFiles) -> None:
        self._unread = Station()
        opened = self._still_wanted(opened)
        before = self._preparation  # files chosen meanwhile count
        self._preparation = replace(
            before,
            camera_file=before.camera_file or opened.camera_file,
            pen_file=before.pen_file or opened.pen_file,
        ).with_rig(before.rig_file or opened.rig_file)
        self._follow(before)
        self._fill_in_samples()

    def _fill_in_samples(self) -> None:
        """Use the simulated camera's own files at the start if there are no others."""
        now, wants_samples = self._preparation, self._wants_samples
        self._wants_samples = False
        simulated = now.source.kind == SourceKind.SIMULATED
        has_none = now.camera_file is None and now.pen_file is None
        if wants_samples and simulated and has_none:
            self._write_samples()

    def _on_chosen_read(self, opened: OpenedFiles) -> None:
        opened = self._still_wanted(opened)
        before = self._preparation
        self._preparation = replace(
            before,
            camera_file=opened.camera_file or before.camera_file,
            pen_file=opened.pen_file or before.pen_file,
        ).with_rig(opened.rig_file or before.rig_file)
        self._remember()
        self._follow(before)

    def _follow(self, before: Preparation) -> None:
        """Let the camera and its images follow the choices."""
        now = self._preparation
        if now.sources != before.sources:
            self._preparation = now = now.without_images()
        self._tell_runners()
        if now.sources != before.sources and self._is_started:
            self.open_camera()
        self.live.set_aim(now.aim)
        self.changed.emit()

    def _tell_runners(self) -> None:
        self.run.runner.choose(self._preparation)
        self.verification.runner.choose(self._preparation, self._choices)
        self.streaming.choose(self._preparation)
        self.library.set_rule(self.due_rule())

    def _read_supervision(self) -> None:
        folder = self._folder
        job = Job(lambda _: read_supervision(folder), self)

        # Connections
        job.succeeded.connect(self._on_supervision_read)
        job.failed.connect(self.troubled)
        job.start()

    def _on_supervision_read(self, supervision: Supervision) -> None:
        if supervision.is_guarded:
            self.set_supervision(supervision)

    def _follow_results(self) -> None:
        """See which tip is in force once a result was accepted or taken back."""
        now = self.run.status.result, self.run.status.taken_back
        before, self._in_force_told = self._in_force_told, now
        if any(one is not two for one, two in zip(now, before, strict=True)):
            self.library.refresh()
            self.streaming.read_tip()

    def _tell_subject(self) -> None:
        subject = self.subject
        if subject != self._subject_told:
            self._subject_told = subject
            self.subject_changed.emit(subject)

    def _on_verification_changed(self) -> None:
        """Enter a verification as soon as it is kept."""
        files = self.verification.status.files
        if files != self._verified_told:
            self._verified_told = files
            self.enter_owed()

    def _remember_station(self) -> None:
        station = self._preparation.names.station
        if station not in ("", TRIAL.station):
            self._settings.set_last_station(station)

    def _remember(self) -> None:
        name = self._preparation.names.station
        if name not in ("", TRIAL.station):
            station = station_of(self._preparation, self._unread)
            self._settings.set_station(name, with_choices(station, self._choices))

    def _on_settings_troubled(self, why: Sentence) -> None:
        self._unsaved_told = worded(why)
        self.troubled.emit(self._unsaved_told)

    def _on_settings_relieved(self) -> None:
        self.relieved.emit(self._unsaved_told)  # as it was told, in whatever language

    def _on_image_shown(self, shown: Shown) -> None:
        size = shown.size.width(), shown.size.height()
        if shown.seen.camera == 0 and size != self._preparation.image_size:
            self._preparation = replace(self._preparation, image_size=size)
            self._tell_runners()
            self.changed.emit()

    def _on_configured(self, camera: int, settings: CameraSettings) -> None:
        before, caps = self._preparation, self.live.caps_of(camera)
        serial = self.live.serial_of(camera)
        used = CameraInUse(serial, settings)
        if camera == 0:
            now = replace(before, camera_in_use=used)
        elif before.second is not None and caps is not None:
            size = caps.width, caps.height
            second = replace(before.second, in_use=used, image_size=size)
            now = replace(before, second=second)
        else:
            return
        self._preparation = now
        self._tell_runners()
        if camera > 0:
            self.changed.emit()
        if now.sources[camera].source.needs is not Needs.FILES:
            self._settings.set_camera(serial, settings)
