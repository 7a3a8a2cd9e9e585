"""What is seen in a picture."""

from typing import Any

import numpy as np
import pyqtgraph as pg
from PySide6.QtGui import QImage
from PySide6.QtWidgets import QWidget

from lightpen.arrays import FloatArray


def colors_in(image: QImage) -> set[str]:
    """Return the colours of all pixels, each as "#rrggbb"."""
    rgb = image.convertToFormat(QImage.Format.Format_RGB32)
    values = np.unique(np.frombuffer(rgb.constBits(), np.uint32)) & 0xFFFFFF
    return {f"#{value:06x}" for value in values.tolist()}


def data_of(plot: QWidget, kind: type) -> FloatArray:
    """Return x and y, (2, N), of the first item of a kind on a plot."""
    items = plot.findChildren(pg.PlotWidget)[0].getPlotItem().items
    first: Any = next(each for each in items if isinstance(each, kind))
    return np.array(first.getData(), dtype=np.float64)
