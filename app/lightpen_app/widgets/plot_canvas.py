"""Canvas of the plots: area and axes."""

from collections.abc import Sequence
from typing import TypeAlias

import pyqtgraph as pg
from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QPainter, QPaintEvent, QResizeEvent
from typing_extensions import override

from lightpen_app.look.quantities import number_text

LABELLED = (1, 2, 5)  # of each decade
LEAST_LABELLED = 2  # else all are

# As pyqtgraph hands them to `drawPicture`: line, ticks, and place, flags and text.
TextSpec: TypeAlias = tuple[QRectF, Qt.AlignmentFlag, str]
DrawSpecs: TypeAlias = tuple[tuple[object, ...], list[object], list[TextSpec]]


class ReadableAxis(pg.AxisItem):  # type: ignore[misc]  # pyqtgraph has no types
    """An axis with decades as 10, 20, 50, 100 instead of 1e+02.

    Of numbers that would overlap only as many are drawn as there is room for, those of
    a linear axis with the same number of decimals.
    """

    @override
    def generateDrawSpecs(self, p: QPainter) -> DrawSpecs | None:
        specs: DrawSpecs | None = super().generateDrawSpecs(p)
        if specs is None:
            return None
        line, ticks, words = specs
        if self.logMode:
            words = sorted(words, key=_is_between_decades)
        free: list[TextSpec] = []
        for each in words:
            if each[2] and not any(each[0].intersects(other[0]) for other in free):
                free.append(each)
        return line, ticks, free if self.logMode else _with_equal_decimals(free)

    @override
    def logTickStrings(
        self, values: Sequence[float], scale: float, spacing: float
    ) -> list[str]:
        numbers = (10 ** float(value) for value in values)
        leading = ((number, float(f"{number:e}"[:3])) for number in numbers)
        words = [(f"{number:g}", digit in LABELLED) for number, digit in leading]
        are_few = sum(is_labelled for _, is_labelled in words) < LEAST_LABELLED
        return [word if is_labelled or are_few else "" for word, is_labelled in words]


def _with_equal_decimals(words: list[TextSpec]) -> list[TextSpec]:
    """Return numbers as texts with equal decimals, the most that any needs."""
    if any("e" in text for _, _, text in words):
        return words
    n = max((len(text.partition(".")[2]) for _, _, text in words), default=0)
    return [(place, flags, number_text(float(text), n)) for place, flags, text in words]


def _is_between_decades(spec: TextSpec) -> bool:
    """Return whether a number is no power of ten; they are drawn first."""
    return spec[2].strip("0.") != "1"


class Canvas(pg.PlotWidget):  # type: ignore[misc]  # pyqtgraph has no types
    """Drawing area that is laid out once it is painted.

    A page is resized several times before it is seen, and its axes cost as much each.
    """

    _is_resized = False

    @override
    def resizeEvent(self, event: QResizeEvent | None) -> None:
        self._is_resized = True

    @override
    def paintEvent(self, event: QPaintEvent) -> None:
        self.fit()
        super().paintEvent(event)

    def fit(self) -> None:
        """Lay out for the present size."""
        if self._is_resized:
            self._is_resized = False
            super().resizeEvent(None)
