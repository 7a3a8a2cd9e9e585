"""Reads the files that are chosen, and tells why one is not."""

from collections.abc import Callable

from PySide6.QtCore import QObject, Signal

from lightpen.formats.opened_files import OpenedFiles
from lightpen_app.look.sentences import worded
from lightpen_app.work.job import Job, Report


class FileReading(QObject):
    """One reading at a time; of the one before nothing is told any more.

    Signals
    -------
    troubled(str)
        The sentence why a file is not chosen.
    relieved(str)
        A sentence of `troubled` that no longer matters: other files are chosen.
    """

    troubled = Signal(str)
    relieved = Signal(str)

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._job: Job | None = None
        self._told: list[str] = []

    @property
    def is_under_way(self) -> bool:
        """Whether files are being read, or sample files written."""
        return self._job is not None

    def start(
        self,
        function: Callable[[Report], OpenedFiles],
        on_read: Callable[[OpenedFiles], None],
    ) -> None:
        """Read files, and hand them over once their troubles are told."""
        self.cancel()
        self._job = job = Job(function, self)

        # Connections
        job.succeeded.connect(self._on_succeeded)
        job.succeeded.connect(on_read)
        job.failed.connect(self._on_failed)
        job.start()

    def cancel(self) -> None:
        """Tell nothing more of what is being read."""
        job, self._job = self._job, None
        if job is not None:
            job.cancel()

    def relieve(self) -> None:
        """Take back why files were not chosen: others are."""
        while self._told:
            self.relieved.emit(self._told.pop())

    def _on_succeeded(self, opened: OpenedFiles) -> None:
        self._job = None
        for trouble in opened.troubles:
            self._tell(worded(trouble))

    def _on_failed(self, sentence: str) -> None:
        self._job = None
        self._tell(sentence)

    def _tell(self, sentence: str) -> None:
        self._told.append(sentence)
        self.troubled.emit(sentence)
