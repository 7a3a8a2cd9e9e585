"""The runner of a verification as a Qt object with signals."""

from collections.abc import Callable
from datetime import datetime
from pathlib import Path

from PySide6.QtCore import QObject, Signal
from typing_extensions import override

from lightpen.record.results.result_folder import FolderArchive
from lightpen_app.work.job import Notifications
from lightpen_app.work.swing_run import RunView
from lightpen_extensions.measure.probing_operator import ProbingOperator
from lightpen_extensions.measure.runner import VerificationRunner
from lightpen_extensions.measure.session import SessionEventKind, VerificationStatus


class VerificationRun(RunView[VerificationStatus, SessionEventKind]):
    """Status and events of a verification as Qt signals; commands go to its `runner`.

    `progressed` reports recorded images that are read.
    """

    files_changed = Signal()  # a verification was kept in files

    def __init__(
        self,
        archive: FolderArchive,
        folder: Path,
        now: Callable[[], datetime],
        notifications: Notifications,
        parent: QObject | None = None,
    ) -> None:
        super().__init__(VerificationStatus(), notifications, parent)
        self.probing_operator: ProbingOperator | None = None  # leads a simulated hand
        self.runner = VerificationRunner(archive, folder, self, now)

    def shut_down(self) -> None:
        """Write the results and end; its signals start nothing more."""
        self.blockSignals(True)
        self.runner.shut_down()

    def await_end(self, timeout_s: float) -> bool:
        """Wait for the end after `shut_down` and return whether it came."""
        return self.runner.await_end(timeout_s)

    def on_verification(
        self, status: VerificationStatus, events: tuple[SessionEventKind, ...]
    ) -> None:
        """Forward the newest status and every event, on a thread of the runner."""
        probing_operator, setup, state = (
            self.probing_operator,
            status.setup,
            status.state,
        )
        if probing_operator is not None and setup is not None and state is not None:
            probing_operator.follow(setup, state)
        self.post(status, events)

    @override
    def _compare(self, before: VerificationStatus, now: VerificationStatus) -> None:
        if before.files != now.files:
            self.files_changed.emit()
