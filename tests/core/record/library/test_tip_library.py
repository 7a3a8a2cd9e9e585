"""The tip library: what follows from its changes, and which changes are refused."""

import json
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, date, datetime
from pathlib import Path

import pytest
from msgspec import structs
from tests.entering import put_in, retire_item

from lightpen.errors import AcceptanceError, FileError, UsageError
from lightpen.formats.own_json import json_bytes, with_checksum
from lightpen.model.limits import DueRule
from lightpen.record.library.library_changes import Author, add_item, change_item
from lightpen.record.library.supervision import Signature, set_password
from lightpen.record.library.tip_library import (
    LIBRARY,
    ItemKind,
    Library,
    ListedCone,
    ListedPen,
    ListedTip,
    library_changes,
    library_files,
    read_library,
)

NOON = datetime(2031, 5, 1, 12, tzinfo=UTC)
ANN = Author("Hall 2", "Ann", "worn")
TIP = ListedTip(id="T-10", ball_diameter_mm=10.0, nominal_tip_mm=(0.0, 0.0, -150.0))


def test_a_folder_without_a_library_has_an_empty_one(tmp_path: Path) -> None:
    assert read_library(tmp_path) == Library()


def test_pens_tips_and_cones_are_known_by_their_ids(tmp_path: Path) -> None:
    add_item(tmp_path, TIP, ANN, NOON)
    add_item(tmp_path, ListedPen(id="LP-04", due=date(2032, 1, 1)), ANN, NOON)
    library = add_item(tmp_path, ListedCone(id="C-1"), ANN, NOON)

    assert library == read_library(tmp_path)
    assert library.item(ItemKind.TIP, "T-10") == TIP
    assert library.pens["LP-04"].is_overdue(date(2032, 1, 2))
    assert not library.pens["LP-04"].is_overdue(date(2032, 1, 1))
    assert list(library.cones) == ["C-1"]


def test_a_change_keeps_what_was_before_it_with_who_and_when(tmp_path: Path) -> None:
    add_item(tmp_path, TIP, ANN, NOON)
    smaller = structs.replace(TIP, ball_diameter_mm=9.998)
    change_item(tmp_path, smaller, ANN, NOON)
    change_item(tmp_path, smaller, ANN, NOON)  # nothing changes

    assert read_library(tmp_path).tips["T-10"] == smaller
    first, second = (change for _, change in library_changes(tmp_path))
    assert (first.item, second.item) == (TIP, smaller)
    assert (second.operator, second.station, second.reason) == ("Ann", "Hall 2", "worn")
    assert second.at == NOON


def test_a_retired_item_stays_known_and_can_be_brought_back(tmp_path: Path) -> None:
    add_item(tmp_path, TIP, ANN, NOON)

    assert (
        retire_item(tmp_path, ItemKind.TIP, "T-10", ANN, NOON).tips["T-10"].is_retired
    )
    back = retire_item(tmp_path, ItemKind.TIP, "T-10", ANN, NOON, is_retired=False)
    assert not back.tips["T-10"].is_retired


@pytest.mark.parametrize("name", ["T-10", "t-10", " T-10 "])
def test_an_id_that_is_in_use_is_refused(tmp_path: Path, name: str) -> None:
    add_item(tmp_path, TIP, ANN, NOON)

    with pytest.raises(UsageError, match=r"tip T-10 is in the library already\. Edit"):
        add_item(tmp_path, ListedTip(id=name), ANN, NOON)
    assert add_item(tmp_path, ListedPen(id="T-10"), ANN, NOON).pens  # a pen is no tip


def test_the_id_of_a_retired_tip_is_refused_with_what_to_do(tmp_path: Path) -> None:
    add_item(tmp_path, TIP, ANN, NOON)
    retire_item(tmp_path, ItemKind.TIP, "T-10", ANN, NOON)

    with pytest.raises(UsageError, match=r"retired\. Reactivate it"):
        add_item(tmp_path, TIP, ANN, NOON)


@pytest.mark.parametrize(
    ("entries", "reported"),
    [
        ({"ball_diameter_mm": 0.0}, "Ball diameter 0 mm is not valid"),
        ({"ball_diameter_mm": 5000.0}, "Ball diameter 5000 mm is not valid"),
        ({"ball_diameter_mm": float("nan")}, "Ball diameter nan mm is not valid"),
        ({"max_change_mm": -0.1}, "Max. change -0.1 mm"),
        ({"max_days": 0}, "0 is not valid"),
        ({"max_days": 10**6}, "1000000 is not valid"),
        ({"nominal_tip_mm": (0.0, float("inf"), 0.0)}, "The nominal centre"),
        ({"id": "  "}, "is not a valid ID"),
        ({"id": "T\n1"}, "is not a valid ID"),
        ({"id": "T" * 201}, "is not a valid ID"),
    ],
)
def test_what_makes_no_sense_of_a_tip_is_refused(
    tmp_path: Path, entries: dict[str, object], reported: str
) -> None:
    with pytest.raises(UsageError, match=reported):
        add_item(tmp_path, structs.replace(TIP, **entries), ANN, NOON)
    assert library_files(tmp_path) == ()


