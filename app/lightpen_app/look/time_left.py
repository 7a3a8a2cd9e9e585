"""The time that a job still takes, by the time that it has taken."""

from collections.abc import Callable
from math import ceil
from time import monotonic

from PySide6.QtCore import QCoreApplication

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
