"""Features of a camera as settings, and its pixel formats."""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum, auto
from typing import Protocol

import cv2
import numpy as np
import numpy.typing as npt

from lightpen.arrays import Image
from lightpen.cameras.protocol import (
    CameraCapabilities,
    CameraSettings,
    ConfigError,
    Range,
    Region,
    RegionLimits,
    TriggerMode,
)

# Pixel formats of cameras, decoded to grey values at their full depth.
#
# The names are those of the GenICam Pixel Format Naming Convention (PFNC) and, for
# packed ones, also of GigE Vision 1: ``Mono12p`` and ``Mono12Packed`` order their bits
# in different ways. Bayer patterns and colours become grey, which costs sharpness, as
# each pixel is then interpolated from its neighbours.


Bytes = npt.NDArray[np.uint8]


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


EXPOSURES = ("ExposureTime", "ExposureTimeAbs")
GAINS = ("Gain", "GainAbs", "GainRaw")  # the last one in steps of the camera's own
FRAME_RATES = ("AcquisitionFrameRate", "AcquisitionFrameRateAbs")
FRAME_RATE_SWITCHES = ("AcquisitionFrameRateEnable", "AcquisitionFrameRateEnabled")
AUTOMATICS = ("ExposureAuto", "GainAuto")  # would change the measured brightness
PACKET_SIZE = "GevSCPSPacketSize"


class Features(Protocol):
    """The features of an open camera by their names.

    Each method but `has` may raise `DeviceLost`.
    """

    def has(self, name: str) -> bool:
        """Return whether the camera has a feature that is available now."""

    def number(self, name: str) -> float:
        """Return the value of a number."""

    def limits(self, name: str) -> Range:
        """Return the present range of a number."""

    def set_number(self, name: str, value: float) -> None:
        """Set a number that is within its limits."""

    def choice(self, name: str) -> str:
        """Return the current entry of an enumeration."""

    def choices(self, name: str) -> tuple[str, ...]:
        """Return the entries of an enumeration that can be chosen now."""

    def choose(self, name: str, entry: str) -> None:
        """Choose an entry of an enumeration."""

    def switch_on(self, name: str) -> None:
        """Set a truth value."""

    def execute(self, name: str) -> None:
        """Execute a command."""


def read_capabilities(features: Features) -> CameraCapabilities:
    """Return the capabilities of a camera with its current settings."""
    region = read_region(features)
    triggers = (TriggerMode.FREE, TriggerMode.SOFTWARE)
    return CameraCapabilities(
        width=region.width,
        height=region.height,
        pixel_formats=usable(features.choices("PixelFormat")),
        exposure_us=_limits(features, EXPOSURES),
        gain_db=_limits(features, GAINS),
        frame_rate=_limits(features, FRAME_RATES),
        packet_size=_limits(features, (PACKET_SIZE,)),
        gain_in_db=_first(features, GAINS) != GAINS[-1],
        regions=_region_limits(features, region),
        triggers=triggers if _has_trigger(features) else triggers[:1],
    )


def read_settings(features: Features, caps: CameraCapabilities) -> CameraSettings:
    """Return the current settings."""
    packet_size = _number(features, (PACKET_SIZE,))
    return CameraSettings(
        exposure_us=_number(features, EXPOSURES),
        gain_db=_number(features, GAINS),
        frame_rate=_number(features, FRAME_RATES),
        pixel_format=features.choice("PixelFormat"),
        region=None if caps.regions is None else read_region(features),
        trigger=_trigger(features) if len(caps.triggers) > 1 else None,
        packet_size=None if packet_size is None else int(packet_size),
    )


def apply_settings(features: Features, wanted: CameraSettings) -> None:
    """Apply settings to a stopped camera; values are clipped to their ranges.

    Pixel format and region come before the frame rate, whose range they change. Raises
    `ConfigError` if the pixel format is not offered.
    """
    for name in AUTOMATICS:
        if _offers(features, name, "Off"):
            features.choose(name, "Off")
    _choose_pixel_format(features, wanted.pixel_format)
    if wanted.region is not None:
        _set_region(features, wanted.region)
    _choose_trigger(features, wanted.trigger)
    set_nearest(features, (PACKET_SIZE,), wanted.packet_size)
    if wanted.frame_rate is not None:
        for name in FRAME_RATE_SWITCHES:
            if features.has(name):
                features.switch_on(name)
    # The exposure limits the frame rate and the other way round: the rate once more.
    set_nearest(features, FRAME_RATES, wanted.frame_rate)
    set_nearest(features, EXPOSURES, wanted.exposure_us)
    set_nearest(features, FRAME_RATES, wanted.frame_rate)
    set_nearest(features, GAINS, wanted.gain_db)


