"""Interrupted swings: found at little cost, gone on with, or set aside."""

import os
import subprocess
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from msgspec import structs

from lightpen.errors import FileError
from lightpen.formats.opened_files import CameraFile, PenFile
from lightpen.record.swings.header import HEADER, Names
from lightpen.record.swings.interrupted import (
    discard_damaged,
    discard_swing,
    find_unfinished,
)
from lightpen.record.swings.reading import (
    DISCARDED,
    JOURNAL,
    VerdictLine,
    image_name,
    line_bytes,
    open_record,
)
from lightpen.record.swings.writing import RecordWriter
from lightpen.swing.preparation import Preparation
from lightpen.swing.swing_recorder import read_for_more, read_resumable, record_header
from lightpen_extensions.simulator.scene_files import write_sample_files
from lightpen_extensions.simulator.scenes import Scene

NOON = datetime(2026, 1, 2, 12, tzinfo=UTC)
BLACK = np.zeros((8, 8), np.uint8)
TOO_MUCH = 1 << 40  # bytes, to be read into memory


@pytest.fixture(scope="module")
def preparation(tmp_path_factory: pytest.TempPathFactory) -> Preparation:
    files = write_sample_files(Scene(), tmp_path_factory.mktemp("files"))
    return Preparation(
        names=Names("Hall 2", "Ann", "LP-04", "T-10", "C-1"),
        camera_file=CameraFile.read(files.camera),
        pen_file=PenFile.read(files.pen),
    )


def append(writer: RecordWriter, n_images: int) -> None:
    for _ in range(n_images):
        writer.append(BLACK, np.ones((10, 2)), np.eye(3), np.full(3, 1e3), 0.0)


def recorded(
    preparation: Preparation, folder: Path, n_images: int, hours: int = 0
) -> RecordWriter:
    created = NOON + timedelta(hours=hours)
    header = structs.replace(record_header(preparation), created=created)
    writer = RecordWriter.create(folder, header)
    append(writer, n_images)
    return writer


def names_found(root: Path) -> list[str]:
    return [record.folder.name for record in find_unfinished(root).interrupted]


def test_swings_without_a_verdict_are_found_the_newest_first(
    preparation: Preparation, tmp_path: Path
) -> None:
    for name, hours in (("a", 1), ("b", 3), ("c", 2)):
        recorded(preparation, tmp_path / name, 1, hours).close()
    with recorded(preparation, tmp_path / "d", 1, 4) as writer:
        writer.conclude("pass")

    assert names_found(tmp_path) == ["b", "c", "a"]


def test_a_swing_without_images_is_no_offer(
    preparation: Preparation, tmp_path: Path
) -> None:
    recorded(preparation, tmp_path / "a", 0).close()

    assert names_found(tmp_path) == []


def test_an_image_after_the_verdict_takes_it_back(
    preparation: Preparation, tmp_path: Path
) -> None:
    with recorded(preparation, tmp_path / "a", 1) as writer:
        writer.conclude("check")
        append(writer, 1)

    assert names_found(tmp_path) == ["a"]


def test_images_taken_out_after_the_verdict_do_not(
    preparation: Preparation, tmp_path: Path
) -> None:
    with recorded(preparation, tmp_path / "a", 3) as writer:
        writer.conclude("check")
        writer.exclude([1], "taken out")
        writer.set_excluded({})

    assert names_found(tmp_path) == []


def test_a_verdict_far_from_the_end_counts_as_well(
    preparation: Preparation, tmp_path: Path
) -> None:
    with recorded(preparation, tmp_path / "a", 1) as writer:
        writer.conclude("check")
        for _ in range(40):
            writer.exclude(range(200), "taken out")

    assert names_found(tmp_path) == []


@pytest.mark.parametrize("tail", [b'{"kind": "ima', bytes(100) + b"\n", b"5\n"])
def test_what_a_crash_left_behind_the_verdict_does_not_hide_it(
    preparation: Preparation, tmp_path: Path, tail: bytes
) -> None:
    with recorded(preparation, tmp_path / "a", 1) as writer:
        writer.conclude("pass")
    with (tmp_path / "a" / "journal.jsonl").open("ab") as journal:
        journal.write(tail)

    assert names_found(tmp_path) == []


