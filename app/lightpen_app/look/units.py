"""Numbers as they are typed, with or without a unit."""

import re
import unicodedata

# Units that may be typed where one of the same kind stands: sizes in the first of them.
KINDS_OF_UNIT = (
    {"mm": 1.0, "μm": 1e-3, "um": 1e-3, "cm": 10.0, "m": 1000.0, "in": 25.4, '"': 25.4},
    {"ms": 1.0, "s": 1000.0, "μs": 1e-3, "us": 1e-3},
    {"%": 1.0, "ppm": 1e-4},
    {"b": 1.0, "kb": 1000.0},
    {"\N{DEGREE SIGN}c": 1.0, "c": 1.0},
)
TYPED = re.compile(
    r"(?P<number>[+-]?(?:\d+(?P<point>[.,]\d*)?|[.,]\d+)(?:e[+-]?\d{1,2})?)"
    r"\s*(?P<unit>[^\d\s.,+-][^\d\s]*)?",
    re.IGNORECASE,
)


def plain_unit(unit: str) -> str:
    """Return a unit in one spelling: both signs of micro are one."""
    return unicodedata.normalize("NFKC", unit).strip().lower()


def unit_size(typed: str, unit: str) -> float | None:
    """Return how large a typed unit is in ``unit``; None if it is of another kind."""
    typed, unit = plain_unit(typed), plain_unit(unit)
    if typed == unit:
        return 1.0
    for sizes in KINDS_OF_UNIT:
        if typed in sizes and unit in sizes:
            return sizes[typed] / sizes[unit]
    return None
