"""The newest change of each item of the library counts at all stations."""

import time
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass
from datetime import timedelta
from pathlib import Path
from subprocess import CompletedProcess

import psycopg
import pytest
from benchmarks.postgres_server import Postgres
from msgspec import structs
from tests.core.archive.conftest import NOON

from lightpen.archive.logbook.lazy_logbook import SERVER
from lightpen.archive.logbook.logbook import Logbook
from lightpen.archive.logbook.shared_library import TakenOver, take_over
from lightpen.archive.replication.exchange import deliver
from lightpen.archive.replication.server import open_server
from lightpen.errors import AcceptanceError
from lightpen.model.limits import StationLimits
from lightpen.record.library.library_changes import (
    Author,
    add_item,
    change_item,
    retire_item,
)
from lightpen.record.library.supervision import Signature
from lightpen.record.library.supervision_changes import save_limits
from lightpen.record.library.tip_library import (
    ItemKind,
    ListedCone,
    ListedTip,
    Picture,
    read_library,
)

PATIENCE_S = 60.0
HOUR = timedelta(hours=1)
LATER = NOON + 100 * HOUR
TIP = ListedTip(id="T-10", ball_diameter_mm=10.0)


@dataclass(frozen=True)
class Site:
    """A data folder and the address by which it calls the server."""

    data: Path
    address: str

    @property
    def by(self) -> Author:
        return Author(self.data.name, "Ann")

    def share(self, signature: Signature | None = None) -> tuple[TakenOver, ...]:
        """Deliver, take over, and deliver what was taken over."""
        with (
            closing(Logbook(self.data)) as logbook,
            closing(open_server(self.address)) as server,
        ):
            assert logbook.enter_owed() == ()
            deliver(logbook.database, logbook.chain, server)
            taken = take_over(self.data, logbook.database, LATER, server, signature)
            assert logbook.enter_owed() == ()
            deliver(logbook.database, logbook.chain, server)
        return taken

    def tip(self) -> ListedTip:
        return read_library(self.data).tips["T-10"]


@pytest.fixture(scope="module")
def plant(postgres: Postgres) -> str:
    return postgres.new_database()


@pytest.fixture
def site(plant: str, postgres: Postgres, tmp_path: Path) -> Callable[[str], Site]:
    """Return a function that makes a station with a role of its own."""
    with psycopg.connect(plant) as connection:
        connection.execute("TRUNCATE archive_entries, archive_records, archive_writers")

    def make(name: str) -> Site:
        return Site(tmp_path / name, postgres.new_role(plant, "lightpen_station"))

    return make


def test_tips_changes_and_retirements_reach_other_stations_and_do_not_come_back(
    site: Callable[[str], Site],
) -> None:
    one, other = site("one"), site("other")
    add_item(one.data, TIP, one.by, NOON)
    one.share()
    (taken,) = other.share()

    assert (taken.change.item, taken.replaced) == (TIP, None)
    assert (taken.change.station, taken.change.at) == ("one", NOON)
    assert other.tip() == TIP
    retire_item(other.data, ItemKind.TIP, "T-10", other.by, NOON + HOUR)
    other.share()
    (back,) = one.share()
    assert one.tip().is_retired
    assert back.replaced is not None
    assert (one.share(), other.share()) == ((), ())


def both_changed(site: Callable[[str], Site]) -> tuple[Site, Site]:
    """Return a station whose change is the later one, shared, and another station."""
    one, other = site("one"), site("other")
    for each, hours in ((one, 2), (other, 1)):
        add_item(each.data, structs.replace(TIP, note=each.data.name), each.by, NOON)
        changed = structs.replace(TIP, note=f"{each.data.name}, changed")
        change_item(each.data, changed, each.by, NOON + hours * HOUR)
    one.share()
    return one, other


def test_of_two_changes_the_later_one_counts_at_both_stations(
    site: Callable[[str], Site],
) -> None:
    one, other = both_changed(site)
    (taken,) = other.share()

    assert one.share() == ()
    assert one.tip() == other.tip() == structs.replace(TIP, note="one, changed")
    assert taken.replaced is not None
    assert taken.replaced.item.note == "other, changed"


