"""Recognise the raw image of a colour camera by the pattern of its filters.

Each pixel of a Bayer mosaic sees one colour, so cells of 2 x 2 pixels repeat a pattern:
one diagonal is green, on the other are red and blue. Where the colours of the light
differ, the centre of an LED moves by its place in the pattern. Infrared light passes
all filters alike; then there is no pattern, and no harm.
"""

import cv2
import numpy as np

from lightpen.arrays import FloatArray, Image

LIT = 0.25  # of the range of an image: cells above it are looked at
MIN_CELLS = 50
LEAST_SPREAD = 0.08  # of the mean; uneven columns of a sensor differ by 0.02
SAME = 0.25  # of the spread, that the two green pixels of a cell differ by at most


def is_mosaic(image: Image) -> bool | None:
    """Return whether an image (H, W) is a mosaic; None if too little of it is lit."""
    height, width = (side // 2 for side in image.shape)
    if not height or not width:
        return None
    whole = image[: 2 * height, : 2 * width]
    cells = cv2.resize(whole, (width, height), interpolation=cv2.INTER_AREA)
    dark, bright = float(cells.min()), float(cells.max())
    rows, columns = np.nonzero(cells > dark + LIT * (bright - dark))
    if len(rows) < MIN_CELLS:
        return None
    levels = np.array(
        [
            [whole[2 * rows + i, 2 * columns + j].mean() - dark for j in (0, 1)]
            for i in (0, 1)
        ]
    )
    return _is_pattern(levels)


def _is_pattern(levels: FloatArray) -> bool:
    """Tell from the mean levels (2, 2) of the pixels of a cell."""
    spread = float(np.ptp(levels))
    diagonals = abs(levels[0, 0] - levels[1, 1]), abs(levels[0, 1] - levels[1, 0])
    is_uneven = spread > LEAST_SPREAD * levels.mean()
    return bool(is_uneven and min(diagonals) < SAME * spread)
