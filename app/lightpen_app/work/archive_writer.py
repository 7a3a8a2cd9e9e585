"""Enters events of stored files in the archive."""

from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject

from lightpen.archive.logbook.lazy_logbook import LazyLogbook
from lightpen.record.swings.names import Names
from lightpen_app.work.job import Job, Report
from lightpen_app.work.notifications import Notifications

if TYPE_CHECKING:
    from lightpen.record.folder.camera_calibrations import CameraTrial


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

    def keep_camera_trial(self, trial: "CameraTrial", names: Names) -> None:
        """Keep the result of the calibration of a camera, and enter it."""
        from lightpen.record.folder.camera_calibrations import keep_camera_trial

        logbook, folder, now = self._logbook, self._folder, self._now

        def keep(_: Report) -> None:
            keep_camera_trial(folder, trial, names, now())
            logbook.enter_owed()

        job = Job(keep, self)
        job.start(failed=self._on_failed)

    def _on_failed(self, why: str) -> None:
        self._notifications.notify(self, why)
