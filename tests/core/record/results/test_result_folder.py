"""Accepted tips: the last one of a pen and tip is in force, and none is ever lost."""

import json
import pickle
import shutil
import subprocess
import sys
import time
from dataclasses import replace
from datetime import UTC, datetime, timedelta, timezone
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from benchmarks.small_records import small_record
from msgspec import structs
from tests.entering import put_in

from lightpen.errors import FileError
from lightpen.estimation.reports.calibration_record import SpotRecord
from lightpen.estimation.reports.verdict import Grade
from lightpen.formats.own_json import with_checksum
from lightpen.record.library.signing import OwedFile, owe, station_name
from lightpen.record.results.result_folder import FolderArchive
from lightpen.record.results.results import CALIBRATION, END, Result
from lightpen.record.swings.header import Names

N_RIVALS, N_RIVAL_RESULTS = 4, 10
RIVAL = """
import pickle, sys
from pathlib import Path
from lightpen.record.results.result_folder import FolderArchive

archive = FolderArchive(Path(sys.argv[1]))
results = pickle.loads(Path(sys.argv[2]).read_bytes())
print("ready", flush=True)
sys.stdin.readline()
for result in results:
    archive.store(result)
"""
NAMES = Names("Halle 3", "Jörg", "LP-04", "T-10", "C-1", 3.0005)
NOON = datetime(2026, 1, 2, 12, tzinfo=UTC)


def result(
    x: float = 1 / 3,
    names: Names = NAMES,
    accepted: datetime = NOON,
    record: Path = Path("records", "1"),
) -> Result:
    return Result(
        names=names,
        accepted=accepted,
        grade=Grade.PASS,
        record=record,
        images=(1, 2, 4),
        calibration=small_record(
            {
                "tip_pen_mm": [x / 3, -30.0, -25 / 3],
                "expanded_uncertainty_mm": [0.001, 0.004 / 3, 0.005 / 3],
                "cone_cam_mm": [x, 200.0, 1000.0],
                "covariance": (np.eye(6) / 3e6).tolist(),
                "warnings": [{"code": "oil", "text": "Ölig: 5 µm.", "values": {}}],
            }
        ),
    )


def entries_of(file: Path) -> dict[str, Any]:
    """Return the entries of a result but its checksums."""
    entries: dict[str, Any] = json.loads(file.read_bytes())
    return {
        name: entry
        for name, entry in entries.items()
        if name not in ("checksum", "calibration_sha256")
    }


def rewrite(file: Path, entries: dict[str, Any]) -> None:
    """Write a result with other entries, and sound checksums."""
    head = entries_of(file) | entries
    rest = CALIBRATION + json.dumps(head.pop("calibration")).encode() + END
    head["calibration_sha256"] = sha256(rest).hexdigest()
    sealed = with_checksum(json.dumps(head).encode())
    put_in(file.parents[1], file, sealed.removesuffix(b"}") + rest)