def test_folders_that_are_no_records_are_passed_over(
    preparation: Preparation, tmp_path: Path
) -> None:
    recorded(preparation, tmp_path / "a", 2).close()
    recorded(preparation, tmp_path / "damaged", 2).close()
    for copy in (tmp_path / "damaged").glob("pen.*"):
        copy.unlink()
    (tmp_path / "empty").mkdir()
    (tmp_path / "file").touch()

    assert names_found(tmp_path) == ["a"]
    (damaged,) = find_unfinished(tmp_path).damaged
    assert damaged.folder == tmp_path / "damaged"
    assert str(damaged.message).startswith("The LED file ")
    assert names_found(tmp_path / "file") == []
    assert names_found(tmp_path / "nothing here") == []


def test_a_folder_that_cannot_be_read_is_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(folder: Path) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "iterdir", refuse)  # root may read everything

    with pytest.raises(FileError, match="cannot be read: Permission denied"):
        find_unfinished(tmp_path)


@pytest.mark.skipif(os.name == "nt", reason="files have no holes here")
def test_of_a_concluded_swing_only_the_end_of_its_journal_is_read(
    preparation: Preparation, tmp_path: Path
) -> None:
    """So that thousands of them cost little."""
    for name in ("concluded", "open"):
        recorded(preparation, tmp_path / name, 1).close()
    verdict = b"\n" + line_bytes(VerdictLine("pass"))
    with (tmp_path / "concluded" / JOURNAL).open("r+b") as journal:
        journal.seek(TOO_MUCH)  # a hole: it takes no room on the disk
        journal.write(verdict)
    (tmp_path / "concluded" / HEADER).write_bytes(b"never read")

    found = find_unfinished(tmp_path)

    assert [record.folder.name for record in found.interrupted] == ["open"]
    assert found.damaged == ()


def test_a_swing_goes_on_with_images_of_its_own_size_only(
    preparation: Preparation, tmp_path: Path
) -> None:
    recorded(preparation, tmp_path / "a", 1).close()

    resumable = read_resumable(tmp_path / "a")

    assert resumable.fits((2448, 2048))
    assert not resumable.fits((1224, 1024))


def test_a_discarded_swing_is_not_offered_again_and_keeps_its_images(
    preparation: Preparation, tmp_path: Path
) -> None:
    recorded(preparation, tmp_path / "a", 3).close()

    discard_swing(tmp_path / "a")

    assert names_found(tmp_path) == []
    record = open_record(tmp_path / "a")
    assert record.verdict == DISCARDED
    assert all(
        (record.folder / image_name(image.number)).is_file() for image in record.images
    )


def test_a_damaged_swing_cannot_go_on(preparation: Preparation, tmp_path: Path) -> None:
    recorded(preparation, tmp_path / "a", 2).close()
    (tmp_path / "a" / "journal.jsonl").write_bytes(b"{\n{\n{\n")

    with pytest.raises(FileError, match=r"Line 1 of .* is damaged"):
        read_resumable(tmp_path / "a")
    with pytest.raises(FileError, match=r"Line 1 of .* is damaged"):
        discard_swing(tmp_path / "a")


def reported(root: Path) -> str:
    """Return what is said of the only damaged swing, which can be discarded."""
    (damaged,) = find_unfinished(root).damaged
    assert names_found(root) == []
    return str(damaged.message)


def test_a_header_cut_in_half_is_reported(
    preparation: Preparation, tmp_path: Path
) -> None:
    recorded(preparation, tmp_path / "a", 1).close()
    header = tmp_path / "a" / "header.json"
    header.write_bytes(header.read_bytes()[:200])

    assert reported(tmp_path) == f"{header} is damaged. Restore it from a copy."


@pytest.mark.parametrize("name", ["header.json", "journal.jsonl"])
def test_images_without_a_header_or_journal_are_reported(
    preparation: Preparation, tmp_path: Path, name: str
) -> None:
    recorded(preparation, tmp_path / "a", 1).close()
    (tmp_path / "a" / name).unlink()

    assert reported(tmp_path).startswith(
        f"{tmp_path / 'a'} contains images of a swing, but no {name}."
    )


def test_an_emptied_journal_is_reported(
    preparation: Preparation, tmp_path: Path
) -> None:
    recorded(preparation, tmp_path / "a", 3).close()
    (tmp_path / "a" / "journal.jsonl").write_bytes(b"")

    assert "lists none of the 3 images in its folder." in reported(tmp_path)


