"""Pixel formats of cameras.

The names are those of the GenICam Pixel Format Naming Convention (PFNC) and, for
packed ones, also of GigE Vision 1: ``Mono12p`` and ``Mono12Packed`` order their bits
in different ways. Bayer patterns and colours become grey, which costs sharpness, as
each pixel is then interpolated from its neighbours.
"""

import re
from dataclasses import dataclass
from enum import Enum, auto

import cv2


class Layout(Enum):
    """Memory layout of pixels."""

    WHOLE = auto()  # in one byte each, or in two if they have more than 8 bits
    PACKED = auto()  # two in three bytes, their low bits in the one between
    STREAM = auto()  # bit after bit, the lowest first


@dataclass(frozen=True)
class PixelFormat:
    """A pixel format that can be decoded."""

    name: str
    bits: int = 8  # per value
    layout: Layout = Layout.WHOLE
    n_channels: int = 1  # values of a pixel
    # Conversion of OpenCV; None where values hold grey or the luminance.
    to_grey: int | None = None
    luminance: int = 0  # its index among the values of a pixel

    @property
    def full_scale(self) -> int:
        """Brightest value a pixel can have."""
        return int(2**self.bits - 1)

    @property
    def is_mono(self) -> bool:
        """Whether each pixel is a direct measurement (no Bayer pattern)."""
        return self.to_grey is None and self.n_channels == 1

    def size(self, width: int, height: int, padding: int = 0) -> int:
        """Return the size of an image with padded rows, bytes."""
        n_values = width * height * self.n_channels
        if self.layout is not Layout.WHOLE:
            bits = 12 if self.layout is Layout.PACKED else self.bits
            return -(-n_values * bits // 8)
        return n_values * (1 if self.bits == 8 else 2) + height * padding


# PFNC names a pattern by its first two pixels, as these constants of OpenCV do; its
# older ones name the colour of the second row and column.
_BAYER = {
    "RG": cv2.COLOR_BayerRGGB2GRAY,
    "GR": cv2.COLOR_BayerGRBG2GRAY,
    "GB": cv2.COLOR_BayerGBRG2GRAY,
    "BG": cv2.COLOR_BayerBGGR2GRAY,
}
_COLOURS = {
    "RGB": (3, cv2.COLOR_RGB2GRAY),
    "BGR": (3, cv2.COLOR_BGR2GRAY),
    "RGBa": (4, cv2.COLOR_RGBA2GRAY),
    "RGBA": (4, cv2.COLOR_RGBA2GRAY),
    "BGRa": (4, cv2.COLOR_BGRA2GRAY),
    "BGRA": (4, cv2.COLOR_BGRA2GRAY),
}
_LUMINANCES = {
    "YUV422_8": 0,
    "YUV422_YUYV_Packed": 0,
    "YCbCr422_8": 0,
    "YUV422_8_UYVY": 1,
    "YUV422Packed": 1,
}
_LAYOUTS = {"": Layout.WHOLE, "Packed": Layout.PACKED, "p": Layout.STREAM}


def pixel_format_named(name: str) -> PixelFormat | None:
    """Return a pixel format by name; None if it cannot be decoded."""
    if name in _LUMINANCES:
        return PixelFormat(name, n_channels=2, luminance=_LUMINANCES[name])
    found = re.fullmatch(
        r"(Mono|Bayer(..)|[RGBAa]{3,4})(8|10|12|14|16)(p|Packed)?", name
    )
    if found is None:
        return None
    kind, pattern, bits, packing = found.groups(default="")
    colour = _COLOURS.get(kind)
    if colour is not None and packing != "p":  # "RGB8Packed" says no more than "RGB8"
        return PixelFormat(name, int(bits), Layout.WHOLE, *colour)
    if not (kind == "Mono" or pattern in _BAYER):
        return None
    layout = _LAYOUTS[packing]
    if layout is not Layout.WHOLE and bits not in {"10", "12"}:
        return None
    return PixelFormat(name, int(bits), layout, to_grey=_BAYER.get(pattern))
