"""Features of a camera as settings."""

from collections.abc import Iterable
from typing import Protocol

from lightpen.cameras.protocol import (
    CameraCapabilities,
    CameraSettings,
    ConfigError,
    Range,
    Region,
    RegionLimits,
    TriggerMode,
)
from lightpen_extensions.drivers.pixels import usable

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

    def choice(self, name: str) -> str:
        """Return the current entry of an enumeration."""

    def choices(self, name: str) -> tuple[str, ...]:
        """Return the entries of an enumeration that can be chosen now."""

    def set(self, name: str, value: float | str | bool) -> None:
        """Set a number within its limits, an entry of an enumeration or a switch."""

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
            features.set(name, "Off")
    _choose_pixel_format(features, wanted.pixel_format)
    if wanted.region is not None:
        _set_region(features, wanted.region)
    _choose_trigger(features, wanted.trigger)
    set_nearest(features, (PACKET_SIZE,), wanted.packet_size)
    if wanted.frame_rate is not None:
        for name in FRAME_RATE_SWITCHES:
            if features.has(name):
                features.set(name, True)
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
        features.set(name, features.limits(name).nearest(value))
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
        features.set("OffsetX", 0)
        features.set("OffsetY", 0)
    features.set("Width", region.width)
    features.set("Height", region.height)
    if has_offsets:
        features.set("OffsetX", region.x)
        features.set("OffsetY", region.y)


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
    features.set("PixelFormat", wanted)


def _choose_trigger(features: Features, wanted: TriggerMode | None) -> None:
    """Choose the trigger mode; never an external line."""
    if wanted is None:
        wanted = _trigger(features)
    if not features.has("TriggerMode"):
        return
    if not _has_trigger(features):
        wanted = TriggerMode.FREE
    if _offers(features, "TriggerSelector", "FrameStart"):
        features.set("TriggerSelector", "FrameStart")
    if wanted is TriggerMode.SOFTWARE:
        features.set("TriggerSource", "Software")
    features.set("TriggerMode", "On" if wanted is TriggerMode.SOFTWARE else "Off")


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