def with_flipped_bit(content: bytes, bit: int) -> bytes:
    return (
        content[: bit // 8]
        + bytes([content[bit // 8] ^ 1 << bit % 8])
        + content[bit // 8 + 1 :]
    )


@pytest.fixture
def archive(tmp_path: Path) -> FolderArchive:
    return FolderArchive(tmp_path / "data")


def files_of(archive: FolderArchive) -> list[Path]:
    return sorted(archive.folder.glob("*.json"))


def in_force(archive: FolderArchive, pen: str = "LP-04", tip: str = "T-10") -> Result:
    found = archive.in_force(pen, tip)
    assert found is not None
    return found


def x_in_force(archive: FolderArchive, pen: str = "LP-04", tip: str = "T-10") -> float:
    return float(in_force(archive, pen, tip).tip_pen[0])


def test_a_result_is_read_back_to_the_last_digit(archive: FolderArchive) -> None:
    given = result(accepted=datetime.now(timezone(timedelta(hours=8))))
    archive.store(given)

    found = in_force(archive)

    assert (found.names, found.accepted, found.grade, found.images) == (
        *(NAMES, given.accepted, "pass", (1, 2, 4)),
    )
    assert found.calibration == given.calibration
    np.testing.assert_array_equal(found.tip_pen, given.tip_pen)
    np.testing.assert_array_equal(found.uncertainty, given.uncertainty)


def test_at_first_none_is_in_force(archive: FolderArchive) -> None:
    assert archive.in_force("LP-04", "T-10") is None
    assert archive.of_record(Path("records", "1")) is None


def test_each_pen_and_tip_has_its_own_in_force(archive: FolderArchive) -> None:
    archive.store(result(3.0))
    archive.store(result(6.0, replace(NAMES, tip="T-11")))
    archive.store(result(9.0, replace(NAMES, pen="LP-05")))

    assert x_in_force(archive) == 1.0
    assert x_in_force(archive, tip="T-11") == 2.0
    assert x_in_force(archive, pen="LP-05") == 3.0
    assert archive.in_force("LP-05", "T-11") is None


def test_the_last_accepted_is_in_force(archive: FolderArchive) -> None:
    for day in range(12):
        archive.store(result(3.0 * day, accepted=NOON + timedelta(day)))

    assert x_in_force(archive) == 11.0


def test_a_clock_that_was_set_back_does_not_keep_the_old_tip_in_force(
    archive: FolderArchive,
) -> None:
    archive.store(result(3.0, accepted=NOON))
    archive.store(result(6.0, accepted=NOON - timedelta(days=9000)))

    assert x_in_force(archive) == 2.0


def test_nothing_is_overwritten_even_at_the_same_instant(
    archive: FolderArchive,
) -> None:
    for n in range(5):
        archive.store(result(3.0 * n))

    assert [file.name for file in files_of(archive)] == [
        f"{n:06d}.json" for n in range(1, 6)
    ]
    tips = [
        json.loads(file.read_bytes())["calibration"]["tip_pen_mm"][0]
        for file in files_of(archive)
    ]
    assert tips == [0.0, 1.0, 2.0, 3.0, 4.0]
    assert x_in_force(archive) == 4.0


@pytest.mark.slow
def test_programs_that_accept_at_once_take_one_number_each(
    archive: FolderArchive, tmp_path_factory: pytest.TempPathFactory
) -> None:
    stored = tmp_path_factory.mktemp("stored") / "results.pickle"
    results = [result(3.0 * n) for n in range(N_RIVAL_RESULTS)]
    stored.write_bytes(pickle.dumps(results))
    words = [sys.executable, "-c", RIVAL, str(archive.folder.parent), str(stored)]
    rivals = [
        subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        for _ in range(N_RIVALS)
    ]
    for rival in rivals:  # all of them wait, then all of them start
        assert rival.stdout is not None
        assert rival.stdout.readline().rstrip() == b"ready"
    for rival in rivals:
        assert rival.stdin is not None
        rival.stdin.write(b"go\n")
        rival.stdin.flush()
    for rival in rivals:
        rival.communicate()
        assert rival.returncode == 0

    n_results = N_RIVALS * N_RIVAL_RESULTS
    assert sorted(file.name for file in archive.folder.iterdir()) == [
        f"{n:06d}.json" for n in range(1, n_results + 1)
    ]


@pytest.mark.parametrize(
    "name",
    ["a/b\\c", "王 Ä", "w" * 200, "..", "T 10 ", "\udce4", "\x00\n", "T" * 20_000],
)
def test_any_name_will_do(archive: FolderArchive, name: str) -> None:
    names = replace(NAMES, pen=name, tip=name)
    archive.store(result(6.0, names))

    assert x_in_force(archive, name, name) == 2.0


# Damage


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
        b'{"format": "two"}',
    ],
)
def test_a_damaged_result_is_reported_and_not_passed_over(
    archive: FolderArchive, content: bytes
) -> None:
    """An older tip must not come into force again in silence."""
    archive.store(result())
    archive.store(result(accepted=NOON + timedelta(1)))
    file = files_of(archive)[1]
    file.write_bytes(content)

    with pytest.raises(FileError, match="000002") as caught:
        archive.in_force("LP-04", "T-10")
    assert str(file) in str(caught.value)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("accepted", "yesterday"),
        ("accepted", "2026-01-02T12:00:00"),
        ("names", {"ball_diameter": "wide"}),
        ("images", 5),
        ("calibration", []),
        ("format", None),
    ],
)
def test_an_entry_that_makes_no_sense_is_damage(
    archive: FolderArchive, key: str, value: object
) -> None:
    archive.store(result())
    (file,) = files_of(archive)
    rewrite(file, {key: value})

    with pytest.raises(FileError, match="is damaged"):
        archive.in_force("LP-04", "T-10")


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("tip_pen_mm", [1.0, 2.0]),
        ("tip_pen_mm", [1.0, 2.0, float("nan")]),
        ("expanded_uncertainty_mm", [1.0, 2.0, float("inf")]),
        ("cone_cam_mm", None),
        ("covariance", [1.0, 2.0, 3.0]),
    ],
)
def test_a_tip_that_makes_no_sense_is_damage(
    archive: FolderArchive, key: str, value: object
) -> None:
    archive.store(result())
    (file,) = files_of(archive)
    calibration = json.loads(file.read_bytes())["calibration"]
    rewrite(file, {"calibration": calibration | {key: value}})

    with pytest.raises(FileError, match="is damaged"):
        archive.in_force("LP-04", "T-10")


