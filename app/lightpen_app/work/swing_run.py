"""The runner of a swing as an object of Qt: what it tells, as signals."""

import os
from collections.abc import Callable
from datetime import datetime
from pathlib import Path

from PySide6.QtCore import QObject

from lightpen.archive.late_logbook import SERVER, LateLogbook
from lightpen.record.folder_archive import RECORDS, FolderArchive
from lightpen.simulator.follower import Follower
from lightpen.swing.runner import SwingRunner
from lightpen.swing.state import SwingEvent
from lightpen.swing.status import SwingStatus
from lightpen_app.work.run_view import RunView


class SwingRun(RunView[SwingStatus, SwingEvent]):
    """Shows the GUI what its `runner` does with a swing.

    `progressed` tells of solving; the verdict is an event, too.

    Parameters
    ----------
    folder : Path
        Records and results are kept in it.
    now : callable
        Returns date and time with the time zone.

    Attributes
    ----------
    follower : Follower or None
        Leads the hand of a simulated operator, if one is to do what is asked for.
    logbook : LateLogbook
        All that becomes of swings is entered in it; any thread may use it.
    """

    def __init__(
        self,
        folder: Path,
        now: Callable[[], datetime],
        parent: QObject | None = None,
    ) -> None:
        super().__init__(SwingStatus(), parent)
        self._folder = folder
        self._archive = FolderArchive(folder)
        self.follower: Follower | None = None
        self.logbook = LateLogbook(folder, os.environ.get(SERVER, ""))
        self.runner = SwingRunner(
            *(self.records_folder, self.archive, self, now), self.logbook
        )

    @property
    def archive(self) -> FolderArchive:
        """Where accepted results are kept."""
        return self._archive

    @property
    def records_folder(self) -> Path:
        """Where swings are recorded."""
        return self._folder / RECORDS

    def on_swing(self, status: SwingStatus, events: tuple[SwingEvent, ...]) -> None:
        """Hand on the newest status and every event, on a thread of the runner."""
        follower = self.follower
        if follower is not None and status.state is not None:
            follower.follow(status.state)
        self.tell(status, events)
