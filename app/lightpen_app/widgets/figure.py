"""A figure that can be saved as PNG."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeAlias

from PySide6.QtCore import (
    QBuffer,
    QByteArray,
    QEvent,
    QPoint,
    QRectF,
    QSize,
    Qt,
    Signal,
)
from PySide6.QtGui import QColor, QImage, QPainter
from PySide6.QtWidgets import QSizePolicy, QWidget
from typing_extensions import override

from lightpen.arrays import FloatArray
from lightpen_app.look.theme import GRID, TextSize, colors_of, font
from lightpen_app.widgets.fields import anew

PNG_SCALE = 2
MARK_HEIGHT = 3 * GRID  # px, below a saved plot

Column: TypeAlias = FloatArray | tuple[str, ...]


@dataclass(frozen=True)
class Axes:
    """Words of a plot."""

    title: str  # quantity with its unit
    x: str = ""  # name of the axis; empty to leave it out
    y: str = ""  # likewise


class Figure(QWidget):
    """Base of the figures: their words and numbers, and how they are saved."""

    titled = Signal()  # title or labels changed

    def __init__(self) -> None:
        super().__init__()
        self._columns: dict[str, Column] = {}
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)

    def set_axes(self, axes: Axes) -> None:
        """Change the words; they follow the language."""
        self._axes = axes
        self.setAccessibleName(axes.title)
        self._restyle()
        self.titled.emit()

    @override
    def changeEvent(self, event: QEvent) -> None:
        super().changeEvent(event)
        if event.type() == QEvent.Type.LanguageChange:
            now = self._axes
            self.set_axes(Axes(anew(now.title), anew(now.x), anew(now.y)))

    def png(self, mark: str = "") -> bytes:
        """Return the plot, with a mark below it, as a picture at twice the size."""
        self.grab()  # lays out a plot that was never shown
        below = MARK_HEIGHT if mark else 0
        colors = colors_of(self.palette())
        size = self.size() + QSize(0, below)
        image = QImage(size * PNG_SCALE, QImage.Format.Format_RGB32)
        image.setDevicePixelRatio(PNG_SCALE)
        image.fill(QColor(colors.panel))
        painter = QPainter(image)
        self.render(painter, QPoint())
        painter.setFont(font(TextSize.SMALL, bold=True))
        painter.setPen(QColor(colors.warn))
        place = QRectF(GRID, self.height(), self.width() - 2 * GRID, below)
        side = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
        painter.drawText(place, side, mark)
        painter.end()
        data = QByteArray()
        buffer = QBuffer(data)
        buffer.open(QBuffer.OpenModeFlag.WriteOnly)
        # The stub of Qt wants bytes for the format, Qt itself a text.
        image.save(buffer, "PNG")  # type: ignore[call-overload]
        return bytes(data.data())

    def columns(self) -> Mapping[str, Column]:
        """Return the displayed data by name."""
        return self._columns

    @override
    def sizeHint(self) -> QSize:
        return QSize(360, 200)

    @override
    def minimumSizeHint(self) -> QSize:
        return QSize(160, 152)

    def _restyle(self) -> None:
        """Update words and colours."""
        raise NotImplementedError
