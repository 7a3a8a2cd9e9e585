"""Trend of a tip: its calibrations in order, with limits."""

from dataclasses import dataclass, replace

import numpy as np

from lightpen.archive.chains.entries import Kind, StoredEntry
from lightpen.archive.history.history import TipState, lines
from lightpen.archive.history.queries import EntryFilter
from lightpen.archive.store.database import Database
from lightpen.comparisons.repeatability import (
    MIN_TIPS,
    ControlLimits,
    Repeatability,
    TipEstimate,
    control_limits,
    measure_repeatability,
)
from lightpen.estimation.reports.verdict import Change, change_since
from lightpen.model.limits import VerificationLimits

LONGEST = 1000  # calibrations, the newest
LIMIT = "max_uncertainty_mm"  # key in the settings of an entry


@dataclass(frozen=True, eq=False)
class Trend:
    """The calibrations of a tip that were accepted and not revoked."""

    pen: str = ""
    tip: str = ""
    entries: tuple[StoredEntry, ...] = ()  # the oldest first
    tips: tuple[TipEstimate, ...] = ()
    control: ControlLimits | None = None
    max_uncertainty: float | None = None  # limit of U (k = 2) at the newest, mm


@dataclass(frozen=True, eq=False)
class Comparison:
    """Change from the earlier to the later of two calibrations."""

    earlier: StoredEntry
    later: StoredEntry
    change: Change
    is_same_tip: bool


def trend_of(database: Database, wanted: EntryFilter) -> Trend:
    """Return the trend of the pen and tip of a filter, of the newest if many."""
    accepted = replace(wanted, kinds=(Kind.ACCEPTED,))
    found = lines(database, accepted, 0, LONGEST)
    entries = tuple(
        each.entry
        for each in reversed(found)
        if each.entry is not None
        and has_tip(each.entry)
        and each.state is not TipState.TAKEN_BACK
    )
    tips = tuple(map(tip_of, entries))
    return Trend(
        pen=wanted.pen,
        tip=wanted.tip,
        entries=entries,
        tips=tips,
        control=control_limits(np.array([tip.tip_pen for tip in tips])),
        max_uncertainty=_limit(entries[-1]) if entries else None,
    )


def has_tip(entry: StoredEntry) -> bool:
    """Return whether an entry holds a tip with its uncertainty."""
    event = entry.entry.event
    return None not in (event.tip_pen_mm, event.expanded_uncertainty_mm)


def tip_of(entry: StoredEntry) -> TipEstimate:
    """Return the tip of an entry that holds one."""
    event = entry.entry.event
    return TipEstimate(
        f"{entry.entry.number}",
        np.array(event.tip_pen_mm, dtype=np.float64),
        np.array(event.expanded_uncertainty_mm, dtype=np.float64),
        event.at,
    )


def compare(one: StoredEntry, other: StoredEntry) -> Comparison:
    """Compare two entries that hold tips, in any order."""
    earlier, later = sorted((one, other), key=lambda each: each.entry.since)
    now, then = tip_of(later), tip_of(earlier)
    change = change_since(now.tip_pen, now.uncertainty, then.tip_pen, then.uncertainty)
    return Comparison(earlier, later, change, _subject(one) == _subject(other))


def repeatability_of(
    entries: tuple[StoredEntry, ...], limits: VerificationLimits
) -> Repeatability | None:
    """Return the repeatability; None for fewer than two calibrations or several tips.

    See `measure_repeatability`.
    """
    if len(entries) < MIN_TIPS or len({_subject(each) for each in entries}) > 1:
        return None
    in_order = sorted(entries, key=lambda each: each.entry.since)
    return measure_repeatability([tip_of(each) for each in in_order], limits)


def _subject(entry: StoredEntry) -> tuple[str, str, bool]:
    event = entry.entry.event
    return event.names.pen, event.names.tip, event.is_simulated


def _limit(entry: StoredEntry) -> float | None:
    limit = entry.entry.event.settings.get(LIMIT)
    return limit if isinstance(limit, float) else None
