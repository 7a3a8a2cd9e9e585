"""Due dates of the current tips."""

from bisect import bisect_right
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime, timedelta

from sqlalchemy import select

from lightpen.archive.chains.entries import Kind, StoredEntry, since_us
from lightpen.archive.chains.rows import searchable
from lightpen.archive.history.history import known_names
from lightpen.archive.history.queries import last_accepted, of_chain
from lightpen.archive.store.database import Database
from lightpen.archive.store.tables import ENTRIES
from lightpen.model.limits import DueRule
from lightpen.record.library.tip_library import Library

EMPTY = Library()
CLOCKS_AGREE = timedelta(days=1)  # enough for an age in days
SWINGS = (Kind.ACCEPTED, Kind.REFUSED, Kind.ABANDONED)


@dataclass(frozen=True)
class DueTip:
    """A current tip."""

    entry: StoredEntry  # of the acceptance
    calibrated: datetime
    due: datetime  # by age
    n_swings: int  # of the pen since the calibration
    n_left: int | None  # until it is due by their count; None for any number

    def is_due(self, now: datetime) -> bool:
        """Return whether it needs calibration before it is used.

        So it is where its age is not known: its day is still to come, by a clock that
        was set back, or was ahead then.
        """
        is_to_come = self.calibrated > now + CLOCKS_AGREE
        is_old = now > self.due or is_to_come
        return is_old or (self.n_left is not None and self.n_left <= 0)


def due_tips(
    database: Database, chain: str, rule: DueRule, library: Library = EMPTY
) -> tuple[DueTip, ...]:
    """Return the current tips of real pens at a station, the due ones first.

    ``chain`` belongs to the data folder in which the tips are current. The station's
    rule is for tips without their own in the library; retired tips are omitted.
    """
    found = (
        last_accepted(database, pen, tip, chain=chain)
        for pen, tip in known_names(database).tips
        if pen and tip and not library.has_retired(tip)
    )
    entries = [entry for entry in found if entry is not None]
    if not entries:
        return ()
    swings = _swings(database, chain, min(each.entry.since for each in entries))
    return tuple(
        sorted(
            (_due_tip(entry, swings, rule, library) for entry in entries),
            key=lambda tip: (tip.n_left is None or tip.n_left > 0, tip.due),
        )
    )


def _due_tip(
    entry: StoredEntry,
    swings: Mapping[str, list[int]],
    usual: DueRule,
    library: Library,
) -> DueTip:
    names, calibrated = entry.entry.event.names, entry.entry.event.at
    rule = library.rule_of(names.tip, usual)
    of_pen = swings.get(searchable(names.pen), [])
    n_swings = len(of_pen) - bisect_right(of_pen, since_us(entry.entry.since))
    return DueTip(
        entry,
        calibrated,
        rule.due(calibrated),
        n_swings,
        rule.max_swings - n_swings if rule.max_swings else None,
    )


def _swings(database: Database, chain: str, since: datetime) -> dict[str, list[int]]:
    """Return the times of the real swings of each pen since then, in order."""
    found = (
        select(ENTRIES.c.pen, ENTRIES.c.since_us)
        .where(
            ENTRIES.c.since_us > since_us(since),
            ENTRIES.c.kind.in_([kind.value for kind in SWINGS]),
            ~ENTRIES.c.is_simulated,
            of_chain(chain),
        )
        .order_by(ENTRIES.c.since_us)
    )
    swings = defaultdict[str, list[int]](list)
    for row in database.rows(found):
        swings[row.pen].append(row.since_us)
    return swings
