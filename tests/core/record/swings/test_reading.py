"""The record of a swing: whole after any crash, refused when damaged otherwise."""

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from datetime import UTC, datetime
from itertools import islice
from pathlib import Path
from threading import Timer

import numpy as np
import pytest
from msgspec import structs

from lightpen.arrays import Image
from lightpen.cameras.protocol import CameraInUse, CameraSettings
from lightpen.errors import FileError
from lightpen.formats.camera_files import CAMERA_FILE
from lightpen.formats.decoding import encode_png
from lightpen.formats.pen_files import PEN_FILE, write_pen
from lightpen.formats.rig_files import write_camera
from lightpen.model.names import Origin
from lightpen.record.swings.header import (
    FileCopy,
    Header,
    Names,
    RecordedCamera,
    header_copies,
)
from lightpen.record.swings.interrupted import find_unfinished
from lightpen.record.swings.reading import open_record, record_files
from lightpen.record.swings.solving import source
from lightpen.record.swings.writing import RecordWriter, note_excluded
from lightpen_extensions.simulator.swings import paper_camera, paper_pen

N_KILLS = 20
WRITER = """
import sys
from pathlib import Path
import numpy as np
from lightpen.record.swings.reading import open_record
from lightpen.record.swings.writing import RecordWriter

with RecordWriter.resume(open_record(Path(sys.argv[1]))) as writer:
    while True:
        number = writer.next_number
        image = np.random.default_rng(number).integers(0, 9, (60, 80), dtype=np.uint8)
        pixels = np.full((10, 2), number + 0.1)
        writer.append(image, pixels, np.eye(3), np.full(3, number / 3), 0.05 * number)
        print(number, flush=True)
"""


@pytest.fixture
def header(tmp_path: Path) -> Header:
    write_camera(paper_camera(), tmp_path / "station 3.YAML")
    write_pen(paper_pen(), tmp_path / "lp04.json")
    return Header(
        cameras=(
            RecordedCamera(
                FileCopy.of(tmp_path / "station 3.YAML", CAMERA_FILE),
                mask_px=((10.0, 20.0, 5.5),),
                in_use=CameraInUse("7", CameraSettings(exposure_us=3000.0)),
            ),
        ),
        pen_file=FileCopy.of(tmp_path / "lp04.json", PEN_FILE),
        created=datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC),
        program="lightpen 0.1.0",
        names=Names("Halle 3", "Jörg", "LP-04", "T-17, 3 mm", "A"),
        nominal_tip_mm=(0.1, -90.0, -25.0),
    )


def dark_image(seed: int) -> Image:
    rng = np.random.default_rng(seed)
    return rng.integers(0, 9, (60, 80), dtype=np.uint8)


def append(writer: RecordWriter, seed: int = 0) -> int:
    pixels = np.random.default_rng(seed).uniform(0, 60, (10, 2))
    pixels[3] = np.nan
    return writer.append(dark_image(seed), pixels, np.eye(3) / 3, np.ones(3) / 7, 0.1)


def recorded(folder: Path, header: Header, n_images: int) -> Path:
    with RecordWriter.create(folder, header) as writer:
        for seed in range(n_images):
            append(writer, seed)
    return folder


def test_all_that_was_recorded_is_read_back_to_the_last_digit(
    tmp_path: Path, header: Header
) -> None:
    record = open_record(recorded(tmp_path / "swing", header, 3))

    assert [image.number for image in record.images] == [1, 2, 3]
    pixels = np.random.default_rng(2).uniform(0, 60, (10, 2))
    pixels[3] = np.nan
    np.testing.assert_array_equal(record.images[2].rig_pixels[0], pixels)
    np.testing.assert_array_equal(record.images[2].rotation, np.eye(3) / 3)
    np.testing.assert_array_equal(record.images[2].translation, np.ones(3) / 7)
    for seed, load in enumerate(source(record).images[0].open()):
        np.testing.assert_array_equal(load(), dark_image(seed))
    (camera,) = header.cameras
    camera = structs.replace(camera, file=structs.replace(camera.file, data=b""))
    pen = structs.replace(header.pen_file, data=b"")
    assert record.header == structs.replace(header, cameras=(camera,), pen_file=pen)
    for name, copy in header_copies(header).items():
        assert (record.folder / name).read_bytes() == copy.data != b""


