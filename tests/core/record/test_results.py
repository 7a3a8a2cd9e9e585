"""Accepted tips: the last one of a pen and tip is in force, and none is ever lost."""

import json
import subprocess
import sys
from dataclasses import replace
from datetime import UTC, datetime, timedelta, timezone
from pathlib import Path

import numpy as np
import pytest

from lightpen.errors import FileError
from lightpen.record.names import Names
from lightpen.record.results import OLD, Result, last_result, store_result

NAMES = Names("Halle 3", "Jörg", "LP-04", "T-10", "C-1", 3.0005)
NOON = datetime(2026, 1, 2, 12, tzinfo=UTC)


def result(x: float = 1 / 3, names: Names = NAMES, accepted: datetime = NOON) -> Result:
    return Result(
        names=names,
        accepted=accepted,
        grade="pass",
        tip_pen=np.array([x, -90.0, -25.0]) / 3,
        uncertainty=np.array([0.003, 0.004, 0.005]) / 3,
        record="/records/1",
    )


def x_in_force(root: Path, pen: str = "LP-04", tip: str = "T-10") -> float:
    found = last_result(root, pen, tip)
    assert found is not None
    return float(found.tip_pen[0])


def test_a_result_is_read_back_to_the_last_digit(tmp_path: Path) -> None:
    given = result(accepted=datetime.now(timezone(timedelta(hours=8))))
    store_result(tmp_path / "results", given)

    found = last_result(tmp_path / "results", "LP-04", "T-10")

    assert found is not None
    assert found.names == NAMES
    assert (found.accepted, found.grade, found.record) == (
        *(given.accepted, "pass", "/records/1"),
    )
    np.testing.assert_array_equal(found.tip_pen, given.tip_pen)
    np.testing.assert_array_equal(found.uncertainty, given.uncertainty)


def test_at_first_none_is_in_force(tmp_path: Path) -> None:
    assert last_result(tmp_path / "no folder yet", "LP-04", "T-10") is None


def test_each_pen_and_tip_has_its_own_in_force(tmp_path: Path) -> None:
    store_result(tmp_path, result(3.0))
    store_result(tmp_path, result(6.0, replace(NAMES, tip="T-11")))
    store_result(tmp_path, result(9.0, replace(NAMES, pen="LP-05")))

    assert x_in_force(tmp_path) == 1.0
    assert x_in_force(tmp_path, tip="T-11") == 2.0
    assert x_in_force(tmp_path, pen="LP-05") == 3.0
    assert last_result(tmp_path, "LP-05", "T-11") is None


def test_the_last_accepted_is_in_force(tmp_path: Path) -> None:
    for day in range(12):
        store_result(tmp_path, result(3.0 * day, accepted=NOON + timedelta(day)))

    assert x_in_force(tmp_path) == 11.0


def test_a_clock_that_was_set_back_does_not_keep_the_old_tip_in_force(
    tmp_path: Path,
) -> None:
    store_result(tmp_path, result(3.0, accepted=NOON))
    store_result(tmp_path, result(6.0, accepted=NOON - timedelta(days=9000)))

    assert x_in_force(tmp_path) == 2.0


def test_nothing_is_overwritten_even_at_the_same_instant(tmp_path: Path) -> None:
    files = {store_result(tmp_path, result(3.0 * n)) for n in range(5)}

    assert len(files) == 5
    assert {json.loads(file.read_bytes())["tip_pen_mm"][0] for file in files} == {
        *(0.0, 1.0, 2.0, 3.0, 4.0),
    }
    assert x_in_force(tmp_path) == 4.0


@pytest.mark.parametrize("name", ["a/b\\c", "王 Ä", "w" * 200, "..", "T 10 "])
def test_any_name_will_do(tmp_path: Path, name: str) -> None:
    names = replace(NAMES, pen=name, tip=name)
    store_result(tmp_path, result(6.0, names))

    assert x_in_force(tmp_path, name, name) == 2.0


@pytest.mark.parametrize(
    "content",
    [
        b"{",
        b"",
        b"[]",
        b"null",
        b"\xff\xfe",
        b"[" * 100_000,
        b'{"accepted": 5}',
    ],
)
def test_a_damaged_result_is_told_and_not_passed_over(
    tmp_path: Path, content: bytes
) -> None:
    """An older tip must not come into force again in silence."""
    store_result(tmp_path, result())
    file = store_result(tmp_path, result(accepted=NOON + timedelta(1)))
    file.write_bytes(content)

    with pytest.raises(FileError, match="000002_") as caught:
        last_result(tmp_path, "LP-04", "T-10")
    assert str(file) in str(caught.value)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("tip_pen_mm", [1.0, 2.0]),
        ("tip_pen_mm", [1.0, 2.0, float("nan")]),
        ("expanded_uncertainty_mm", [1.0, 2.0, float("inf")]),
        ("accepted", "yesterday"),
        ("accepted", "2026-01-02T12:00:00"),
        ("ball_diameter_mm", "wide"),
    ],
)
def test_an_entry_that_makes_no_sense_is_damage(
    tmp_path: Path, key: str, value: object
) -> None:
    file = store_result(tmp_path, result())
    file.write_text(json.dumps(json.loads(file.read_bytes()) | {key: value}))

    with pytest.raises(FileError, match="is damaged"):
        last_result(tmp_path, "LP-04", "T-10")


def test_a_ball_diameter_that_is_not_known_is_stored_as_none(tmp_path: Path) -> None:
    unknown = replace(result(), names=replace(NAMES, ball_diameter=None))
    file = store_result(tmp_path, unknown)

    stored = last_result(tmp_path, "LP-04", "T-10")

    assert json.loads(file.read_bytes())["ball_diameter_mm"] is None
    assert stored is not None
    assert stored.names.ball_diameter is None


def test_a_damaged_result_that_is_older_does_not_matter(tmp_path: Path) -> None:
    store_result(tmp_path, result()).write_bytes(b"{")
    store_result(tmp_path, result(6.0))

    assert x_in_force(tmp_path) == 2.0


def test_other_files_in_the_folder_are_left_alone(tmp_path: Path) -> None:
    (tmp_path / "notes.json").write_text("{}")
    (tmp_path / "000009_x.txt").write_text("no result")
    file = store_result(tmp_path, result(3.0))

    assert file.name.startswith("000001_")
    assert x_in_force(tmp_path) == 1.0


def test_a_folder_that_cannot_be_made_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("no folder")

    with pytest.raises(FileError, match="cannot be made"):
        store_result(tmp_path / "file" / "results", result())


FULL_DISK = """
import resource, signal, sys
from pathlib import Path
from lightpen.errors import FileError
sys.path.insert(0, sys.argv[1])
from test_results import result
from lightpen.record.results import store_result

signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))
try:
    store_result(Path(sys.argv[2]), result(6.0))
except FileError as error:
    print(error)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="needs a limit of file sizes")
def test_a_full_disk_is_told_and_keeps_the_old_tip_in_force(tmp_path: Path) -> None:
    store_result(tmp_path, result(3.0))

    child = subprocess.run(
        [sys.executable, "-c", FULL_DISK, str(Path(__file__).parent), str(tmp_path)],
        capture_output=True,
        text=True,
        check=True,
    )

    assert "cannot be written" in child.stdout
    assert len(list(tmp_path.iterdir())) == 1
    assert x_in_force(tmp_path) == 1.0


@pytest.mark.parametrize(("age", "old"), [(OLD, False), (1.01 * OLD, True)])
def test_a_tip_grows_old(age: timedelta, old: bool) -> None:
    assert result().is_old(NOON + age) is old
