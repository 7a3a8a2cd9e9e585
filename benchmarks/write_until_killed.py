"""Write one kind of file over and over in a process of its own, to be killed.

Usage: python benchmarks/write_until_killed.py

For each line of its input, a kind and a folder with a tab between, it forks; the child
tells its number, and then each write that it has acknowledged.
"""

import json
import os
import sys
from collections.abc import Callable
from contextlib import closing
from dataclasses import replace
from datetime import UTC, datetime
from itertools import count
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np
from benchmarks.hostile_records import IMAGE, NAMES
from msgspec import structs

from lightpen.archive.logbook import Logbook
from lightpen.formats.camera_files import CAMERA_FILE
from lightpen.formats.files import write_whole
from lightpen.formats.pen_files import PEN_FILE
from lightpen.record.results.result_folder import RECORDS, FolderArchive
from lightpen.record.results.results import Result
from lightpen.record.swings.header import FileCopy, RecordedCamera
from lightpen.record.swings.reading import RecordedImage, open_record
from lightpen.record.swings.solving import source
from lightpen.record.swings.writing import (
    RecordWriter,
    make_record_folder,
    note_excluded,
)
from lightpen_app.work.settings_store import Content, load, save

N_ROWS = 20_000  # of a JSON that takes a while to be written
EDITS = ((1, 3), (2, 4, 5))


def tell(*words: object) -> None:
    """Print a line at one stroke, so that none is left half by a kill."""
    os.write(1, (" ".join(map(str, words)) + "\n").encode())


def swing(data: Path) -> None:
    """Begin swings, and keep three images of each."""
    model = open_record(data / RECORDS / "swing")
    files = source(model)
    header = structs.replace(
        model.header,
        cameras=(RecordedCamera(FileCopy.of(files.camera_files[0], CAMERA_FILE)),),
        pen_file=FileCopy.of(files.pen_file, PEN_FILE),
    )
    for _ in count():
        folder = make_record_folder(data / RECORDS, NAMES, datetime.now(UTC))
        with RecordWriter.create(folder, header) as writer:
            for image in model.images[:3]:
                number = append(writer, image)
                tell(folder.name, number)


def append(writer: RecordWriter, image: RecordedImage) -> int:
    """Record an image again."""
    pose = np.array(image.rotation), np.array(image.translation)
    return writer.append(IMAGE, image.rig_pixels[0], *pose, image.time)


def resume(data: Path) -> None:
    """Go on with a swing, image by image."""
    folder = data / RECORDS / "swing"
    for _ in count():
        record = open_record(folder)
        image = record.images[0]
        with RecordWriter.resume(record) as writer:
            number = append(writer, image)
            tell(folder.name, number)


def take_out(data: Path) -> None:
    """Put back what is out, and take out others, in one edit."""
    for n in count():
        out = EDITS[n % 2]
        note_excluded(data / RECORDS / "swing", dict.fromkeys(out, "excluded"))
        tell(n)


def accept(data: Path) -> None:
    """Put one tip after the other in force, and enter each in the archive."""
    archive = FolderArchive(data)
    before = archive.in_force(NAMES.pen, NAMES.tip)
    assert before is not None
    start = int(before.tip_pen[0])
    with closing(Logbook(data)) as logbook:
        for n in count(start + 1):
            archive.store(_with_tip(before, float(n)))
            logbook.enter_owed()
            tell(n)


def _with_tip(result: Result, x: float) -> Result:
    moved = structs.replace(result.calibration, tip_pen_mm=(x, x, 0.0))
    return replace(result, calibration=moved)


def revoke(data: Path) -> None:
    """Put a tip in force beside one that stays, and take it back, again and again."""
    archive = FolderArchive(data)
    before = archive.in_force(NAMES.pen, NAMES.tip)
    assert before is not None
    if before.tip_pen[0] < 0:  # killed before it was taken back
        archive.revoke(before, "Ann", before.accepted)
        before = archive.in_force(NAMES.pen, NAMES.tip)
        assert before is not None
    for n in count(1):
        result = _with_tip(before, -float(n))
        archive.store(result)
        tell(-n)
        archive.revoke(result, "Ann", before.accepted)
        tell(0)


def settings(data: Path) -> None:
    """Write two settings that must agree."""
    file = data / "lightpen.json"
    content: Content = load(file).content
    for n in count(int(content["last"].get("a", 0)) + 1):
        save(file, content, {("last", "a"): n, ("last", "b"): n})
        tell(n)


def write_json(data: Path) -> None:
    """Write a record with one number in all of its rows."""
    path = data / "tip.json"
    start = json.loads(path.read_bytes())["frames"][0] if path.exists() else 0
    for n in count(start + 1):
        write_whole(path, json.dumps({"frames": [n] * N_ROWS}).encode())
        tell(n)


KINDS: dict[str, Callable[[Path], None]] = {
    "swing": swing,
    "resume": resume,
    "take out": take_out,
    "accept": accept,
    "take back": revoke,
    "settings": settings,
    "json": write_json,
}


def main() -> int:
    """Write until killed, once for each line of the input."""
    for line in sys.stdin:
        kind, folder = line.rstrip("\n").split("\t")
        child = os.fork()
        if child == 0:
            tell(os.getpid())
            KINDS[kind](Path(folder))
        os.waitpid(child, 0)
        tell("dead")
    return 0


if __name__ == "__main__":
    sys.exit(main())