def test_a_tip_that_is_not_there_cannot_be_changed(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="There is no tip T-10 in the library"):
        change_item(tmp_path, TIP, ANN, NOON)


def test_a_tip_has_a_rule_of_its_own_or_that_of_the_station() -> None:
    usual, own = DueRule(30), ListedTip(id="T", max_days=7)

    library = Library(tips={"T": own})
    assert library.rule_of("T", usual) == DueRule(7)
    assert library.rule_of("T-10", usual) == usual


def test_a_barcode_is_known_whatever_case_the_scanner_types(tmp_path: Path) -> None:
    library = add_item(tmp_path, TIP, ANN, NOON)

    assert library.tip("T-10") == library.tip("t-10") == TIP
    assert library.tip("T-1") is None


def test_with_a_password_only_a_supervisor_changes_the_library(tmp_path: Path) -> None:
    eve = Signature("Eve", "correct horse")
    set_password(tmp_path, eve, eve.password, NOON)

    for by in (ANN, Author("Hall 2", "Ann", signature=Signature("Eve", "wrong one"))):
        with pytest.raises(AcceptanceError):
            add_item(tmp_path, TIP, by, NOON)
    add_item(tmp_path, TIP, Author("Hall 2", "Ann", signature=eve), NOON)
    ((_, change),) = library_changes(tmp_path)
    assert (change.operator, change.supervisor) == ("Ann", "Eve")


def test_a_changed_file_is_reported_and_nothing_older_counts(tmp_path: Path) -> None:
    add_item(tmp_path, TIP, ANN, NOON)
    change_item(tmp_path, structs.replace(TIP, max_change_mm=0.02), ANN, NOON)
    _, newest = library_files(tmp_path)
    newest.write_bytes(newest.read_bytes().replace(b"0.02", b"0.92"))

    with pytest.raises(FileError, match=r"000002\.json was changed"):
        read_library(tmp_path)


def test_a_file_of_a_later_version_is_refused(tmp_path: Path) -> None:
    from lightpen.formats.own_json import record_bytes

    (tmp_path / LIBRARY).mkdir()
    file = tmp_path / LIBRARY / "000001.json"
    put_in(tmp_path, file, record_bytes({"format": 2, "new": True}))

    with pytest.raises(FileError, match="later version"):
        read_library(tmp_path)


def test_of_two_who_add_the_same_id_at_once_one_does(tmp_path: Path) -> None:
    def add(n: int) -> bool:
        try:
            add_item(tmp_path, ListedTip(id="T-10", note=str(n)), ANN, NOON)
        except UsageError:
            return False
        return True

    with ThreadPoolExecutor(8) as executor:
        assert sum(executor.map(add, range(8))) == 1
    assert len(library_files(tmp_path)) == 1


def test_a_form_that_is_older_than_the_item_overwrites_nothing(tmp_path: Path) -> None:
    shown = ListedTip(id="T-10")
    add_item(tmp_path, shown, ANN, NOON)
    newer = structs.replace(shown, max_change_mm=0.01)
    change_item(tmp_path, newer, ANN, NOON, before=shown)
    stale = structs.replace(shown, note="bent", max_change_mm=1.0)
    with pytest.raises(UsageError, match="changed in another window"):
        change_item(tmp_path, stale, ANN, NOON, before=shown)
    assert read_library(tmp_path).tips["T-10"] == newer


@pytest.mark.parametrize("name", ["a/b", "a\\b"])
def test_an_id_has_no_separator_of_folders(tmp_path: Path, name: str) -> None:
    with pytest.raises(UsageError, match="not a valid ID"):
        add_item(tmp_path, ListedTip(id=name), ANN, NOON)


def test_with_a_password_a_change_that_was_written_by_hand_is_refused(
    tmp_path: Path,
) -> None:
    eve = Signature("Eve", "correct horse")
    set_password(tmp_path, eve, eve.password, NOON)
    signed = Author("Hall 2", "Ann", signature=eve)
    add_item(tmp_path, ListedTip(id="T-10"), signed, NOON)
    (file,) = library_files(tmp_path)
    entries = json.loads(file.read_bytes())
    del entries["checksum"]
    entries["item"]["max_change_mm"] = 9.0
    file.write_bytes(with_checksum(json_bytes(entries)))
    with pytest.raises(FileError, match="was changed"):
        read_library(tmp_path)
