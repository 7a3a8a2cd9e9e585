"""The trend of a tip, two of its calibrations compared, and how well they repeat."""

from collections.abc import Iterator
from contextlib import closing
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from lightpen.archive.chains import Event, Kind, StoredEntry, append, own_chain
from lightpen.archive.history import EntryFilter
from lightpen.archive.store import Database, open_file
from lightpen.archive.trends import trend_of
from lightpen.model.limits import VerificationLimits
from lightpen.model.names import Origin
from lightpen.record.swings.header import Names
from lightpen_extensions.comparisons.repeatability import compare, repeatability_of

NOON = datetime(2026, 1, 2, 12, tzinfo=UTC)
WANTED = EntryFilter(pen="LP-04", tip="T-10")


@pytest.fixture
def database(tmp_path: Path) -> Iterator[Database]:
    with closing(open_file(tmp_path / "archive.sqlite")) as opened:
        yield opened


def enter(
    database: Database,
    x: float,
    kind: Kind = Kind.ACCEPTED,
    tip: str = "T-10",
    origin: Origin | None = None,
    limit: float = 0.012,
) -> StoredEntry:
    """Enter a tip at x, with U 0.003, 0.004 and 0.006 mm."""
    chain = own_chain(database)
    event = Event(
        kind=kind,
        at=NOON + timedelta(hours=1),
        names=Names(pen="LP-04", tip=tip),
        program="lightpen 1",
        origin=origin,
        tip_pen_mm=(x, 0.0, -1.5),
        expanded_uncertainty_mm=(0.003, 0.004, 0.006),
        settings={"max_uncertainty_mm": limit},
    )
    entry = append(database, chain, event)
    assert entry is not None
    return entry


def test_the_trend_is_of_accepted_tips_in_their_order_with_limits(
    database: Database,
) -> None:
    values = (1.0, 1.1, 1.0, 1.2, *[1.1] * 6)
    for x in values[:-1]:
        enter(database, x)
    assert trend_of(database, WANTED).control is None  # of nine
    enter(database, values[-1])
    enter(database, 9.0, Kind.REFUSED)
    enter(database, 9.0, tip="T-11")
    trend = trend_of(database, WANTED)

    assert [tip.tip_pen[0] for tip in trend.tips] == list(values)
    assert trend.max_uncertainty == 0.012
    assert trend.control is not None
    # Individual values: the mean, and three mean moving ranges over 1.128 about it.
    assert trend.control.center[0] == pytest.approx(1.09)
    reach = 3 * np.mean([0.1, 0.1, 0.2, 0.1, *[0.0] * 5]) / 1.128
    assert trend.control.upper[0] == pytest.approx(1.09 + reach)


def test_a_tip_that_was_taken_back_is_not_in_the_trend(database: Database) -> None:
    entry = enter(database, 1.0)
    back = Event(
        kind=Kind.REVOKED,
        at=NOON,
        names=entry.entry.event.names,
        program="lightpen 1",
        concerns=entry.sha256,
    )
    append(database, own_chain(database), back)

    assert trend_of(database, WANTED).entries == ()


def test_the_change_of_two_is_from_the_earlier_to_the_later(database: Database) -> None:
    earlier, later = enter(database, 1.0), enter(database, 1.02)
    found = compare(later, earlier)

    assert (found.earlier, found.later) == (earlier, later)
    assert found.change.difference[0] == pytest.approx(0.02)
    assert found.change.expanded_uncertainty[0] == pytest.approx(0.003 * np.sqrt(2))
    assert found.change.is_unexplained
    assert found.is_same_tip
    assert not compare(earlier, enter(database, 1.0, tip="T-11")).is_same_tip


def test_repeatability_needs_two_calibrations_of_one_tip(database: Database) -> None:
    one, other = enter(database, 1.0), enter(database, 1.02)
    limits = VerificationLimits()
    found = repeatability_of((other, one), limits)

    assert found is not None
    assert found.scatter.deviation[0] == pytest.approx(0.02 / np.sqrt(2))
    assert repeatability_of((one,), limits) is None
    assert repeatability_of((one, enter(database, 1.0, tip="T-11")), limits) is None


def test_a_simulated_tip_of_the_same_names_is_another_tip(database: Database) -> None:
    real = enter(database, 1.0)
    simulated = enter(database, 1.0, origin=Origin.SIMULATED)

    assert not compare(real, simulated).is_same_tip
    assert repeatability_of((real, simulated), VerificationLimits()) is None


def test_the_limit_of_a_trend_is_that_of_its_last_calibration(
    database: Database,
) -> None:
    for limit in (0.012, 0.02, 0.008):
        enter(database, 1.0, limit=limit)

    assert trend_of(database, WANTED).max_uncertainty == 0.008
