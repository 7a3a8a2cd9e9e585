"""What is seen in a picture."""

from typing import Any

import numpy as np
import pyqtgraph as pg
from PySide6.QtGui import QImage
from PySide6.QtWidgets import QWidget

from lightpen.arrays import FloatArray
from lightpen_app.steps.review.result_panel import TipReadout


def colors_in(image: QImage) -> set[str]:
    """Return the colours of all pixels, each as "#rrggbb"."""
    rgb = image.convertToFormat(QImage.Format.Format_RGB32)
    values = np.unique(np.frombuffer(rgb.constBits(), np.uint32)) & 0xFFFFFF
    return {f"#{value:06x}" for value in values.tolist()}


def items_on(plot: QWidget, kind: type = object) -> list[Any]:
    """Return the items of a kind on a plot, the last on top."""
    items = plot.findChildren(pg.PlotWidget)[0].getPlotItem().items
    return [each for each in items if isinstance(each, kind)]


def data_of(plot: QWidget, kind: type, number: int = 0) -> FloatArray:
    """Return x and y, (2, N), of an item of a kind on a plot."""
    return np.array(items_on(plot, kind)[number].getData(), dtype=np.float64)


def ranges_of(plot: QWidget) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return least and greatest x, and least and greatest y, that are shown."""
    x, y = plot.findChildren(pg.PlotWidget)[0].getPlotItem().viewRange()
    return (x[0], x[1]), (y[0], y[1])


def coordinates_of(readout: TipReadout) -> list[str]:
    """Return the numbers of x, y and z and their uncertainties, as shown."""
    labels = zip(readout._numbers, readout._uncertainties, strict=True)
    return [f"{number.text()} {u.text()}" for number, u in labels]