@pytest.mark.parametrize(
    ("pixel_format", "origin", "full_scale"),
    [
        ("Mono10", Origin.LIVE, 1023),
        ("Mono16", Origin.LIVE, 65535),
        ("Mono12", Origin.RECORDED, 4095),  # stated by the files
        ("Mono16", Origin.RECORDED, None),  # the container of 16 bits
    ],
)
def test_images_of_a_record_have_the_full_scale_of_their_pixel_format(
    tmp_path: Path,
    header: Header,
    pixel_format: str,
    origin: Origin,
    full_scale: int | None,
) -> None:
    used = CameraInUse("7", CameraSettings(pixel_format=pixel_format))
    (camera,) = header.cameras
    camera = structs.replace(camera, source=str(origin), in_use=used)
    header = structs.replace(header, cameras=(camera,))
    record = open_record(recorded(tmp_path / "swing", header, 1))
    assert source(record).images[0].full_scale == full_scale


def test_the_record_brings_its_own_camera_and_pen(
    tmp_path: Path, header: Header
) -> None:
    folder = recorded(tmp_path / "swing", header, 1)
    (tmp_path / "station 3.YAML").unlink()
    (tmp_path / "lp04.json").unlink()

    found = source(open_record(folder))

    assert found.camera.fx == paper_camera().fx
    np.testing.assert_array_equal(found.pen.leds, paper_pen().leds)
    np.testing.assert_array_equal(found.pen.nominal_tip, header.nominal_tip)
    np.testing.assert_array_equal(found.masks[0], header.cameras[0].mask)


@pytest.mark.slow
def test_killed_at_any_moment_it_keeps_every_acknowledged_image(
    tmp_path: Path, header: Header
) -> None:
    folder = recorded(tmp_path / "swing", header, 0)
    rng = np.random.default_rng(5)
    acknowledged: list[int] = []
    for _ in range(N_KILLS):
        command = [sys.executable, "-c", WRITER, str(folder)]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as child:
            assert child.stdout is not None
            acknowledged += map(int, islice(child.stdout, int(rng.integers(1, 5))))
            time.sleep(rng.uniform(0, 0.01))
            child.kill()
            acknowledged += map(int, child.stdout.read().split("\n")[:-1])
        record = open_record(folder)
        numbers = [image.number for image in record.images]
        assert numbers == list(range(1, len(numbers) + 1))
        assert set(acknowledged) <= set(numbers)
        # At most the image in flight was written without being acknowledged.
        assert len(numbers) - len(acknowledged) <= N_KILLS

    for image, load in zip(record.images, source(record).images[0].open(), strict=True):
        np.testing.assert_array_equal(load(), dark_image(image.number))
        np.testing.assert_array_equal(
            image.rig_pixels[0], np.full((10, 2), image.number + 0.1)
        )
    assert find_unfinished(tmp_path).interrupted[0].folder == folder


def test_a_torn_line_and_an_orphan_image_are_passed_over(
    tmp_path: Path, header: Header
) -> None:
    folder = recorded(tmp_path / "swing", header, 3)
    journal = folder / "journal.jsonl"
    whole = journal.read_bytes()
    last = whole.rindex(b"\n", 0, -1) + 1
    for end in (last + 1, last + 40, len(whole) - 1):
        journal.write_bytes(whole[:end])
        part = folder / "images" / ".0123456789abcdef.part"
        part.write_bytes(b"torn")
        os.utime(part, (0, 0))  # by its age Windows knows that it was left
        record = open_record(folder)
        assert [image.number for image in record.images] == [1, 2]

        with RecordWriter.resume(record) as writer:
            assert append(writer, 7) == 3

        images = open_record(folder).images
        assert [image.number for image in images] == [1, 2, 3]
        *_, load = source(open_record(folder)).images[0].open()
        np.testing.assert_array_equal(load(), dark_image(7))
        assert len(list((folder / "images").iterdir())) == 3


def test_zeros_after_a_power_cut_are_passed_over(
    tmp_path: Path, header: Header
) -> None:
    folder = recorded(tmp_path / "swing", header, 2)
    with (folder / "journal.jsonl").open("ab") as journal:
        journal.write(bytes(100) + b"\n")

    assert len(open_record(folder).images) == 2


def test_damage_in_the_middle_is_refused_and_located(
    tmp_path: Path, header: Header
) -> None:
    folder = recorded(tmp_path / "swing", header, 3)
    journal = folder / "journal.jsonl"
    lines = journal.read_bytes().split(b"\n")
    journal.write_bytes(b"\n".join([lines[0], lines[1][:30], *lines[2:]]))

    with pytest.raises(FileError, match=r"Line 2 of .* is damaged"):
        open_record(folder)
    assert find_unfinished(tmp_path).interrupted == ()


