"""The trend of a tip: its accepted calibrations, with control limits."""

from dataclasses import dataclass, replace
from datetime import datetime

import numpy as np

from lightpen.archive.chains import Kind, StoredEntry
from lightpen.archive.history import EntryFilter, TipState, lines
from lightpen.archive.store import Database
from lightpen.arrays import FloatArray

FOR_CONTROL = 10  # for limits of a control chart
MOVING_RANGE = 1.128  # mean range of two over the standard deviation
CONTROL = 3.0  # standard deviations
LONGEST = 1000  # calibrations, the newest
LIMIT = "max_uncertainty_mm"  # key in the settings of an entry


@dataclass(frozen=True, eq=False)
class TipEstimate:
    """A tip by one calibration, and its U (k = 2), (3,), mm."""

    name: str
    tip_pen: FloatArray
    uncertainty: FloatArray
    when: datetime | None = None


@dataclass(frozen=True, eq=False)
class ControlLimits:
    """A control chart of individual values: (3,) each, mm."""

    lower: FloatArray
    center: FloatArray
    upper: FloatArray


@dataclass(frozen=True, eq=False)
class Trend:
    """The calibrations of a tip that were accepted and not revoked."""

    pen: str = ""
    tip: str = ""
    entries: tuple[StoredEntry, ...] = ()  # the oldest first
    tips: tuple[TipEstimate, ...] = ()
    control: ControlLimits | None = None
    max_uncertainty: float | None = None  # limit of U (k = 2) at the newest, mm


def control_limits(values: FloatArray) -> ControlLimits | None:
    """Return the limits of a control chart of values (N, 3), if they are enough."""
    if len(values) < FOR_CONTROL:
        return None
    sigma = np.abs(np.diff(values, axis=0)).mean(axis=0) / MOVING_RANGE
    center = values.mean(axis=0)
    return ControlLimits(center - CONTROL * sigma, center, center + CONTROL * sigma)


def trend_of(database: Database, wanted: EntryFilter) -> Trend:
    """Return the trend of the pen and tip of a filter, of the newest if many."""
    accepted = replace(wanted, kinds=(Kind.ACCEPTED,))
    found = lines(database, accepted, 0, LONGEST)
    entries = tuple(
        each.entry
        for each in reversed(found)
        if each.entry is not None
        and has_tip(each.entry)
        and each.state is not TipState.REVOKED
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


def _limit(entry: StoredEntry) -> float | None:
    limit = entry.entry.event.settings.get(LIMIT)
    return limit if isinstance(limit, float) else None
