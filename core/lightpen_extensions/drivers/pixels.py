"""Images as cameras send them, decoded to grey values at their full depth."""

import cv2
import numpy as np
import numpy.typing as npt

from lightpen.arrays import Image
from lightpen.cameras.pixel_formats import Layout, PixelFormat, pixel_format_named

Bytes = npt.NDArray[np.uint8]


def usable(names: tuple[str, ...]) -> tuple[str, ...]:
    """Return the formats that can be decoded, best first.

    Grey comes before colour, and whole bytes before packed ones.
    """
    formats = [found for name in names if (found := pixel_format_named(name))]
    formats.sort(key=lambda f: (not f.is_mono, f.layout is not Layout.WHOLE, f.bits))
    return tuple(each.name for each in formats)


def decoded(
    data: Bytes, width: int, height: int, pixel_format: PixelFormat, padding: int = 0
) -> Image:
    """Return the grey values (H, W) of an image as a camera sent it, not stretched.

    They are 8 bit, or 16 bit for deeper formats, and may share the memory of the data.
    ``padding`` is the number of bytes at the end of each row. Raises `ValueError` if
    there are too few bytes.
    """
    size = pixel_format.size(width, height, padding)
    if len(data) < size:
        raise ValueError(f"`data` must have {size} bytes, got {len(data)}.")
    if pixel_format.layout is not Layout.WHOLE:
        # Rows follow each other without a gap, also within a byte.
        values = _unpacked(data[:size], width * height, pixel_format)
        return _grey(values.reshape(height, width), pixel_format)
    rows = data[:size].reshape(height, -1)
    values = np.ascontiguousarray(rows[:, : rows.shape[1] - padding])
    if pixel_format.bits == 8:
        return _grey(values, pixel_format)
    return _grey(values.view("<u2").astype(np.uint16, copy=False), pixel_format)


def _grey(values: Image, pixel_format: PixelFormat) -> Image:
    n_channels = pixel_format.n_channels
    grey: Image
    if pixel_format.to_grey is None:
        grey = values[:, pixel_format.luminance :: n_channels]
        return grey if n_channels == 1 else grey.copy()
    pixels = values.reshape(len(values), -1, n_channels) if n_channels > 1 else values
    converted = cv2.cvtColor(pixels, pixel_format.to_grey)
    return np.asarray(converted).view(values.dtype)


def _unpacked(data: Bytes, n_values: int, pixel_format: PixelFormat) -> Image:
    """Return packed values, (N,)."""
    bits = pixel_format.bits
    n_in_group = 4 if pixel_format.layout is Layout.STREAM and bits == 10 else 2
    group_size = 5 if n_in_group == 4 else 3
    n_groups = -(-n_values // n_in_group)
    if len(data) < n_groups * group_size:  # of the last group a part is not needed
        data = np.pad(data, (0, n_groups * group_size - len(data)))
    groups = data.reshape(n_groups, group_size)
    values = np.empty((n_groups, n_in_group), np.uint16)
    for i in range(n_in_group):
        if pixel_format.layout is Layout.STREAM:
            first, shift = divmod(i * bits, 8)
            both = groups[:, first] | groups[:, first + 1].astype(np.uint16) << 8
            values[:, i] = (both >> shift) & (2**bits - 1)
        else:
            low = groups[:, 1] >> (4 * i) & (2 ** (bits - 8) - 1)
            values[:, i] = groups[:, 2 * i].astype(np.uint16) << (bits - 8) | low
    return values.reshape(-1)[:n_values]
