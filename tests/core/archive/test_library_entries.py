"""Changes of the tip library are entered, and tell how the tips of a station stand."""

from collections.abc import Iterator
from contextlib import closing
from datetime import date, timedelta
from pathlib import Path

import pytest
from tests.core.archive.conftest import NOON, Station, accepted
from tests.entering import entries_of, retire_item

from lightpen.archive.chains import Entry, Kind, append
from lightpen.archive.checks import check_archive
from lightpen.archive.history import due_tips, known_names
from lightpen.archive.logbook import Logbook, folder_statuses, statuses
from lightpen.archive.store import look_into
from lightpen.messages import Message
from lightpen.model.limits import DueRule
from lightpen.record.library.entered_files import ARCHIVE
from lightpen.record.library.library_changes import Author, add_item, change_item
from lightpen.record.library.tip_library import (
    ItemKind,
    Library,
    ListedCone,
    ListedTip,
    StationStatus,
    TipStatus,
    library_files,
)

ANN = Author("Hall 2", "Ann", "bought in May")
RULE = DueRule(30)


@pytest.fixture
def logbook(tmp_path: Path) -> Iterator[Logbook]:
    book = Logbook(tmp_path)
    yield book
    book.database.close()


def entered(logbook: Logbook) -> list[Entry]:
    return [each.entry for each in entries_of(logbook.database, logbook.chain)]


def findings(data: Path) -> tuple[Message, ...]:
    with closing(look_into(data / ARCHIVE)) as database:
        return check_archive(database, data).findings


def test_each_change_is_entered_once_with_who_when_and_what(
    tmp_path: Path, logbook: Logbook
) -> None:
    tip = ListedTip(id="T-10", ball_diameter_mm=10.0, nominal_tip_mm=(0.0, 1.5, -150.0))
    add_item(tmp_path, tip, ANN, NOON)
    assert logbook.enter_owed() == ()
    retire_item(tmp_path, ItemKind.TIP, "T-10", ANN, NOON + timedelta(days=1))
    assert logbook.enter_owed() == logbook.enter_owed() == ()

    first, second = (each.event for each in entered(logbook))
    assert (first.kind, first.at) == (Kind.LIBRARY, NOON)
    assert (first.names.station, first.names.operator) == ("Hall 2", "Ann")
    assert (first.names.tip, first.names.pen, first.reason) == (
        *("T-10", ""),
        "bought in May",
    )
    assert first.settings["item"] == "tip"
    assert first.settings["ball_diameter_mm"] == 10.0
    assert first.settings["nominal_tip_mm"] == "0.0 1.5 -150.0"
    assert (first.settings["is_retired"], second.settings["is_retired"]) == (
        False,
        True,
    )
    assert findings(tmp_path) == ()
    assert known_names(logbook.database).tips_of("") == ("T-10",)
    assert known_names(logbook.database).pens == ()


def test_a_changed_file_of_the_library_is_found(
    tmp_path: Path, logbook: Logbook
) -> None:
    add_item(tmp_path, ListedTip(id="T-10"), ANN, NOON)
    logbook.enter_owed()
    (file,) = library_files(tmp_path)
    file.write_bytes(file.read_bytes() + b" ")

    assert [each.code for each in findings(tmp_path)] == ["archive.vouched-changed"]


def test_a_damaged_file_of_the_library_stays_owed_and_is_reported(
    tmp_path: Path, logbook: Logbook
) -> None:
    add_item(tmp_path, ListedCone(id="C-1"), ANN, NOON)
    (file,) = library_files(tmp_path)
    sound = file.read_bytes()
    file.write_bytes(sound.replace(b"C-1", b"C-2"))

    (fault,) = logbook.enter_owed()
    assert fault.code == "library.damaged"
    assert entered(logbook) == []
    file.write_bytes(sound)
    assert logbook.enter_owed() == ()
    assert len(entered(logbook)) == 1


def stand(station: Station, library: Library, days: float) -> StationStatus:
    now = NOON + timedelta(days=days)
    return statuses(station.database, station.chain, RULE, library, now)


def test_tips_are_valid_overdue_not_calibrated_or_retired(station: Station) -> None:
    append(station.database, station.chain, *accepted(0))
    library = Library()

    assert stand(station, library, 29).of_tip("LP-04", "T-10") is TipStatus.VALID
    expired = stand(station, library, 31)
    assert expired.of_tip("LP-04", "T-10") is TipStatus.OVERDUE
    assert "expired on 2026-02-01" in str(expired.overdue("LP-04", "T-10"))
    assert stand(station, library, 29).overdue("LP-04", "T-10") is None
    assert stand(station, library, 1).of_tip("LP-05", "T-10") is TipStatus.UNCALIBRATED
    retired = Library(tips={"T-10": ListedTip(id="T-10", is_retired=True)})
    assert stand(station, retired, 1).of_tip("LP-04", "T-10") is TipStatus.RETIRED
    assert StationStatus().of_tip("LP-04", "T-10") is None  # nothing was read yet


def test_a_data_folder_tells_the_same_of_its_tips(
    station: Station, tmp_path: Path
) -> None:
    append(station.database, station.chain, *accepted(0))
    now = NOON + timedelta(days=31)
    file = station.database.file
    assert file is not None
    assert file.name == ARCHIVE

    found = folder_statuses(file.parent, RULE, Library(), now)
    assert found.of_tip("LP-04", "T-10") is TipStatus.OVERDUE
    empty = folder_statuses(tmp_path / "empty", RULE, Library(), now)
    assert empty.of_tip("LP-04", "T-10") is TipStatus.UNCALIBRATED


def test_a_tip_of_a_day_still_to_come_is_overdue_for_its_age_is_not_known(
    station: Station,
) -> None:
    append(station.database, station.chain, *accepted(0))
    library = Library()

    assert stand(station, library, -0.5).of_tip("LP-04", "T-10") is TipStatus.VALID
    assert stand(station, library, -40).of_tip("LP-04", "T-10") is TipStatus.OVERDUE


def test_a_tip_is_due_by_its_own_rule_or_its_own_date(station: Station) -> None:
    append(station.database, station.chain, *accepted(0))
    weekly = Library(tips={"T-10": ListedTip(id="T-10", max_days=7)})
    dated = Library(tips={"T-10": ListedTip(id="T-10", due=date(2026, 1, 3))})

    assert stand(station, weekly, 8).of_tip("LP-04", "T-10") is TipStatus.OVERDUE
    assert stand(station, dated, 8).of_tip("LP-04", "T-10") is TipStatus.OVERDUE
    assert stand(station, dated, 8).due("LP-04", "T-10") == date(2026, 1, 3)
    (tip,) = due_tips(station.database, station.chain, RULE, weekly)
    assert tip.due == NOON + timedelta(days=7)


def test_a_cone_is_overdue_after_its_date(tmp_path: Path, station: Station) -> None:
    cone = ListedCone(id="C-1", due=date(2026, 1, 3))
    add_item(tmp_path, cone, ANN, NOON)
    library = change_item(tmp_path, cone, ANN, NOON)

    assert stand(station, library, 0).of_item(ItemKind.CONE, "C-1") is TipStatus.VALID
    assert stand(station, library, 3).of_item(ItemKind.CONE, "C-1") is TipStatus.OVERDUE
    assert stand(station, library, 3).of_item(ItemKind.CONE, "C-2") is None
