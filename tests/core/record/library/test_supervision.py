"""Tests of `lightpen.record.library.supervision`."""

from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import pytest

from lightpen.errors import AcceptanceError, FileError
from lightpen.model.limits import (
    DueRule,
    StationLimits,
    SwingLimits,
    VerificationLimits,
)
from lightpen.record.library.supervision import (
    LIMITS_FOLDER,
    Signature,
    Supervision,
    read_supervision,
    require_supervisor,
    set_limits,
    set_password,
)

NOON = datetime(2031, 5, 1, 12, tzinfo=UTC)
SECRET = "correct horse"
EVE = Signature("Eve", SECRET)
TIGHT = StationLimits(
    *(SwingLimits(0.008, 80, 200), VerificationLimits(radius=0.005), DueRule(7))
)


@pytest.fixture
def guarded(tmp_path: Path) -> Path:
    """A data folder with a supervisor's password."""
    set_password(tmp_path, EVE, SECRET, NOON)
    return tmp_path


def test_without_a_password_nothing_is_guarded(tmp_path: Path) -> None:
    assert read_supervision(tmp_path) == Supervision()
    assert not read_supervision(tmp_path).is_guarded


def test_the_password_itself_is_nowhere_on_the_disk(guarded: Path) -> None:
    (file,) = (guarded / LIMITS_FOLDER).iterdir()

    assert read_supervision(guarded).is_guarded
    assert SECRET.encode() not in file.read_bytes()
    assert SECRET not in repr(EVE)


def test_the_newest_limits_of_each_station_count(guarded: Path) -> None:
    set_limits(guarded, "Hall 2", StationLimits(), EVE, NOON)
    set_limits(guarded, "Hall 3", StationLimits(), EVE, NOON)
    set_limits(guarded, "Hall 2", TIGHT, EVE, NOON)

    limits = read_supervision(guarded).limits
    assert limits == {"Hall 2": TIGHT, "Hall 3": StationLimits()}
    assert len(list((guarded / LIMITS_FOLDER).iterdir())) == 4


def test_what_is_chosen_holds_where_nothing_is_laid_down() -> None:
    supervision = Supervision(limits={"Hall 2": TIGHT})
    chosen = StationLimits(SwingLimits(0.02, 40, 90))

    assert supervision.limits_at("Hall 2", chosen) == TIGHT
    assert supervision.limits_at("Hall 3", chosen) == chosen


@pytest.mark.parametrize(
    ("signature", "code"),
    [
        (Signature("Eve", "wrong horse"), "supervisor.wrong-password"),
        (Signature(" ", SECRET), "supervisor.no-name"),
    ],
)
def test_nobody_else_changes_anything(
    guarded: Path, signature: Signature, code: str
) -> None:
    before = read_supervision(guarded)
    with pytest.raises(AcceptanceError) as refused:
        set_limits(guarded, "Hall 2", TIGHT, signature, NOON)
    assert refused.value.message.code == code
    with pytest.raises(AcceptanceError) as refused:
        set_password(guarded, signature, "another one", NOON)
    assert refused.value.message.code == code
    assert read_supervision(guarded) == before


@pytest.mark.slow
def test_the_password_is_changed_by_the_one_before(guarded: Path) -> None:
    set_password(guarded, EVE, "another one", NOON)
    supervision = read_supervision(guarded)

    require_supervisor(supervision, replace(EVE, password="another one"))
    with pytest.raises(AcceptanceError):
        require_supervisor(supervision, EVE)


def test_limits_are_laid_down_only_where_there_is_a_password(tmp_path: Path) -> None:
    with pytest.raises(AcceptanceError, match="No supervisor password is set"):
        set_limits(tmp_path, "Hall 2", TIGHT, EVE, NOON)


def test_a_short_password_is_refused(tmp_path: Path) -> None:
    with pytest.raises(AcceptanceError, match=r"3 characters\. Enter at least 8"):
        set_password(tmp_path, EVE, "abc", NOON)


def test_a_change_of_the_files_is_noticed(guarded: Path) -> None:
    set_limits(guarded, "Hall 2", TIGHT, EVE, NOON)
    file = max((guarded / LIMITS_FOLDER).iterdir())
    file.write_bytes(file.read_bytes().replace(b"0.005", b"0.500"))

    with pytest.raises(FileError, match="was changed before it was entered"):
        read_supervision(guarded)