def test_a_record_that_was_just_being_made_is_passed_over(
    preparation: Preparation, tmp_path: Path
) -> None:
    recorded(preparation, tmp_path / "a", 0).close()
    (tmp_path / "a" / "header.json").unlink()
    recorded(preparation, tmp_path / "b", 1).close()
    (tmp_path / "b" / "journal.jsonl").write_bytes(b"")  # killed before its line

    assert find_unfinished(tmp_path).damaged == ()
    assert names_found(tmp_path) == []


@pytest.mark.parametrize("name", ["header.json", "journal.jsonl", "camera.yaml"])
def test_a_damaged_swing_that_was_discarded_is_not_reported_again(
    preparation: Preparation, tmp_path: Path, name: str
) -> None:
    recorded(preparation, tmp_path / "a", 3).close()
    damaged = tmp_path / "a" / name
    content = damaged.read_bytes()
    damaged.unlink()
    assert reported(tmp_path)

    discard_damaged(tmp_path / "a")

    assert find_unfinished(tmp_path).damaged == ()
    assert len(list((tmp_path / "a" / "images").iterdir())) == 3
    damaged.write_bytes(content)
    assert len(open_record(tmp_path / "a").images) == 3


def test_a_torn_line_does_not_become_a_damage_by_discarding(
    preparation: Preparation, tmp_path: Path
) -> None:
    recorded(preparation, tmp_path / "a", 3).close()
    journal, header = (tmp_path / "a" / n for n in ("journal.jsonl", "header.json"))
    journal.write_bytes(journal.read_bytes()[:-5])
    content = header.read_bytes()
    header.unlink()

    discard_damaged(tmp_path / "a")
    header.write_bytes(content)

    record = open_record(tmp_path / "a")
    assert (len(record.images), record.verdict) == (2, DISCARDED)


def test_a_swing_under_way_in_another_program_is_distinguished_until_that_is_killed(
    preparation: Preparation,
    tmp_path: Path,
    holding: Callable[[Path], "subprocess.Popen[str]"],
) -> None:
    recorded(preparation, tmp_path / "a", 2).close()
    other = holding(tmp_path / "a")

    found = find_unfinished(tmp_path)
    assert [record.folder.name for record in found.under_way] == ["a"]
    assert found.interrupted == ()
    with pytest.raises(FileError, match="Another program is writing"):
        discard_swing(tmp_path / "a")

    other.kill()
    other.wait()
    assert find_unfinished(tmp_path).under_way == ()
    assert names_found(tmp_path) == ["a"]


def test_a_swing_that_goes_on_after_its_verdict_is_resumed_with_the_same_limits(
    preparation: Preparation, tmp_path: Path
) -> None:
    limits = replace(preparation.limits, min_images=2, max_images=3)
    with recorded(replace(preparation, limits=limits), tmp_path / "a", 2) as writer:
        writer.conclude("check")

    more = read_for_more(tmp_path / "a")
    again = read_resumable(tmp_path / "a")

    assert more.setup.limits.min_images > limits.max_images
    assert again.setup.limits == more.setup.limits
    assert find_unfinished(tmp_path).interrupted == ()


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("header.json", b"[" * 100_000),
        ("header.json", b'{"format": 1, "created": "0001-01-01T00:00:00+00:00"}'),
        ("journal.jsonl", b'{"kind": ' + b"[" * 100_000 + b"\n"),
        ("journal.jsonl", b'{"kind": "out", "numbers": [Infinity], "reason": ""}\n'),
    ],
)
def test_a_swing_damaged_in_spite_hides_no_other(
    preparation: Preparation, tmp_path: Path, name: str, content: bytes
) -> None:
    for folder in ("a", "b"):
        recorded(preparation, tmp_path / folder, 1).close()
    (tmp_path / "a" / name).write_bytes(content)

    found = find_unfinished(tmp_path)

    assert [record.folder.name for record in found.interrupted] == ["b"]
    assert [swing.folder.name for swing in found.damaged] == ["a"]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs pipes")
@pytest.mark.parametrize("name", ["header.json", "journal.jsonl"])
def test_a_pipe_in_a_swing_is_waited_for_by_nobody(
    preparation: Preparation, tmp_path: Path, name: str
) -> None:
    for folder in ("a", "b"):
        recorded(preparation, tmp_path / folder, 1).close()
    (tmp_path / "a" / name).unlink()
    os.mkfifo(tmp_path / "a" / name)

    found = find_unfinished(tmp_path)

    assert [record.folder.name for record in found.interrupted] == ["b"]
    assert "is a pipe or a device" in str(found.damaged[0].message)
