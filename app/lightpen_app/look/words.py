"""Names, numbers and times as they are displayed and typed."""

import math
import re
import unicodedata
from collections.abc import Callable
from datetime import datetime
from html import escape
from math import ceil
from time import monotonic

from PySide6.QtCore import QCoreApplication
from PySide6.QtGui import QAction, QStandardItem
from PySide6.QtWidgets import QWidget

from lightpen.local_time import local_time
from lightpen.messages import Number

LONGEST_SHOWN = 32  # characters
LEAST_SHOWN = 12  # characters of a name where there is little room
LONGEST_WORD = 24  # characters; longer words may be split
BREAK = "\u200b"  # where a line may end, though no blank is there
JOINER = "\u2060"  # where a line may not end, though it could
PARTED = "  \u00b7  "  # between items in one line


def shortened(name: str, longest: int = LONGEST_SHOWN) -> str:
    """Return a name that fits into a line; its end is left out if it is long."""
    return name if len(name) <= longest else f"{name[: longest - 1]}\u2026"


def with_short_words(text: str) -> str:
    """Return a text that fits a narrow place: names that cannot wrap lose their end.

    Paths stay whole.
    """
    # Qt may begin a new line beside any Chinese character.
    word = rf"(?<!\S)[^\s/\\{BREAK}{JOINER}\u2e80-\uffef]{{{LONGEST_WORD + 1},}}(?!\S)"
    return re.sub(word, lambda found: shortened(found.group(), LEAST_SHOWN), text)


def breakable(text: str) -> str:
    """Allow line breaks in words without a blank, such as paths."""
    long_word = rf"\S{{{LONGEST_WORD},}}"
    return re.sub(long_word, lambda word: _parted(word.group()), text)


def unbroken(text: str) -> str:
    """Undo `breakable`."""
    return text.replace(BREAK, "")


def on_one_line(text: str) -> str:
    """Prevent line breaks within a text."""
    return JOINER.join(text.replace(" ", "\xa0"))


def phrases_whole(text: str) -> str:
    """Prevent line breaks within coverage factors and numbers of standards."""
    phrase = r"k = \d|(?:ISO|JCGM) \d\S*"
    return re.sub(phrase, lambda found: found.group().replace(" ", "\xa0"), text)


def _parted(word: str) -> str:
    """Split a long word after its punctuation, or anywhere if there is none."""
    parts = re.findall(rf"[^/\\_,;.]{{1,{LONGEST_WORD}}}[/\\_,;.]?|[/\\_,;.]", word)
    return BREAK.join(parts)


def moment_text(moment: datetime) -> str:
    """Return a moment in local time, to the minute."""
    return f"{local_time(moment):%Y-%m-%d %H:%M}"


def day_text(moment: datetime) -> str:
    """Return the local day of a moment."""
    return f"{local_time(moment):%Y-%m-%d}"


# Tool tips as plain text.
#
# Qt takes a text with tags as rich text and opens its images: a name in a record could
# open any path, also one of another computer.


def set_tooltip(of: QWidget | QAction | QStandardItem, text: str) -> None:
    """Set the tool tip of a widget, an action or an item."""
    of.setToolTip(plain_tooltip(text))


def plain_tooltip(text: str) -> str:
    """Return a text that a tool tip shows literally."""
    if "<" not in text:
        return text
    return f'<span style="white-space: pre-wrap">{escape(text)}</span>'


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


translate = QCoreApplication.translate

LEAST_S, LEAST_FRACTION = 2.0, 0.02  # after which the rate is known
LONG_S = 90.0  # shown in minutes


class TimeLeft:
    """Measures the rate of a job."""

    def __init__(self, clock: Callable[[], float] = monotonic) -> None:
        self._clock = clock
        self.restart()

    def restart(self) -> None:
        """Measure another job, which begins now."""
        self._begin = self._clock()

    def text(self, fraction: float) -> str:
        """Return the time left of a job so far done, 0 to 1; empty if unknown."""
        passed = self._clock() - self._begin
        if passed < LEAST_S or not LEAST_FRACTION <= fraction < 1:
            return ""
        return time_left_text(passed * (1 - fraction) / fraction)


def time_left_text(seconds: float) -> str:
    """Return a remaining time, rounded up."""
    if seconds > LONG_S:
        words = translate("TimeLeft", "about {0} min left")
        return words.format(ceil(seconds / 60))
    words = translate("TimeLeft", "about {0} s left")
    return words.format(max(10 * ceil(seconds / 10), 10))
