"""Bending: by how much a touch deflects the stylus other than the swing did.

The effective tip contains the bending under the force of its swing. A touch with
another force moves the ball across the pen by an amount that no image shows. It counts
with a standard uncertainty, assumed until a press test compares the effective tips of a
light and a firm swing.
"""

from dataclasses import dataclass
from datetime import date, timedelta
from math import hypot
from typing import Annotated

from msgspec import Meta, Struct

from lightpen.messages import Message, message
from lightpen.model.coverage import COVERAGE_FACTOR

ASSUMED = 0.004  # mm, standard uncertainty
VALIDITY = timedelta(days=365)
LARGEST_BENDING = 10.0  # mm


class MeasuredBending(Struct, frozen=True):
    """Bending by a press test, firm less light swing, mm."""

    bending_mm: Annotated[float, Meta(ge=-LARGEST_BENDING, le=LARGEST_BENDING)]
    expanded_uncertainty_mm: Annotated[float, Meta(gt=0, le=LARGEST_BENDING)]
    measured: date
    due: date

    @property
    def sigma(self) -> float:
        """Root mean square of the bending that the test leaves possible, mm."""
        return hypot(self.bending_mm, self.expanded_uncertainty_mm / COVERAGE_FACTOR)


@dataclass(frozen=True)
class Bending:
    """The bending that counts for a tip: by a press test, or assumed."""

    measured: MeasuredBending | None = None
    is_overdue: bool = False

    @property
    def sigma(self) -> float:
        """Standard uncertainty of a touch along each axis across the pen, mm."""
        if self.measured is None:
            return ASSUMED
        return max(self.measured.sigma, ASSUMED if self.is_overdue else 0.0)

    @property
    def words(self) -> Message:
        """Return its size and where it is from."""
        if self.measured is None:
            return message("bending.assumed", assumed=ASSUMED)
        bending = abs(self.measured.bending_mm)
        uncertainty = self.measured.expanded_uncertainty_mm
        day = self.measured.measured.isoformat()
        if not self.is_overdue:
            return message(
                "bending.measured", bending=bending, uncertainty=uncertainty, day=day
            )
        return message(
            "bending.overdue",
            bending=bending,
            uncertainty=uncertainty,
            day=day,
            due=self.measured.due.isoformat(),
            assumed=ASSUMED,
        )


ASSUMED_BENDING = Bending()


def bending_on(day: date, measured: MeasuredBending | None) -> Bending:
    """Return the bending that counts on a day, by the last press test of a tip."""
    return Bending(measured, measured is not None and day > measured.due)


def measured_on(day: date, bending: float, uncertainty: float) -> MeasuredBending:
    """Return the outcome of a press test of a day; bending and U (k = 2), mm."""
    return MeasuredBending(bending, uncertainty, day, day + VALIDITY)
