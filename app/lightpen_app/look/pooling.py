"""Images reduced for display."""

import numpy as np

from lightpen.arrays import Image


def pooled(image: Image, bits: int = 8) -> Image:
    """Return an 8-bit image of half the size, each pixel the brightest of four.

    A small LED stays as bright as it was, which averaging would not leave it. Of an
    image with more than 8 bits in use the upper 8 are taken.
    """
    height, width = (size // 2 * 2 for size in image.shape)
    rows = np.maximum(image[0:height:2], image[1:height:2])
    half = np.maximum(rows[:, 0:width:2], rows[:, 1:width:2])
    if half.dtype == np.uint8:
        return half
    return (half >> max(bits - 8, 0)).astype(np.uint8)
