"""Looks for the cameras that there are."""

from functools import partial

from PySide6.QtCore import QObject, Signal

from lightpen.cameras.source import FoundDevice
from lightpen.cameras.sources import source_named
from lightpen_app.work.job import Job, Report
from lightpen_app.work.live_view import LiveView


class CameraSearch(QObject):
    """One search at a time; of the one before nothing is told any more.

    A camera that is open is closed first: some libraries end the stream of one while
    they look for others.

    Signals
    -------
    succeeded(tuple of FoundDevice)
    failed(str)
        The sentence why no cameras can be looked for.
    camera_wanted()
        It is over, and the camera that was open may be opened again.
    """

    succeeded = Signal(object)
    failed = Signal(str)
    camera_wanted = Signal()

    def __init__(self, live: LiveView, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._live = live
        self._job: Job | None = None

    def start(self, kind: str, producer: str) -> None:
        """Look for the cameras of a source, by a GenTL producer where it needs one."""
        source = source_named(kind)
        if source is None:
            return
        if self._job is not None:
            self._job.cancel()
        was_open = self._live.is_open
        self._live.close()
        find, live = source.find, self._live

        def search(_: Report) -> tuple[FoundDevice, ...]:
            live.await_closed()
            return find(producer)

        self._job = job = Job(search, self)

        # Connections
        job.succeeded.connect(self.succeeded)
        job.failed.connect(self.failed)
        job.ended.connect(partial(self._on_ended, job, was_open=was_open))
        job.start()

    def _on_ended(self, job: Job, *, was_open: bool) -> None:
        if job is not self._job:
            return
        self._job = None
        if was_open and not self._live.is_open:
            self.camera_wanted.emit()