def test_a_result_that_could_not_be_read_again_is_not_put_in_force(
    archive: FolderArchive,
) -> None:
    archive.store(result(3.0))
    unknown = (float("nan"), 1.0, 2.0)
    bad = structs.replace(result().calibration, tip_pen_mm=unknown)

    with pytest.raises((FileError, ValueError)):
        archive.store(replace(result(), calibration=bad))
    nothing: Any = (None, 1.0, 2.0)
    bad = structs.replace(bad, tip_pen_mm=nothing)
    with pytest.raises(FileError, match="damaged"):
        archive.store(replace(result(), calibration=bad))

    assert x_in_force(archive) == 1.0
    assert len(files_of(archive)) == 1


def test_a_result_that_another_program_wrote_anew_is_reported(
    archive: FolderArchive,
) -> None:
    """Nobody can tell that from damage."""
    archive.store(result(3.0))
    (file,) = files_of(archive)
    file.write_text(json.dumps(json.loads(file.read_bytes())))

    with pytest.raises(FileError, match=r"000001\.json was changed"):
        archive.in_force("LP-04", "T-10")


@pytest.mark.parametrize("entry", ["checksum", "calibration_sha256"])
def test_a_result_without_a_checksum_it_should_have_is_reported(
    archive: FolderArchive, entry: str
) -> None:
    archive.store(result(3.0))
    (file,) = files_of(archive)
    entries = json.loads(file.read_bytes())
    del entries[entry]
    file.write_text(json.dumps(entries))

    with pytest.raises(FileError, match=r"000001\.json was changed"):
        archive.in_force("LP-04", "T-10")


def test_a_result_of_a_later_version_is_refused_and_hides_none(
    archive: FolderArchive,
) -> None:
    archive.store(result(3.0, replace(NAMES, tip="T-11")))
    archive.store(result(6.0))
    archive.store(result(9.0))
    file = files_of(archive)[2]
    later = json.dumps(entries_of(file) | {"format": 5, "calibration": "elsewhere"})
    put_in(file.parents[1], file, with_checksum(later.encode()))

    with pytest.raises(FileError, match=r"later version of the program \(format 5"):
        archive.in_force("LP-04", "T-10")
    assert x_in_force(archive, tip="T-11") == 1.0


@pytest.mark.slow
def test_no_flipped_bit_puts_another_tip_in_force_and_each_is_named(
    archive: FolderArchive,
) -> None:
    archive.store(result(3.0))
    archive.store(result(6.0, accepted=NOON + timedelta(1)))
    file = files_of(archive)[1]
    content = file.read_bytes()

    passed = []
    for bit in range(0, 8 * len(content), 11):
        file.write_bytes(with_flipped_bit(content, bit))
        try:
            archive.in_force("LP-04", "T-10")
        except FileError as error:
            assert str(file) in str(error)  # noqa: PT017 - thousands of them
        else:
            passed.append(bit)

    assert passed == []


def test_a_ball_diameter_that_is_not_known_is_stored_as_none(
    archive: FolderArchive,
) -> None:
    archive.store(replace(result(), names=replace(NAMES, ball_diameter=None)))

    (file,) = files_of(archive)
    assert json.loads(file.read_bytes())["names"]["ball_diameter"] is None
    assert in_force(archive).names.ball_diameter is None


def test_a_damaged_result_that_is_older_does_not_matter(archive: FolderArchive) -> None:
    archive.store(result())
    files_of(archive)[0].write_bytes(b"{")
    archive.store(result(6.0))

    assert x_in_force(archive) == 2.0


def test_other_files_in_the_folder_are_left_alone(archive: FolderArchive) -> None:
    archive.folder.mkdir(parents=True)
    (archive.folder / "notes.json").write_text("{}")
    (archive.folder / "000009_x.txt").write_text("no result")
    archive.store(result(3.0))

    assert [file.name[:7] for file in files_of(archive)] == ["000001.", "notes.j"]
    assert x_in_force(archive) == 1.0


