"""The content of a pen file of any layout, and its permitted ranges."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.errors import FileError, UsageError
from lightpen.messages import Message
from lightpen.model.pen import Pen
from lightpen.model.self_calibration import FoundPen

UNITS = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "um": 0.001, "inch": 25.4}
LARGEST_DIAMETER = 100.0  # mm
NORMAL_TOLERANCE = 0.01  # of the length of a normal in the file
_SPELLINGS = {
    "mm": ("mm", "millimeter", "millimetre", "millimeters", "millimetres"),
    "cm": ("cm",),
    "m": ("m", "meter", "metre", "meters", "metres"),
    "um": ("um", "μm", "micron", "microns"),
    "inch": ("inch", "in", "inches"),
}
UNIT_NAMES = {name: unit for unit, names in _SPELLINGS.items() for name in names}
LENGTHS = {"led_sigma", "diameter_sigma"}  # in the unit of the file
# From above the first to the second: mm, relative, 1/K, degrees C.
RANGES = {
    "led_sigma": (0.0, 10.0),
    "scale_sigma": (0.0, 0.01),
    "diameter_sigma": (0.0, 10.0),
    "expansion": (-1e-5, 1e-4),
    "expansion_sigma": (0.0, 1e-4),
    "temperature_c": (-50.0, 100.0),
}


@dataclass(frozen=True, eq=False)
class PenContent:
    """The content of a pen file, mm; None where it states nothing."""

    leds: FloatArray
    normals: FloatArray | None
    diameter: float | None
    nominal_tip: FloatArray | None = None
    name: str = ""
    stated: Mapping[str, float] = field(default_factory=dict)
    covariance: FloatArray | None = None
    normal_covariance: FloatArray | None = None
    found: FoundPen | None = None


def agreed_unit(stated: str, given: str | None, name: str) -> str:
    """Return the unit of a file's lengths, as stated in the file or given by the user.

    Raises `UsageError` if neither says it, or they differ.
    """
    if stated and given and stated != given:
        raise UsageError(
            "pen-file.contradicting-units", name=name, stated=stated, given=given
        )
    unit = stated or given
    if not unit:
        raise UsageError("pen-file.no-units", name=name)
    return unit


def checked_number(what: str, number: float, name: str) -> float:
    """Return a number of a file, checked against `RANGES`."""
    least, most = RANGES[what]
    if not least < number <= most:
        raise FileError(
            "pen-file.number",
            name=name,
            what=what,
            number=number,
            least=least,
            most=most,
        )
    return number


def check_diameter(diameter: float, name: str) -> None:
    """Refuse an implausible disc diameter, mm."""
    if not 0 < diameter <= LARGEST_DIAMETER:
        raise FileError(
            "pen-file.diameter", name=name, diameter=diameter, most=LARGEST_DIAMETER
        )


def unit_normal(normal: FloatArray, place: str | Message) -> FloatArray:
    """Return a normal (3,) of unit length; refuse one that is far from it."""
    squared = float(normal @ normal) if np.abs(normal).max() < 2 else np.inf
    if abs(squared - 1) > 2 * NORMAL_TOLERANCE:
        raise FileError(
            "pen-file.normal-length",
            place=place,
            normal=" ".join(f"{c:g}" for c in normal),
        )
    return normal if abs(squared - 1) < 1e-9 else normal / np.sqrt(squared)


def stated_numbers(pen: Pen) -> dict[str, float]:
    """Return the numbers stated for a pen, by the names of `RANGES`."""
    return {
        what: float(number)
        for what in RANGES
        if (number := getattr(pen, what)) is not None
    }
