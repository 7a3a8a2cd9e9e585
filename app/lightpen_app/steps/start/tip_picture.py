"""The picture of a tip, stored or new."""

from collections.abc import Callable

from PySide6.QtCore import QBuffer, QByteArray, QIODevice, QSize, Qt
from PySide6.QtGui import QImage, QImageReader, QPixmap
from PySide6.QtWidgets import QLabel

from lightpen_app.widgets.translated import Translated
from lightpen_app.work.job import LatestJob

ReadPicture = Callable[[], bytes]  # raises a `LightpenError`


class TipPicture(Translated, QLabel):
    """Shows a picture, or why it cannot be shown; it is read off the GUI's thread.

    ``place`` is where it is shown as large as it can be, px.
    """

    def __init__(self, place: QSize) -> None:
        super().__init__()
        self.say(self, self.tr("Picture of the tip"))
        self._job = LatestJob(self)
        self.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self.setWordWrap(True)
        self.setTextFormat(Qt.TextFormat.PlainText)
        self.setFixedSize(place)
        self.setProperty("area", "panel")
        self._retranslate()

    def set_value(self, read: ReadPicture | None) -> None:
        """Show another picture; None for none."""
        self._job.cancel()
        self.clear()
        if read is None:
            self._retranslate()
            return
        place, density = self.size(), self.devicePixelRatioF()
        self._job.start(
            lambda _: _scaled(read, place, density), self._on_read, self.setText
        )

    def _on_read(self, image: QImage) -> None:
        self.setPixmap(QPixmap.fromImage(image))

    def _retranslate(self) -> None:
        if not self._job.is_running and self.pixmap().isNull():
            self.setText(self.tr("No picture"))


def _scaled(read: ReadPicture, place: QSize, density: float) -> QImage:
    buffer = QBuffer()
    buffer.setData(QByteArray(read()))
    buffer.open(QIODevice.OpenModeFlag.ReadOnly)
    reader = QImageReader(buffer)
    reader.setAutoTransform(True)  # as the camera was held
    size = reader.size().scaled(place * density, Qt.AspectRatioMode.KeepAspectRatio)
    reader.setScaledSize(size)
    image = reader.read()
    image.setDevicePixelRatio(density)
    return image
