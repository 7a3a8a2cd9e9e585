"""A pen over its accepted swings, and a better LED file by them."""

from collections.abc import Callable, Collection
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from itertools import count
from pathlib import Path

from lightpen.comparisons.led_file import ImprovedPen, improve_pen
from lightpen.comparisons.pen_health import MIN_SWINGS, PenHealth, examine_pen
from lightpen.errors import FileError, UsageError
from lightpen.formats.camera_file_writing import write_camera
from lightpen.formats.hashes import hashed
from lightpen.formats.pen_files import write_pen
from lightpen.model.origin import Origin
from lightpen.model.pen import Pen
from lightpen.record.calibrations.calibrations import CalibrationFile, read_calibration
from lightpen.record.library.numbered_files import make_folder
from lightpen.record.results.result_folder import SIMULATED, FolderArchive
from lightpen.record.swings.names import Names, folder_name
from lightpen.swing.preparation import Preparation

LED_FILES = "led files"  # a folder of the data folder
MOST = 20  # swings, the newest
MOST_POOLED = 8  # more add little, and each is solved again

Tell = Callable[[float], None]


@dataclass(frozen=True, eq=False)
class PenOverTime:
    """A pen over its accepted swings with the LED file that is chosen."""

    names: Names
    is_simulated: bool
    pen: Pen
    pen_sha256: str
    swings: tuple[CalibrationFile, ...]  # the oldest first
    n_left_out: int  # with another LED file, or unreadable
    health: PenHealth | None  # None of fewer than two swings


@dataclass(frozen=True, eq=False)
class NewLedFile:
    """An improved LED file, the camera file of the same swings, and their content."""

    path: Path
    camera_path: Path
    improved: ImprovedPen


def read_pen_over_time(
    archive: FolderArchive, preparation: Preparation, report: Tell = lambda _: None
) -> PenOverTime:
    """Read the accepted swings of the pen that is chosen."""
    pen_file, camera_file = preparation.pen_file, preparation.camera_file
    if pen_file is None:
        raise ValueError("`pen_file` must be chosen.")
    pen_sha256 = hashed(pen_file.path).sha256
    is_simulated = preparation.origin is Origin.SIMULATED
    names = preparation.names
    files = archive.files_of_pen(names.pen, is_simulated=is_simulated)[:MOST]
    found: list[CalibrationFile] = []
    for n, file in enumerate(files, start=1):
        with suppress(FileError, UsageError):  # reported by whoever reads the archive
            swing = read_calibration(file)
            if swing.pen_sha256 == pen_sha256:
                found.append(swing)
        report(n / len(files))
    swings = tuple(sorted(found, key=lambda swing: swing.when))
    camera = None if camera_file is None else camera_file.camera
    return PenOverTime(
        names=names,
        is_simulated=is_simulated,
        pen=pen_file.pen,
        pen_sha256=pen_sha256,
        swings=swings,
        n_left_out=len(files) - len(swings),
        health=(
            examine_pen(swings, camera, pen_file.pen.leds)
            if len(swings) >= MIN_SWINGS
            else None
        ),
    )


def adjust_together(
    archive: FolderArchive,
    preparation: Preparation,
    chosen: Collection[Path],
    now: datetime,
    report: Tell = lambda _: None,
) -> NewLedFile:
    """Write LED file and camera file by the accepted swings with the chosen results.

    Results with other files take no part; see `led_file.improve_pen`. The old file
    stays, and no file is replaced.
    """
    pen = read_pen_over_time(archive, preparation)
    if preparation.camera_file is None:
        raise ValueError("The camera of the swings must be chosen.")
    camera_sha256 = hashed(preparation.camera_file.path).sha256
    swings = [
        swing
        for swing in pen.swings
        if swing.path in chosen
        and swing.camera_sha256 == camera_sha256
        and not swing.is_of_rig
    ]
    camera = preparation.camera_file.camera
    improved = improve_pen(
        swings[-MOST_POOLED:], camera, pen.pen, report=report, must_gain=False
    )
    data = archive.folder
    folder = (data / SIMULATED if pen.is_simulated else data) / LED_FILES
    make_folder(folder)
    stem = folder_name(Names(pen=pen.names.pen), now)
    names = (f"{stem}{'' if n == 1 else f'-{n}'}.json" for n in count(1))
    path = next(folder / name for name in names if not (folder / name).exists())
    write_pen(improved.pen, path, pen.pen_sha256)
    camera_path = path.with_suffix(".yaml")
    write_camera(improved.camera, camera_path)
    return NewLedFile(path, camera_path, improved)
