"""What is seen in a picture."""

import numpy as np
from PySide6.QtGui import QImage


def colors_in(image: QImage) -> set[str]:
    """Return the colours of all pixels, each as "#rrggbb"."""
    rgb = image.convertToFormat(QImage.Format.Format_RGB32)
    values = np.unique(np.frombuffer(rgb.constBits(), np.uint32)) & 0xFFFFFF
    return {f"#{value:06x}" for value in values.tolist()}
