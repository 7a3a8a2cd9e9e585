"""What all figures have in common."""

from dataclasses import dataclass

from PySide6.QtCore import QEvent, QSize
from PySide6.QtWidgets import QSizePolicy, QWidget
from typing_extensions import override

from lightpen_app.widgets.fields import anew


@dataclass(frozen=True)
class Axes:
    """Words of a plot."""

    title: str  # quantity with its unit
    x: str = ""  # name of the axis; empty to leave it out
    y: str = ""  # likewise


class Figure(QWidget):
    """Base of the figures: their words and sizes."""

    def __init__(self) -> None:
        super().__init__()
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)

    def set_axes(self, axes: Axes) -> None:
        """Change the words; they follow the language."""
        self._axes = axes
        self.setAccessibleName(axes.title)
        self._restyle()

    @override
    def changeEvent(self, event: QEvent) -> None:
        super().changeEvent(event)
        if event.type() == QEvent.Type.LanguageChange:
            now = self._axes
            self.set_axes(Axes(anew(now.title), anew(now.x), anew(now.y)))

    @override
    def sizeHint(self) -> QSize:
        return QSize(360, 200)

    @override
    def minimumSizeHint(self) -> QSize:
        return QSize(160, 152)

    def _restyle(self) -> None:
        """Update words and colours."""
        raise NotImplementedError