@pytest.mark.parametrize(
    ("number", "sentence"),
    [
        (2, r"written by a later version of the program \(format 2; this version read"),
        (0, "header.json is damaged"),
        ("new", "header.json is damaged"),
        (None, "header.json is damaged"),
    ],
)
def test_a_record_of_another_format_is_refused(
    tmp_path: Path,
    header: Header,
    rewrite_header: Callable[..., None],
    number: object,
    sentence: str,
) -> None:
    folder = recorded(tmp_path / "swing", header, 1)
    rewrite_header(folder, format=number)

    with pytest.raises(FileError, match=sentence):
        open_record(folder)


def test_no_record_is_made_by_a_header_that_was_read(
    tmp_path: Path, header: Header
) -> None:
    read = open_record(recorded(tmp_path / "swing", header, 1)).header

    with pytest.raises(ValueError, match=r"content of camera\.yaml is missing"):
        RecordWriter.create(tmp_path / "another", read)


def test_one_program_at_a_time_writes_to_a_record(
    tmp_path: Path, header: Header, holding: Callable[[Path], "subprocess.Popen[str]"]
) -> None:
    folder = recorded(tmp_path / "swing", header, 2)
    part = folder / "images" / ".0123456789abcdef.part"
    part.write_bytes(b"an image being written by the other program")
    other = holding(folder)
    part.write_bytes(b"another")
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}

    with pytest.raises(FileError, match="Another program is writing to the swing in"):
        RecordWriter.resume(open_record(folder))
    with pytest.raises(FileError, match="Another program is writing to the swing in"):
        note_excluded(folder, {1: "taken out"})
    assert len(open_record(folder).images) == 2
    for load in source(open_record(folder)).images[0].open():
        load()
    assert before == {p: p.read_bytes() for p in folder.rglob("*") if p.is_file()}

    other.kill()
    other.wait()
    os.utime(part, (0, 0))  # by its age Windows knows that it was left
    with RecordWriter.resume(open_record(folder)) as writer:
        assert append(writer) == 3
    assert set(record_files(open_record(folder))) == {
        path for path in folder.rglob("*") if path.is_file()
    }


def test_the_program_itself_writes_to_a_record_once_at_a_time(
    tmp_path: Path, header: Header
) -> None:
    with RecordWriter.create(tmp_path / "swing", header) as writer:
        append(writer)
        record = open_record(tmp_path / "swing")
        with pytest.raises(FileError, match="Another program is writing"):
            RecordWriter.resume(record)
        append(writer)
    writer.close()  # once more is no harm

    with pytest.raises(FileError, match=r"changed the swing in .* after it was loaded"):
        RecordWriter.resume(record)
    for number in (3, 4):
        with RecordWriter.resume(open_record(tmp_path / "swing")) as writer:
            assert append(writer) == number


