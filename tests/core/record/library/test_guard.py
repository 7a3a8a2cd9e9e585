"""Limits that were removed, replaced or rolled back are refused."""

import shutil
from collections.abc import Callable
from contextlib import closing
from datetime import UTC, datetime
from pathlib import Path

import pytest
from msgspec import ValidationError, convert, structs, to_builtins
from tests.entering import enter_in

from lightpen.archive.logbook import Logbook
from lightpen.errors import AcceptanceError, FileError
from lightpen.formats.own_json import json_bytes, parse_own_json, with_checksum
from lightpen.model.limits import StationLimits, SwingLimits
from lightpen.record.library.entered_files import ARCHIVE, entered_files
from lightpen.record.library.signing import (
    SALT_LENGTH,
    head_file,
    key_folder,
    station_key,
    station_name,
)
from lightpen.record.library.supervision import (
    LIMITS_FOLDER,
    LimitsChange,
    PasswordVerifier,
    Signature,
    read_supervision,
    renew_station_key,
    set_limits,
    set_password,
    write_limits_change,
)

NOON = datetime(2026, 1, 2, 12, tzinfo=UTC)
EVE = Signature("Eve", "correct horse")
STRICT = StationLimits(SwingLimits(0.0005))
LAX = StationLimits(SwingLimits(5.0))


@pytest.fixture
def guarded(tmp_path: Path) -> Path:
    data = tmp_path / "data"
    set_password(data, EVE, EVE.password, NOON)
    set_limits(data, "Hall 2", STRICT, EVE, NOON)
    enter_in(data)
    return data


def of_another_folder(data: Path, number: int) -> None:
    """Put in a file of limits that was approved, but in another data folder."""
    other = data.parent / "other"
    set_password(other, EVE, EVE.password, NOON)
    for n in range(2, number + 1):
        set_limits(other, f"Hall {n}", LAX, EVE, NOON)
    enter_in(other)
    name = f"{number:06d}.json"
    shutil.copy(other / LIMITS_FOLDER / name, data / LIMITS_FOLDER / name)


def edited(data: Path) -> None:
    """Loosen the limits, with another checksum."""
    file = data / LIMITS_FOLDER / "000002.json"
    entries = parse_own_json(file.read_bytes(), dict[str, object])
    del entries["checksum"]
    limits = entries["limits"]
    assert isinstance(limits, dict)
    limits["max_uncertainty_mm"] = 5.0
    file.write_bytes(with_checksum(json_bytes(entries)))


REFUSED: dict[str, Callable[[Path], object]] = {
    "folder removed": lambda data: shutil.rmtree(data / LIMITS_FOLDER),
    "newest removed": lambda data: (data / LIMITS_FOLDER / "000002.json").unlink(),
    "first removed": lambda data: (data / LIMITS_FOLDER / "000001.json").unlink(),
    "edited with another checksum": edited,
    "password of another folder": lambda data: of_another_folder(data, 1),
}
PASSED_OVER: dict[str, Callable[[Path], object]] = {
    "limits of another folder": lambda data: of_another_folder(data, 3),
    "copied to the end": lambda data: shutil.copy(
        data / LIMITS_FOLDER / "000002.json", data / LIMITS_FOLDER / "000003.json"
    ),
}


@pytest.mark.parametrize("how", REFUSED)
def test_a_guard_that_was_tampered_with_is_refused(guarded: Path, how: str) -> None:
    REFUSED[how](guarded)
    with pytest.raises(FileError, match="Nothing is accepted until"):
        read_supervision(guarded)


@pytest.mark.parametrize("how", PASSED_OVER)
def test_a_file_that_is_not_entered_is_passed_over(guarded: Path, how: str) -> None:
    before = read_supervision(guarded)
    PASSED_OVER[how](guarded)
    after = read_supervision(guarded)
    assert (after.password, after.limits) == (before.password, before.limits)


def test_an_administrator_can_begin_anew(guarded: Path) -> None:
    head_file(station_name(guarded)).unlink()
    for place in (ARCHIVE, LIMITS_FOLDER):
        whole = guarded / place
        shutil.rmtree(whole) if whole.is_dir() else whole.unlink()
    assert not read_supervision(guarded).is_guarded


def test_files_by_which_a_password_can_be_guessed_are_private(guarded: Path) -> None:
    for file in (guarded / LIMITS_FOLDER).iterdir():
        assert file.stat().st_mode & 0o077 == 0


def test_limits_hold_for_every_spelling_of_the_station(guarded: Path) -> None:
    supervision = read_supervision(guarded)
    for name in ("hall 2", "HALL 2 ", " Hall  2", "Hall\u00a02", "\uff28all 2"):
        assert supervision.limits_at(name, LAX) == STRICT
        assert not supervision.is_unknown(name)
    assert supervision.is_unknown("Hall 22")


@pytest.mark.parametrize("salt", ["", "zz" * SALT_LENGTH, "00" * (SALT_LENGTH - 1)])
def test_a_malformed_salt_is_damage(guarded: Path, salt: str) -> None:
    guard = read_supervision(guarded)
    assert guard.password is not None
    with pytest.raises(ValidationError, match="salt"):
        convert(
            to_builtins(structs.replace(guard.password, salt=salt)), PasswordVerifier
        )


def test_limits_that_were_changed_meanwhile_are_not_overwritten(guarded: Path) -> None:
    with pytest.raises(AcceptanceError, match="changed in another window"):
        set_limits(guarded, "Hall 2", LAX, EVE, NOON, before=StationLimits())
    set_limits(guarded, "Hall 2", LAX, EVE, NOON, before=STRICT)
    assert read_supervision(guarded).limits_at("Hall 2", STRICT) == LAX


def without_key(data: Path) -> str:
    """Move a data folder to an account without its station key; return its chain."""
    name = station_name(data)
    (key_folder() / f"{name}.key").unlink()
    return name


@pytest.mark.slow
def test_a_lost_station_key_is_replaced_by_a_supervisor_alone(guarded: Path) -> None:
    chain = without_key(guarded)
    with pytest.raises(AcceptanceError, match="approval"):
        renew_station_key(guarded, chain, None, NOON)
    with pytest.raises(AcceptanceError, match="Wrong"):
        renew_station_key(guarded, chain, Signature("Eve", "wrong"), NOON)

    public = renew_station_key(guarded, chain, EVE, NOON)
    set_limits(guarded, "Hall 2", LAX, EVE, NOON)
    enter_in(guarded)
    assert read_supervision(guarded).limits_at("Hall 2", STRICT) == LAX
    assert entered_files(guarded).station_key == public


def test_the_station_key_introduces_the_next(guarded: Path) -> None:
    chain = station_name(guarded)
    assert station_key(chain) is not None
    public = renew_station_key(guarded, chain, None, NOON)
    enter_in(guarded)
    assert entered_files(guarded).station_key == public


def test_the_station_key_alone_changes_no_limits(guarded: Path) -> None:
    """Whoever has the key of a station, and no password, approves nothing."""
    lax = {"max_uncertainty_mm": 5.0}
    change = LimitsChange(
        format=1, at=NOON, supervisor="Chef", station="Hall 2", limits=lax
    )
    write_limits_change(guarded, 3, change, None)
    with pytest.raises(FileError, match="not approved by a supervisor"):
        read_supervision(guarded)
    with closing(Logbook(guarded)) as logbook:
        assert len(logbook.enter_owed()) == 1
