"""What killed programs left is removed at the next start, and nothing else."""

import os
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from lightpen.formats.part_files import part_of
from lightpen.record.folder import OLDEST, sweep_leftovers
from lightpen.record.results.result_folder import RECORDS, RESULTS
from lightpen.record.swings.reading import open_record
from lightpen.record.swings.writing import RecordWriter

PART = ".0123456789abcdef.part"


@pytest.fixture
def swing(swung: Callable[..., Path], tmp_path: Path) -> Path:
    """An unfinished swing in a data folder."""
    shutil.copytree(swung(1), folder := tmp_path / RECORDS / "swing")
    return folder


def age(folder: Path) -> None:
    """Have a folder been changed some time ago."""
    then = folder.stat().st_mtime - 2 * OLDEST
    os.utime(folder, (then, then))


def leave(part: Path) -> None:
    """Leave a torn part behind, long ago: by its age Windows knows that it was left."""
    part.write_bytes(b"torn")
    os.utime(part, (0, 0))


@pytest.mark.slow
def test_parts_of_killed_writes_are_removed(swing: Path, tmp_path: Path) -> None:
    (tmp_path / RESULTS).mkdir()
    parts = [folder / PART for folder in (tmp_path / RESULTS, swing, swing / "images")]
    for part in parts:
        leave(part)
    before = open_record(swing)

    sweep_leftovers(tmp_path)

    assert not any(part.exists() for part in parts)
    assert len(open_record(swing).images) == len(before.images) == 1


def test_the_part_of_a_running_program_and_the_files_of_others_stay(
    tmp_path: Path,
) -> None:
    results = tmp_path / RESULTS
    results.mkdir()
    (results / "notes.part").write_bytes(b"of the user")

    with part_of(results / "000001.json", b"being written") as part:
        sweep_leftovers(tmp_path)
        assert part.read_bytes() == b"being written"

    assert [path.name for path in results.iterdir()] == ["notes.part"]


def test_a_swing_that_never_began_is_removed(swing: Path, tmp_path: Path) -> None:
    for name in ("header.json", "images/000001.png"):
        (swing / name).unlink()
    (swing / "journal.jsonl").write_bytes(b"")
    leave(swing / PART)
    age(swing)

    sweep_leftovers(tmp_path)

    assert list((tmp_path / RECORDS).iterdir()) == []


@pytest.mark.parametrize(
    "kept", ["images/000001.png", "notes.txt", "header.json", "journal.jsonl"]
)
def test_a_swing_with_anything_in_it_stays(
    swing: Path, tmp_path: Path, kept: str
) -> None:
    (swing / "notes.txt").write_text("mine")
    for name in {"images/000001.png", "notes.txt", "header.json"} - {kept}:
        (swing / name).unlink()
    if kept != "journal.jsonl":
        (swing / "journal.jsonl").write_bytes(b"")
    age(swing)

    sweep_leftovers(tmp_path)

    assert (swing / kept).exists()


def test_a_swing_that_is_just_being_made_stays(swing: Path, tmp_path: Path) -> None:
    with RecordWriter.resume(open_record(swing)):
        for name in ("header.json", "images/000001.png"):
            (swing / name).unlink()
        os.truncate(swing / "journal.jsonl", 0)
        age(swing)
        sweep_leftovers(tmp_path)
        assert (swing / "journal.jsonl").exists()