def test_a_writer_waits_for_one_who_is_about_to_close(
    tmp_path: Path, header: Header, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("lightpen.record.swings.writing.PATIENCE", 60.0)
    folder = recorded(tmp_path / "swing", header, 1)
    first = RecordWriter.resume(open_record(folder))
    closing = Timer(0.1, first.close)
    closing.start()

    with RecordWriter.resume(open_record(folder)) as second:
        assert append(second) == 2
    closing.join()


def test_an_image_changed_later_is_not_used(tmp_path: Path, header: Header) -> None:
    folder = recorded(tmp_path / "swing", header, 2)
    (folder / "images" / "000002.png").write_bytes(encode_png(dark_image(99)))

    first, second = source(open_record(folder)).images[0].open()
    first()
    with pytest.raises(FileError, match=r"000002\.png was modified after recording"):
        second()


def test_an_image_whose_line_was_removed_lends_its_number_to_no_other(
    tmp_path: Path, header: Header
) -> None:
    folder = recorded(tmp_path / "swing", header, 3)
    journal = folder / "journal.jsonl"
    first, _, third = journal.read_bytes().splitlines(keepends=True)
    journal.write_bytes(first + third)

    with RecordWriter.resume(open_record(folder)) as writer:
        assert append(writer) == 4
    assert open_record(folder).numbers.tolist() == [1, 3, 4]


def test_a_changed_camera_copy_is_refused(tmp_path: Path, header: Header) -> None:
    folder = recorded(tmp_path / "swing", header, 1)
    (folder / "camera.yaml").write_bytes(b"other")
    with pytest.raises(
        FileError, match=r"was modified after recording \(wrong checksum\)."
    ):
        open_record(folder)


def test_a_folder_that_holds_something_is_not_written_to(
    tmp_path: Path, header: Header
) -> None:
    with pytest.raises(FileError, match="not empty"):
        RecordWriter.create(tmp_path, header)


def test_images_are_taken_out_and_put_back(tmp_path: Path, header: Header) -> None:
    with RecordWriter.create(tmp_path / "swing", header) as writer:
        for seed in range(4):
            append(writer, seed)
        writer.exclude([2, 3], "tip slipped")
        writer.set_excluded({2: "tip slipped"})

    record = open_record(tmp_path / "swing")
    assert record.numbers.tolist() == [1, 3, 4]
    assert record.excluded == {2: "tip slipped"}
    assert len(source(record).images[0].names) == 4
    assert record.next_number == 5


FULL_DISK = """
import resource, signal, sys
from pathlib import Path
import numpy as np
from lightpen.errors import FileError
from lightpen.record.swings.reading import open_record
from lightpen.record.swings.writing import RecordWriter

signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (6000, 6000))
image = np.zeros((60, 80), np.uint8)
noise = np.random.default_rng(0).integers(0, 255, (200, 200), dtype=np.uint8)
with RecordWriter.resume(open_record(Path(sys.argv[1]))) as writer:
    for shot in [image] * (0 if sys.argv[2] == "image" else 100) + [noise]:
        try:
            writer.append(shot, np.full((10, 2), 0.1), np.eye(3), np.ones(3), 0.0)
        except FileError as error:
            print(writer.next_number - 1)
            print(error)
            break
"""


@pytest.mark.skipif(sys.platform == "win32", reason="needs a limit of file sizes")
@pytest.mark.parametrize("what", ["image", "journal"])
def test_a_full_disk_is_said_and_costs_nothing_acknowledged(
    tmp_path: Path, header: Header, what: str
) -> None:
    folder = recorded(tmp_path / "swing", header, 2)
    child = subprocess.run(
        [sys.executable, "-c", FULL_DISK, str(folder), what],
        capture_output=True,
        text=True,
        check=True,
    )
    n_acknowledged, sentence = child.stdout.split("\n", 1)

    assert "cannot be written" in sentence
    record = open_record(folder)
    assert len(record.images) == int(n_acknowledged)
    for load in source(record).images[0].open():
        load()
    with RecordWriter.resume(record) as writer:  # after space was made
        assert append(writer) == len(record.images) + 1
    assert len(open_record(folder).images) == len(record.images) + 1


def test_a_write_that_fails_once_leaves_a_journal_to_go_on_with(
    tmp_path: Path, header: Header, monkeypatch: pytest.MonkeyPatch
) -> None:
    with RecordWriter.create(tmp_path / "swing", header) as writer:
        append(writer)

        def fail(descriptor: int) -> None:
            raise OSError(28, "No space left on device")

        with monkeypatch.context() as patch:
            patch.setattr("lightpen.record.swings.writing.os.fsync", fail)
            with pytest.raises(FileError, match="The disk is full"):
                writer.conclude("pass")
        assert append(writer) == 2

    record = open_record(tmp_path / "swing")
    assert record.verdict is None
    assert len(record.images) == 2


def test_a_part_of_a_line_that_a_failing_disk_left_is_written_over(
    tmp_path: Path, header: Header
) -> None:
    with RecordWriter.create(tmp_path / "swing", header) as writer:
        append(writer)
        with (tmp_path / "swing" / "journal.jsonl").open("ab") as journal:
            journal.write(b'{"kind": "ima')
        append(writer)

    assert len(open_record(tmp_path / "swing").images) == 2


@pytest.mark.skipif(sys.platform != "linux", reason="needs the names of open files")
def test_names_are_on_the_disk_before_anything_is_acknowledged(
    tmp_path: Path, header: Header, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A synced file is lost all the same where its folder was not synced."""
    synced: list[Path] = []
    fsync = os.fsync

    def watched(descriptor: int) -> None:
        synced.append(Path(f"/proc/self/fd/{descriptor}").readlink())
        fsync(descriptor)

    monkeypatch.setattr("lightpen.record.swings.writing.os.fsync", watched)
    folder = tmp_path / "swing"
    with RecordWriter.create(folder, header) as writer:
        assert synced[-2:] == [folder, tmp_path]
        append(writer)

    part, *rest = synced[-3:]
    assert (part.parent, part.suffix) == (folder / "images", ".part")
    assert rest == [folder / "images", folder / "journal.jsonl"]


def test_the_journal_is_plain_json(tmp_path: Path, header: Header) -> None:
    folder = recorded(tmp_path / "swing", header, 1)
    entries = json.loads((folder / "journal.jsonl").read_text(encoding="utf-8"))
    assert entries["number"] == 1
    assert entries["pixels"][3] is None
