"""The history tells what became of each tip, and what of it was changed."""

import csv
import io
from datetime import timedelta
from pathlib import Path

import pytest
from msgspec import structs
from sqlalchemy import text
from tests.core.archive.conftest import NOON, Station, accepted

from lightpen.archive.chains import Event, Kind, StoredEntry, append
from lightpen.archive.history import (
    COLUMNS,
    EntryFilter,
    TipState,
    due_tips,
    known_names,
    lines,
    messages_on,
    n_wanted,
    save_entries,
)
from lightpen.model.limits import DueRule
from lightpen.model.names import Origin

ALL = EntryFilter()
IN_FORCE, REPLACED = TipState.IN_FORCE, TipState.REPLACED
REVOKED = TipState.REVOKED


def enter(station: Station, event: Event) -> StoredEntry:
    entry = append(station.database, station.chain, event)
    assert entry is not None
    return entry


def about(entry: StoredEntry, kind: Kind, n: int) -> Event:
    """Return an event that concerns an entry."""
    return Event(
        kind=kind,
        at=NOON + timedelta(minutes=n),
        names=entry.entry.event.names,
        program="lightpen 1",
        reason="Dropped.",
        concerns=entry.sha256,
    )


def states(station: Station, wanted: EntryFilter = ALL) -> list[TipState]:
    found = lines(station.database, wanted, 0, 100)
    return [line.state for line in found if line.state is not TipState.NONE]


def test_the_newest_tip_that_was_not_taken_back_is_in_force(station: Station) -> None:
    *_, last = station.enter(3)
    assert states(station) == [IN_FORCE, REPLACED, REPLACED]

    enter(station, about(last, Kind.REVOKED, 10))
    assert states(station) == [REVOKED, IN_FORCE, REPLACED]


def test_a_simulated_or_another_tip_replaces_none(station: Station) -> None:
    station.enter(1)
    enter(station, accepted(1, tip="T-11")[0])
    practice = structs.replace(accepted(2)[0], origin=Origin.SIMULATED)
    enter(station, practice)

    assert states(station) == [IN_FORCE] * 3
    assert states(station, EntryFilter(is_simulated=True)) == [IN_FORCE]


def test_every_block_of_lines_follows_the_one_before(station: Station) -> None:
    station.enter(7)
    blocks = [lines(station.database, ALL, first, 3) for first in (0, 3, 6, 9)]

    assert [[line.number for line in block] for block in blocks] == [
        *([7, 6, 5], [4, 3, 2], [1], [])
    ]


@pytest.mark.parametrize(
    ("wanted", "n_found"),
    [
        (EntryFilter(pen="LP-04"), 4),
        (EntryFilter(pen="LP-04", tip="T-11"), 1),
        (EntryFilter(pen="lp\u201104", tip="t\u201311", station=" hall  2"), 1),
        (EntryFilter(tip="\u0422-11"), 1),  # Cyrillic
        (EntryFilter(tip="T-12"), 0),
        (EntryFilter(begin=NOON + timedelta(minutes=2)), 2),
        (EntryFilter(end=NOON + timedelta(minutes=2)), 2),
        (EntryFilter(station="Hall 3"), 0),
    ],
)
def test_only_what_is_looked_for_is_shown(
    station: Station, wanted: EntryFilter, n_found: int
) -> None:
    station.enter(3)
    enter(station, accepted(3, tip="T-11")[0])

    assert n_wanted(station.database, wanted) == n_found
    assert len(lines(station.database, wanted, 0, 100)) == n_found
    assert known_names(station.database).tips_of("LP-04") == ("T-10", "T-11")


def test_what_follows_a_clock_that_was_ahead_is_found_by_the_days_it_says(
    station: Station,
) -> None:
    station.enter(1)
    ahead = accepted(1)[0]
    enter(station, structs.replace(ahead, at=NOON + timedelta(days=9000)))
    station.enter(2, first=2)

    today = EntryFilter(begin=NOON, end=NOON + timedelta(days=1))
    found = lines(station.database, today, 0, 100)
    assert [line.number for line in found] == [4, 3, 1]
    assert n_wanted(station.database, today) == 3
    late = EntryFilter(begin=NOON + timedelta(days=1))
    assert [line.number for line in lines(station.database, late, 0, 100)] == [2]
    assert states(station) == [IN_FORCE, REPLACED, REPLACED, REPLACED]


def test_a_changed_entry_is_reported_and_nothing_it_says_is_shown(
    station: Station,
) -> None:
    station.enter(3)
    with station.database.writing() as connection:
        statement = "UPDATE archive_entries SET text = replace(text, 'Ann', 'Bob')"
        connection.execute(text(f"{statement} WHERE number = 2"))

    found = lines(station.database, ALL, 0, 100)
    assert [(line.number, line.entry is None) for line in found] == [
        *((3, False), (2, True), (1, False))
    ]


def test_what_concerns_an_entry_is_found_in_its_order(station: Station) -> None:
    first, second = station.enter(2)
    for kind in (Kind.NOTE, Kind.REVOKED):
        enter(station, about(first, kind, 10))

    kinds = [each.entry.event.kind for each in messages_on(station.database, first)]
    assert kinds == [Kind.NOTE, Kind.REVOKED]
    assert messages_on(station.database, second) == ()


def test_a_tip_is_due_by_its_age(station: Station) -> None:
    station.enter(1)
    (tip,) = due_tips(station.database, station.chain, DueRule(30))
    assert tip.due == NOON + timedelta(days=30)
    assert not tip.is_due(tip.due)
    assert tip.is_due(tip.due + timedelta(seconds=1))


def test_the_tip_that_is_due_first_is_listed_first(station: Station) -> None:
    station.enter(1)
    enter(station, accepted(9, tip="T-11")[0])

    listed = due_tips(station.database, station.chain, DueRule(30))
    assert [tip.entry.entry.event.names.tip for tip in listed] == ["T-10", "T-11"]


def test_entries_are_saved_as_a_table(station: Station, tmp_path: Path) -> None:
    station.enter(3)
    assert save_entries(station.database, ALL, tmp_path / "all.csv") == 3

    rows = list(csv.DictReader(io.StringIO((tmp_path / "all.csv").read_text("utf-8"))))
    assert tuple(rows[0]) == COLUMNS
    assert [row["tip_x_mm"] for row in rows] == ["2.0", "1.0", "0.0"]
