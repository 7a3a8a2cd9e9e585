"""The live stream of pose and tip as a Qt object: settings and state."""

from PySide6.QtCore import QObject, Qt, Signal

from lightpen.cameras.clock import Clock
from lightpen.errors import LightpenError
from lightpen.local_time import local_now
from lightpen.record.calibrations.export_status import with_status
from lightpen.record.results.result_folder import FolderArchive
from lightpen.swing.preparation import Preparation
from lightpen_app.work.job import Job, LatestJob, Report
from lightpen_extensions.measure.probing.current_tip import read_tip_in_force
from lightpen_extensions.stream.messages import StreamedTip, tip_metadata
from lightpen_extensions.stream.server import PoseStream, StreamPlace, StreamStatus


class Streaming(QObject):
    """Opens and closes the stream and updates its tip.

    ``clock`` is the clock of the cameras.
    """

    changed = Signal()  # `status`, `has_tip` or `fault` is different
    _status_changed = Signal()

    def __init__(
        self, archive: FolderArchive, clock: Clock, parent: QObject | None = None
    ) -> None:
        super().__init__(parent)
        self._archive = archive
        self._preparation = Preparation()
        self._wanted: StreamPlace | None = None
        self._opened: StreamPlace | None = None  # that is open, or was tried
        self._opening: Job | None = None
        self._reading = LatestJob(self)
        self._has_tip = False
        self._fault = ""
        # It takes every image, on the thread of the pipeline.
        self.stream = PoseStream(clock, lambda status: self._status_changed.emit())

        # Connections
        self._status_changed.connect(self.changed, Qt.ConnectionType.QueuedConnection)

    @property
    def status(self) -> StreamStatus:
        """Address and number of clients."""
        return self.stream.status

    @property
    def has_tip(self) -> bool:
        """Whether the place of a tip is streamed, and not the pose alone."""
        return self._has_tip

    @property
    def fault(self) -> str:
        """Why the stream is unavailable; empty if it runs or is off."""
        return self._fault

    def want(self, place: StreamPlace | None) -> None:
        """Stream to an address; None stops the stream."""
        self._wanted = place
        self._follow()

    def choose(self, preparation: Preparation) -> None:
        """Set the selected pen and tip, and their files."""
        is_same = _what_counts(preparation) == _what_counts(self._preparation)
        self._preparation = preparation
        if not is_same:
            self.read_tip()

    def read_tip(self) -> None:
        """Read the current tip, which may have changed."""
        self._reading.cancel()
        if self._wanted is None:
            return
        archive, preparation = self._archive, self._preparation
        self._reading.start(lambda _: _tip(archive, preparation), self._on_tip_read)

    def shut_down(self) -> None:
        """Stream to nobody more; what a job has still to tell begins nothing more."""
        self._wanted = self._opened = None

    def await_end(self, timeout_s: float) -> bool:
        """Close the stream after all jobs have ended, and return whether it is."""
        self.stream.close()
        return True

    def _follow(self) -> None:
        """Open or close the stream in a job, since names are looked up."""
        if self._opening is not None or self._wanted == self._opened:
            return
        self._opened = place = self._wanted
        stream = self.stream

        def follow(_: Report) -> None:
            stream.close()
            if place is not None:
                stream.open(place)

        self._set_fault("")
        self._opening = job = Job(follow, self)
        job.start(failed=self._set_fault, ended=self._on_opening_ended)

    def _set_fault(self, fault: str) -> None:
        self._fault = fault
        self.changed.emit()

    def _on_opening_ended(self) -> None:
        self._opening = None
        self._follow()
        self.read_tip()
        self.changed.emit()

    def _on_tip_read(self, tip: StreamedTip | None) -> None:
        self.stream.set_tip(tip)
        self._has_tip = tip is not None
        self.changed.emit()


def _what_counts(preparation: Preparation) -> tuple[object, ...]:
    return (
        preparation.names,
        preparation.origin,
        preparation.second is None,
        preparation.camera_file,
        preparation.pen_file,
    )


def _tip(archive: FolderArchive, preparation: Preparation) -> StreamedTip | None:
    """Return the current tip; None if it is unknown or unusable."""
    if preparation.camera_file is None or preparation.pen_file is None:
        return None
    try:
        tip = read_tip_in_force(archive, preparation)
    except LightpenError:  # the step Verify says why
        return None
    metadata = tip_metadata(with_status(tip.calibration, local_now()))
    return StreamedTip(tip.names, tip.instrument, metadata)
