"""Advice on LEDs that are too dark or too bright."""

from enum import StrEnum

from lightpen.cameras.protocol import CameraCapabilities, CameraSettings, Range
from lightpen.detection.inspection import Exposure

# The fastest guided swing, 30 degrees a second, then smears an LED by some 1.5 px.
LONGEST_EXPOSURE_US = 5000.0


class Advice(StrEnum):
    """The next step towards a good exposure, the one that costs least first."""

    SHOW_PEN = "show pen"
    LEAVE = "leave"
    LOWER_GAIN = "lower gain"
    SHORTEN_EXPOSURE = "shorten exposure"
    CLOSE_APERTURE = "close aperture"
    LENGTHEN_EXPOSURE = "lengthen exposure"
    RAISE_GAIN = "raise gain"
    OPEN_APERTURE = "open aperture"
    EVEN_OUT = "even out"


def advise(
    exposure: Exposure, settings: CameraSettings, caps: CameraCapabilities | None
) -> Advice:
    """Return the advice for the brightness of the LEDs; no caps: nothing can be set."""
    if not exposure.peaks:
        return Advice.SHOW_PEN
    if exposure.n_saturated and exposure.n_dark:
        return Advice.EVEN_OUT
    exposures = None if caps is None else caps.exposure_us
    gains = None if caps is None else caps.gain_db
    if exposure.n_saturated:
        if _is_above_low(settings.gain_db, gains):
            return Advice.LOWER_GAIN
        if _is_above_low(settings.exposure_us, exposures):
            return Advice.SHORTEN_EXPOSURE
        return Advice.CLOSE_APERTURE
    if exposure.n_dark:
        if _is_below(settings.exposure_us, exposures, LONGEST_EXPOSURE_US):
            return Advice.LENGTHEN_EXPOSURE
        if _is_below(settings.gain_db, gains):
            return Advice.RAISE_GAIN
        return Advice.OPEN_APERTURE
    return Advice.LEAVE


def _is_above_low(value: float | None, offered: Range | None) -> bool:
    return value is not None and offered is not None and value > offered.low


def _is_below(
    value: float | None, offered: Range | None, limit: float = float("inf")
) -> bool:
    return (
        value is not None and offered is not None and value < min(offered.high, limit)
    )
