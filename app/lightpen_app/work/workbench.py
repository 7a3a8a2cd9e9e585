"""Shared objects of the pages, created, started and ended together."""

from collections.abc import Callable
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Protocol

from PySide6.QtCore import QObject, QThreadPool, QTimer, Signal

from lightpen.archive.lazy_logbook import LazyLogbook
from lightpen.live.sources import SourceEnvironment
from lightpen.messages import Message
from lightpen.model.limits import DueRule
from lightpen.record.folder import check_writable, sweep_leftovers
from lightpen.record.library.supervision import Supervision, read_supervision
from lightpen.record.results.result_folder import SIMULATED
from lightpen.record.swings.header import Names
from lightpen_app.look.languages import worded
from lightpen_app.work.camera_setup import CameraSetup, FilesOfCameras
from lightpen_app.work.chosen_files import ChosenFiles, SavePlace
from lightpen_app.work.job import Job, Notifications, Report
from lightpen_app.work.library_watch import LibraryWatch, PenFiles
from lightpen_app.work.live_view import CLOSING_TIME, LiveView
from lightpen_app.work.selection import Selection
from lightpen_app.work.settings import Settings
from lightpen_app.work.swing_run import SwingRun

if TYPE_CHECKING:
    from lightpen.record.folder import CalibratedCamera


