"""Calibration status of a station's tips: valid, overdue, not calibrated, retired."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import date, datetime
from enum import StrEnum
from functools import cached_property

from lightpen.estimation.reports.verdict import Grade
from lightpen.local_time import local_time
from lightpen.messages import Message, message
from lightpen.model.names import folded_name
from lightpen.record.library.tip_library import Item, ItemKind, Library


class TipStatus(StrEnum):
    """Whether an item may be used for measuring."""

    VALID = "valid"
    OVERDUE = "overdue"
    UNCALIBRATED = "not calibrated"
    RETIRED = "retired"


@dataclass(frozen=True)
class CurrentResult:
    """A current tip: since when, until when by its age, largest U (k = 2), mm."""

    calibrated: datetime
    due: datetime
    is_due: bool
    uncertainty: float | None = None
    grade: Grade | None = None


@dataclass(frozen=True)
class StationStatus:
    """Status of all tips, pens and cones of a station."""

    library: Library = field(default_factory=Library)
    # Real tips by pen.
    in_force: Mapping[tuple[str, str], CurrentResult] = field(default_factory=dict)
    now: datetime | None = None  # None where nothing was read yet

    def of_tip(self, pen: str, tip: str) -> TipStatus | None:
        """Return the status of a tip of a pen; None while unknown."""
        if self.now is None or not (pen and tip):
            return None
        listed = self.library.tip(tip)
        if self.library.has_retired(tip):
            return TipStatus.RETIRED
        found = self.current(pen, tip)
        if found is None:
            return TipStatus.UNCALIBRATED
        is_over = listed is not None and listed.is_overdue(self._today(self.now))
        return TipStatus.OVERDUE if is_over or found.is_due else TipStatus.VALID

    def current(self, pen: str, tip: str) -> CurrentResult | None:
        """Return the current result of a pen and a tip, however they are typed."""
        return self._by_name.get((folded_name(pen), folded_name(tip)))

    @cached_property
    def _by_name(self) -> Mapping[tuple[str, str], CurrentResult]:
        return {
            (folded_name(pen), folded_name(tip)): each
            for (pen, tip), each in self.in_force.items()
        }

    def overdue(self, pen: str, tip: str) -> Message | None:
        """Return the message that a calibration has expired; None if it has not."""
        due = self.due(pen, tip)
        is_over = self.of_tip(pen, tip) is TipStatus.OVERDUE
        if (
            self.now is None
            or due is None
            or not is_over
            or due > self._today(self.now)
        ):
            return None  # due by the number of swings, or by a clock that was set back
        return message("doubt.calibration-overdue", due=f"{due:%Y-%m-%d}")

    def of_item(self, kind: ItemKind, name: str) -> TipStatus | None:
        """Return the status of a pen, a cone or the ball of a tip.

        None of one that is not in the library.
        """
        item: Item | None = self.library.item(kind, name)
        if item is None or self.now is None:
            return None
        if item.is_retired:
            return TipStatus.RETIRED
        is_over = item.is_overdue(self._today(self.now))
        return TipStatus.OVERDUE if is_over else TipStatus.VALID

    def pens_of(self, tip: str) -> tuple[str, ...]:
        """Return the pens with a current tip."""
        folded = folded_name(tip)
        return tuple(p for p, each in self.in_force if folded_name(each) == folded)

    def due(self, pen: str, tip: str) -> date | None:
        """Return the last day of validity of a current tip."""
        found = self.current(pen, tip)
        days = [] if found is None else [self._today(found.due)]
        listed = self.library.tip(tip)
        if listed is not None and listed.due is not None:
            days.append(listed.due)
        return min(days, default=None)

    @staticmethod
    def _today(moment: datetime) -> date:
        return local_time(moment).date()
