"""The last views of the pen, compared with its LEDs off the GUI thread."""

from PySide6.QtCore import QObject, QTimer, Signal

from lightpen.detection.spots import Spots
from lightpen.model.camera import Camera
from lightpen.model.pen import Pen
from lightpen.pen_check.match import add_view, match_pen
from lightpen_app.work.job import Job

PERIOD_MS = 500


class PenWatch(QObject):
    """Compares a pen with what is seen, at most twice a second.

    Signals
    -------
    value_changed(PenMatch)
        How the pen fits the views so far; None when that has to be found out anew.
    """

    value_changed = Signal(object)

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._camera: Camera | None = None
        self._pen: Pen | None = None
        self._views: tuple[Spots, ...] = ()
        self._compared: tuple[Spots, ...] = ()
        self._job: Job | None = None  # whose outcome is awaited
        self._timer = QTimer(self)
        self._timer.setInterval(PERIOD_MS)

        # Connections
        self._timer.timeout.connect(self._compare)

    def set_pen(self, camera: Camera | None, pen: Pen | None) -> None:
        """Compare with another pen; views of the same camera stay."""
        if camera is not self._camera:
            self._views = ()
        if camera is self._camera and pen is self._pen:
            return
        self._camera, self._pen = camera, pen
        self._forget()
        self._compare()

    def add(self, spots: Spots) -> None:
        """Take in what an image shows."""
        self._views = add_view(self._views, spots)

    def start(self) -> None:
        """Begin with no views."""
        self._views = ()
        self._forget()
        self._timer.start()

    def stop(self) -> None:
        """Compare no more."""
        self._timer.stop()
        self._drop_job()

    def _forget(self) -> None:
        self._compared = ()
        self._drop_job()
        self.value_changed.emit(None)

    def _drop_job(self) -> None:
        if self._job is not None:
            self._job.cancel()
            self._job = None

    def _compare(self) -> None:
        camera, pen, views = self._camera, self._pen, self._views
        if camera is None or pen is None or not views or self._job is not None:
            return
        if views is self._compared:
            return
        self._compared = views
        self._job = job = Job(lambda report: match_pen(camera, pen, views), self)

        # Connections
        job.succeeded.connect(self._on_compared)
        job.crashed.connect(self._on_crashed)
        job.start()

    def _on_compared(self, match: object) -> None:
        self._job = None
        self.value_changed.emit(match)

    def _on_crashed(self) -> None:
        self._job = None
        self.value_changed.emit(None)  # the views after these are compared again