class ArchiveWriter(QObject):
    """Enters the events of a data folder's files in the background."""

    def __init__(
        self,
        folder: Path,
        logbook: LazyLogbook,
        now: Callable[[], datetime],
        notifications: Notifications,
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self._folder = folder
        self._logbook = logbook
        self._now = now
        self._notifications = notifications

    def enter_owed(self) -> None:
        """Enter events that the archive lacks."""
        logbook = self._logbook
        Job(lambda _: logbook.enter_owed(), self).start()

    def keep_camera_calibration(self, camera: "CalibratedCamera", names: Names) -> None:
        """Keep the result of the calibration of a camera, and enter it."""
        from lightpen.record.folder import keep_camera_calibration

        logbook, folder, now = self._logbook, self._folder, self._now

        def keep(_: Report) -> None:
            keep_camera_calibration(folder, camera, names, now())
            logbook.enter_owed()

        job = Job(keep, self)
        job.start(failed=lambda why: self._notifications.notify(self, why))


LOOKING_MS = 5000  # from one look to the next


class FolderWatch(QObject):
    """Checks now and then whether a data folder that failed can be written."""

    fault_changed = Signal(str)  # why the folder cannot be written; empty if it can

    def __init__(self, folder: Path, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._folder = folder
        self._fault = ""
        self._timer = QTimer(self, interval=LOOKING_MS)

        # Connections
        self._timer.timeout.connect(self._look)

    def start(self) -> None:
        """Check now, and again while it fails."""
        self._check()
        self._timer.start()

    def stop(self) -> None:
        """Stop."""
        self._timer.stop()

    def _look(self) -> None:
        if self._fault:
            self._check()

    def _check(self) -> None:
        folder = self._folder
        job = Job(lambda _: check_writable(folder), self)
        job.start(lambda _: self._set_fault(""), self._set_fault)

    def _set_fault(self, fault: str) -> None:
        if fault != self._fault:
            self._fault = fault
            self.fault_changed.emit(fault)


LONGEST_FAREWELL = 2.0  # s that a camera may hold up the end of the program
SETTINGS = "settings"  # cause of notifications


class WorkbenchPart(Protocol):
    """What an extension starts and ends with the workbench."""

    def shut_down(self) -> None:
        """Begin to end; its signals start nothing more."""

    def await_end(self, timeout_s: float) -> bool:
        """Wait for the end and return whether it came."""


class Workbench(QObject):
    """Creates and connects the models; each page receives those it needs."""

    def __init__(
        self,
        settings: Settings,
        folder: Path,
        around: SourceEnvironment | None = None,
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self.settings = settings
        self.folder = folder
        self.around = around = around or SourceEnvironment()
        self.notifications = notices = Notifications(self)
        self.selection = Selection(settings, self)
        self.run = SwingRun(folder, around.now, notices, self)
        self.parts: list[WorkbenchPart] = []  # of extensions, which add them
        self.live = LiveView(self.run, notices, self)
        self.library = LibraryWatch(
            folder, self.run.logbook, DueRule(), around.now, notices, self
        )
        self.pens = PenFiles(
            self.selection, self.library, notices, folder, around.now, self
        )
        self.camera_files = FilesOfCameras(self.selection, settings, notices, self)
        self.folder_watch = FolderWatch(folder, self)
        self.archive_writer = ArchiveWriter(
            folder, self.run.logbook, around.now, notices, self
        )
        self.save_place = SavePlace(settings, self.run, around.now)

        # Connections: models get a choice before views do
        self.selection.changed.connect(self._update_runner)
        self.camera = CameraSetup(self.selection, self.live, settings, around, self)
        samples = folder / SIMULATED
        self.files = ChosenFiles(self.selection, notices, samples, around, self)
        self.run.changed.connect(self._keep_heading)
        self.run.result_changed.connect(self.library.refresh)
        settings.failed.connect(self._on_settings_failed)
        settings.recovered.connect(self._on_settings_recovered)

    def start(self) -> None:
        """Restore the last selection and open the camera."""
        if self.settings.fault is not None:
            self._on_settings_failed(self.settings.fault)
        folder = self.folder  # no reference to self, which a job could outlive
        Job(lambda _: sweep_leftovers(folder), self).start()
        self.run.runner.ask(lambda workflow: workflow.open_logbook())
        self._read_supervision()
        self.library.refresh()
        self.folder_watch.start()
        self.selection.open_last_station()
        self.files.start()
        self.camera.open()

    def shut_down(self, timeout_s: float = CLOSING_TIME) -> bool:
        """Close the camera, cancel the jobs of all pages and wait for their end.

        Returns whether all ended. Jobs that do not end in time are left behind:
        acknowledged data is on the disk.
        """
        deadline = monotonic() + timeout_s
        self.run.blockSignals(True)  # its signals start nothing more
        self.folder_watch.stop()
        self.pens.shut_down()
        self.camera_files.shut_down()
        self.library.shut_down()
        self.run.runner.shut_down()
        for part in self.parts:
            part.shut_down()
        self.live.close()
        pool = QThreadPool.globalInstance()
        jobs_ended = pool.waitForDone(round(1000 * timeout_s))
        # A dead camera may take longer, and has nothing to tell any more.
        of_camera = min(max(0.0, deadline - monotonic()), LONGEST_FAREWELL)
        has_closed = self.live.await_closed(of_camera)
        has_ended = all(
            part.await_end(max(0.0, deadline - monotonic()))
            for part in (self.run.runner, *self.parts)
        )
        pool.waitForDone(round(1000 * max(0.0, deadline - monotonic())))
        is_saved = self.settings.await_saved(max(0.0, deadline - monotonic()))
        return jobs_ended and has_closed and has_ended and is_saved

    def _keep_heading(self) -> None:
        """Remember the operator's heading for the next swings."""
        status, chosen = self.run.status, self.selection.preparation
        if status.state is None or not status.is_capturing or status.is_recording:
            return
        if status.state.heading != chosen.heading:
            now = replace(chosen, heading=status.state.heading)
            self.selection.set_preparation(now)

    def _update_runner(self) -> None:
        chosen = self.selection.preparation
        self.run.runner.ask(lambda workflow: workflow.choose(chosen))
        self.library.set_rule(self.selection.limits.due)

    def _read_supervision(self) -> None:
        folder = self.folder
        job = Job(lambda _: read_supervision(folder), self)
        job.start(
            self._on_supervision_read,
            lambda why: self.notifications.notify("supervision", why),
        )

    def _on_supervision_read(self, supervision: Supervision) -> None:
        if supervision.is_guarded:
            self.selection.set_supervision(supervision)

    def _on_settings_failed(self, why: Message) -> None:
        self.notifications.notify(SETTINGS, worded(why))

    def _on_settings_recovered(self) -> None:
        self.notifications.withdraw(SETTINGS)
