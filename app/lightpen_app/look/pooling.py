"""Images reduced for display."""

import numpy as np

from lightpen.arrays import Image


def pooled(image: Image, bits: int = 8) -> Image:
    """Return an 8-bit image of half the size, each pixel the brightest of four.

    Unlike averaging, this keeps the brightness of small LEDs. Images with more than 8
    used bits are reduced to the upper 8.
    """
    height, width = (size // 2 * 2 for size in image.shape)
    rows = np.maximum(image[0:height:2], image[1:height:2])
    half = np.maximum(rows[:, 0:width:2], rows[:, 1:width:2])
    if half.dtype == np.uint8:
        return half
    return (half >> max(bits - 8, 0)).astype(np.uint8)