def shared_since_start(site: Site) -> tuple[str, ...]:
    """Return what a station tells of others once its program has asked the server."""
    with closing(Logbook(site.data, site.address)) as logbook:
        deadline = time.monotonic() + PATIENCE_S
        while not logbook.shared:
            assert time.monotonic() < deadline
            time.sleep(0.02)
        return tuple(map(str, logbook.shared))


def test_a_running_station_takes_over_by_itself_and_tells_whose_change_is_replaced(
    site: Callable[[str], Site],
) -> None:
    _, other = both_changed(site)

    (reported,) = shared_since_start(other)
    assert reported.startswith("Taken over from another station: tip T-10, one Ann, ")
    assert "It replaces the earlier change by other Ann, " in reported
    assert other.tip().note == "one, changed"


def test_a_running_station_with_a_password_tells_that_changes_wait(
    site: Callable[[str], Site],
) -> None:
    one, guarded = site("one"), site("guarded")
    eve = Signature("Eve", "correct horse")
    save_limits(guarded.data, "guarded", StationLimits(), eve, "", NOON)
    add_item(one.data, TIP, one.by, NOON)
    one.share()

    (reported,) = shared_since_start(guarded)
    assert reported.startswith("Changes of other stations")
    assert reported.endswith(": 1.")
    assert read_library(guarded.data).tips == {}


def test_the_command_deliver_shares_the_library(
    site: Callable[[str], Site],
    lightpen: Callable[..., CompletedProcess[str]],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    one, other = site("one"), site("other")
    add_item(one.data, TIP, one.by, NOON)
    one.share()
    monkeypatch.setenv(SERVER, other.address)

    first = lightpen("archive", "deliver", "--data", other.data)
    again = lightpen("archive", "deliver", "--data", other.data)

    assert first.stdout.startswith("1 entries are new, 0 were there already.\n")
    assert "Taken over from another station: tip T-10, one Ann" in first.stdout
    assert again.stdout == "0 entries are new, 1 were there already.\n"
    assert other.tip() == TIP


@pytest.mark.slow
def test_a_password_needs_a_supervisor_to_take_over(
    site: Callable[[str], Site],
) -> None:
    one, guarded = site("one"), site("guarded")
    eve = Signature("Eve", "correct horse")
    save_limits(guarded.data, "guarded", StationLimits(), eve, "", NOON)
    add_item(one.data, TIP, one.by, NOON)
    one.share()

    with pytest.raises(AcceptanceError):
        guarded.share()
    assert read_library(guarded.data).tips == {}
    guarded.share(eve)
    assert guarded.tip() == TIP


def test_a_change_of_a_clock_that_is_ahead_does_not_count(
    site: Callable[[str], Site],
) -> None:
    one, other = site("one"), site("other")
    add_item(one.data, TIP, one.by, LATER + HOUR)
    one.share()

    assert other.share() == ()


def test_a_picture_that_is_not_here_is_left_out(site: Callable[[str], Site]) -> None:
    one, other = site("one"), site("other")
    picture = Picture("library/pictures/1.png", "0" * 64)
    add_item(one.data, structs.replace(TIP, picture=picture), one.by, NOON)
    one.share()
    other.share()

    assert other.tip() == TIP
    assert (one.share(), one.tip().picture) == ((), picture)


def test_a_station_sees_of_others_their_library_alone(
    site: Callable[[str], Site],
) -> None:
    one, other = site("one"), site("other")
    add_item(one.data, ListedCone(id="C-1"), one.by, NOON)
    save_limits(one.data, "one", StationLimits(), Signature("Eve", "x" * 12), "", NOON)
    one.share()
    with psycopg.connect(other.address) as connection:
        seen = connection.execute("SELECT kind FROM archive_entries").fetchall()
        shared = connection.execute("SELECT count(*) FROM archive_library").fetchone()

    assert (seen, shared) == ([], (1,))
