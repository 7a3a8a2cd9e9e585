"""The runner of a verification as an object of Qt: what it tells, as signals."""

from collections.abc import Callable
from datetime import datetime
from pathlib import Path

from PySide6.QtCore import QObject

from lightpen.record.folder_archive import FolderArchive
from lightpen.simulator.toucher import Toucher
from lightpen.verification.runner import VerificationRunner
from lightpen.verification.status import SessionHappening, VerificationStatus
from lightpen_app.work.run_view import RunView


class VerificationRun(RunView[VerificationStatus, SessionHappening]):
    """Shows the GUI what its `runner` does to verify a tip.

    `progressed` tells of recorded images that are read.

    Parameters
    ----------
    archive : FolderArchive
        Of the accepted results.
    folder : Path
        What is found is kept in it.
    now : callable
        Returns date and time with the time zone.

    Attributes
    ----------
    toucher : Toucher or None
        Leads the hand of a simulated operator, if one is to do what is asked for.
    """

    def __init__(
        self,
        archive: FolderArchive,
        folder: Path,
        now: Callable[[], datetime],
        parent: QObject | None = None,
    ) -> None:
        super().__init__(VerificationStatus(), parent)
        self.toucher: Toucher | None = None
        self.runner = VerificationRunner(archive, folder, self, now)

    def on_verification(
        self, status: VerificationStatus, events: tuple[SessionHappening, ...]
    ) -> None:
        """Hand on the newest status and every event, on a thread of the runner."""
        toucher, setup, state = self.toucher, status.setup, status.state
        if toucher is not None and setup is not None and state is not None:
            toucher.follow(setup, state)
        self.tell(status, events)