def set_nearest(
    features: Features, names: Iterable[str], value: float | None
) -> float | None:
    """Set a number to the nearest possible; return it, None if it is missing."""
    name = _first(features, names)
    if name is None:
        return None
    if value is not None:
        features.set_number(name, features.limits(name).nearest(value))
    return features.number(name)


def read_region(features: Features) -> Region:
    """Return the region of interest."""
    x = _number(features, ("OffsetX",)) or 0.0
    y = _number(features, ("OffsetY",)) or 0.0
    width, height = features.number("Width"), features.number("Height")
    return Region(int(x), int(y), int(width), int(height))


def _region_limits(features: Features, now: Region) -> RegionLimits | None:
    width, height = features.limits("Width"), features.limits("Height")
    if width.low == width.high and height.low == height.high:
        return None
    # The limits of a width are what is left of the sensor at the present offset.
    return RegionLimits(
        Range(width.low, max(width.high + now.x, now.width), max(width.step, 1.0)),
        Range(height.low, max(height.high + now.y, now.height), max(height.step, 1.0)),
        _step(features, "OffsetX"),
        _step(features, "OffsetY"),
    )


def _set_region(features: Features, wanted: Region) -> None:
    now = read_region(features)
    limits = _region_limits(features, now)
    if limits is None:
        return
    region = limits.nearest(wanted)
    has_offsets = features.has("OffsetX") and features.has("OffsetY")
    if has_offsets:
        features.set_number("OffsetX", 0)
        features.set_number("OffsetY", 0)
    features.set_number("Width", region.width)
    features.set_number("Height", region.height)
    if has_offsets:
        features.set_number("OffsetX", region.x)
        features.set_number("OffsetY", region.y)


def _choose_pixel_format(features: Features, wanted: str | None) -> None:
    """Choose a pixel format; by default one that can be decoded."""
    offered = features.choices("PixelFormat")
    usable_ones = usable(offered)
    if wanted is None:
        wanted = features.choice("PixelFormat")
        if wanted in usable_ones:
            return
        if usable_ones:
            wanted = usable_ones[0]
    if wanted not in usable_ones:
        raise ConfigError(
            "camera.pixel-format",
            wanted=wanted,
            offered=", ".join(usable_ones or offered),
        )
    features.choose("PixelFormat", wanted)


def _choose_trigger(features: Features, wanted: TriggerMode | None) -> None:
    """Choose the trigger mode; never an external line."""
    if wanted is None:
        wanted = _trigger(features)
    if not features.has("TriggerMode"):
        return
    if not _has_trigger(features):
        wanted = TriggerMode.FREE
    if _offers(features, "TriggerSelector", "FrameStart"):
        features.choose("TriggerSelector", "FrameStart")
    if wanted is TriggerMode.SOFTWARE:
        features.choose("TriggerSource", "Software")
    features.choose("TriggerMode", "On" if wanted is TriggerMode.SOFTWARE else "Off")


def _has_trigger(features: Features) -> bool:
    return (
        _offers(features, "TriggerMode", "On")
        and _offers(features, "TriggerSource", "Software")
        and features.has("TriggerSoftware")
    )


def _trigger(features: Features) -> TriggerMode:
    if not _has_trigger(features) or features.choice("TriggerMode") != "On":
        return TriggerMode.FREE
    is_by_software = features.choice("TriggerSource") == "Software"
    return TriggerMode.SOFTWARE if is_by_software else TriggerMode.FREE


def _first(features: Features, names: Iterable[str]) -> str | None:
    return next((name for name in names if features.has(name)), None)


def _number(features: Features, names: Iterable[str]) -> float | None:
    name = _first(features, names)
    return None if name is None else features.number(name)


def _limits(features: Features, names: Iterable[str]) -> Range | None:
    name = _first(features, names)
    return None if name is None else features.limits(name)


def _offers(features: Features, name: str, entry: str) -> bool:
    return features.has(name) and entry in features.choices(name)


def _step(features: Features, name: str) -> int:
    return max(int(features.limits(name).step), 1) if features.has(name) else 0