# Where the swing is recorded


def record_in(data: Path, name: str = "swing") -> Path:
    folder = data / "records" / name
    folder.mkdir(parents=True)
    return folder


def test_the_record_is_found_after_the_data_folder_has_moved(tmp_path: Path) -> None:
    folder = record_in(tmp_path / "data")
    FolderArchive(tmp_path / "data").store(result(record=folder))
    (file,) = (tmp_path / "data" / "results").iterdir()
    (tmp_path / "elsewhere").mkdir()

    shutil.move(tmp_path / "data", tmp_path / "elsewhere" / "moved")

    moved = FolderArchive(tmp_path / "elsewhere" / "moved")
    there = tmp_path / "elsewhere" / "moved" / "records" / "swing"
    assert in_force(moved).record == there
    assert moved.of_record(there) is not None
    text = (moved.folder / file.name).read_text()
    assert json.loads(text)["record"] == "records/swing"
    assert str(tmp_path) not in text


def test_a_record_outside_the_data_folder_is_named_by_its_whole_path(
    archive: FolderArchive, tmp_path: Path
) -> None:
    folder = record_in(tmp_path / "another disk")
    archive.store(result(record=folder))

    assert in_force(archive).record == folder
    (file,) = files_of(archive)
    assert json.loads(file.read_bytes())["record"] == folder.as_posix()


def test_a_data_folder_named_from_the_current_one_is_the_same(
    archive: FolderArchive, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    FolderArchive(Path("data")).store(result(record=Path("data", "records", "swing")))
    monkeypatch.chdir("/")

    assert in_force(archive).record == tmp_path / "data" / "records" / "swing"


def test_the_result_of_a_record_is_the_last_one_that_can_be_read(
    archive: FolderArchive, tmp_path: Path
) -> None:
    one, other = (record_in(tmp_path / "data", name) for name in ("1", "2"))
    for x, record in ((3.0, one), (6.0, one), (9.0, other), (12.0, one), (15.0, one)):
        archive.store(result(x, record=record))
    files_of(archive)[3].write_bytes(b"{")
    files_of(archive)[4].write_bytes(b'{"record": "\\u0000"}')

    found = archive.of_record(one)

    assert found is not None
    assert found.tip_pen[0] == 2.0


# The disk


@pytest.mark.slow
def test_a_thousand_results_of_other_pens_cost_little(archive: FolderArchive) -> None:
    """Only their first entries are read; one of 300 images has 1 MB."""
    seen = SpotRecord(1, 0.5, 0.5, 0.5, True, True)
    (frame, _) = result().calibration.frames
    many = 300 * (structs.replace(frame, leds=40 * (seen,)),)
    calibration = structs.replace(result().calibration, frames=many)
    whole = replace(result(), calibration=calibration)
    archive.store(whole)
    archive.store(replace(whole, names=replace(NAMES, pen="LP-05")))
    content = files_of(archive)[1].read_bytes()
    data, digest = archive.folder.parent, sha256(content).hexdigest()
    for number in range(3, 1001):
        file = archive.folder / f"{number:06d}.json"
        owe(station_name(data), OwedFile(f"{file.parent.name}/{file.name}", digest))
        file.write_bytes(content)

    start = time.process_time()
    found = in_force(archive)
    middle = time.process_time()
    for _ in range(100):
        json.loads(content)
    end = time.process_time()

    assert len(found.calibration.frames) == 300
    assert middle - start < end - middle  # they were not read whole


def test_a_folder_that_cannot_be_made_is_reported(tmp_path: Path) -> None:
    (tmp_path / "data").write_text("no folder")

    with pytest.raises(FileError, match="cannot be created"):
        FolderArchive(tmp_path / "data").store(result())


def test_the_file_of_a_result_is_found_among_others_while_it_is_there(
    tmp_path: Path,
) -> None:
    archive = FolderArchive(tmp_path)
    swing, later = tmp_path / "records" / "1", NOON + timedelta(hours=1)
    first, second = result(record=swing), result(record=swing, accepted=later)
    for each in (first, second, result(record=swing.with_name("2"))):
        archive.store(each)

    files = [archive.file_of(each) for each in (first, second)]

    assert [file.name for file in files] == ["000001.json", "000002.json"]
    files[0].unlink()
    with pytest.raises(FileError, match=r"T-10.*is missing in"):
        archive.file_of(first)
