"""Displayed numbers, with the decimals that their uncertainty warrants."""

import math

from lightpen.messages import Number

AXES = ("x", "y", "z")
MICROMETRES = 1000.0  # in a millimetre
SHOWN_DECIMALS = 4  # of a millimetre, as in the sentences of the core
MAX_DECIMALS = 6
DIGITS = 2  # of an uncertainty, as the GUM recommends


def decimals_for(uncertainty: float) -> int:
    """Return the decimals that show an uncertainty by two significant digits."""
    if not (math.isfinite(uncertainty) and uncertainty > 0):
        return MAX_DECIMALS
    decimals = DIGITS - 1 - math.floor(math.log10(uncertainty))
    if round(uncertainty, decimals) >= 10.0 ** (DIGITS - decimals):  # 0.0998 -> 0.10
        decimals -= 1
    return min(max(decimals, 0), MAX_DECIMALS)


def number_text(value: float, decimals: int) -> str:
    """Return a number with fixed decimals, without a sign before zero."""
    return f"{Number(value):.{decimals}f}"


def mm_text(value: float) -> str:
    """Return a length in mm as the screen shows it."""
    return number_text(value, SHOWN_DECIMALS)


def micrometres_text(value: float) -> str:
    """Return a length in mm as micrometres, to the digit of `mm_text`."""
    return number_text(MICROMETRES * value, 1)
