"""Images and events, passed from camera threads to the GUI thread."""

from dataclasses import dataclass
from threading import Lock

from PySide6.QtCore import QObject, QSize, Qt, Signal

from lightpen.arrays import Image
from lightpen.cameras.worker_events import WorkerEvent, WorkerStopped
from lightpen.live.pipeline import LiveImage
from lightpen_app.look.pooling import pooled


@dataclass(frozen=True, eq=False)
class DisplayedImage:
    """A live image, ready to be shown."""

    # (H // 2, W // 2), the image at half its size, see
    # `lightpen_app.look.pooling.pooled`
    half: Image
    size: QSize  # of the whole image, px
    seen: LiveImage


class Mailbox(QObject):
    """One slot between a producing thread and the GUI.

    A queued signal with every image would fill the memory whenever the GUI is busy;
    here only the newest waits, with one pending `ready`.
    """

    ready = Signal()  # a value waits; emitted once until it is taken

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._lock = Lock()
        self._value: object | None = None

    def put(self, value: object) -> None:
        """Put a value, from any thread, in place of the one waiting."""
        with self._lock:
            waited = self._value is not None
            self._value = value
        if not waited:
            self.ready.emit()

    def take(self) -> object | None:
        """Return the newest value, or None if it was taken already."""
        with self._lock:
            value, self._value = self._value, None
        return value


class QueuedListener(QObject):
    """Forwards events from camera threads to the GUI thread.

    Its public signals are emitted on the thread of the GUI, so that blocking them
    there is enough to receive none.
    """

    image_shown = Signal(object)
    event_received = Signal(object, int)
    _event_posted = Signal(object, int)

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self.camera = 0  # whose images are shown
        self._images = Mailbox(self)

        # Connections
        queued = Qt.ConnectionType.QueuedConnection
        self._images.ready.connect(self._on_image_ready, queued)
        self._event_posted.connect(self.event_received, queued)

    def discard(self) -> None:
        """Free the image that waits."""
        self._images.take()

    # On the threads of the camera

    def on_image(self, image: LiveImage) -> None:
        """Put an image into the mailbox of the GUI."""
        if image.camera != self.camera:
            return
        pixels = image.frame.image
        height, width = pixels.shape
        half = pooled(pixels, image.frame.bits)
        self._images.put(DisplayedImage(half, QSize(width, height), image))

    def on_camera(self, event: WorkerEvent, camera: int) -> None:
        """Forward an event of a camera."""
        if not isinstance(event, WorkerStopped):  # the connection closes besides
            self._event_posted.emit(event, camera)

    # On the thread of the GUI

    def _on_image_ready(self) -> None:
        shown = self._images.take()
        if isinstance(shown, DisplayedImage) and shown.seen.camera == self.camera:
            self.image_shown.emit(shown)
