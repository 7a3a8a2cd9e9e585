"""The data folder: verifications, camera calibrations, clean-up."""

import os
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from enum import StrEnum
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any, Final

from msgspec import Struct, field

from lightpen.errors import FileError
from lightpen.formats.files import why_unwritten
from lightpen.formats.opened_files import InputFile
from lightpen.formats.own_json import (
    DamagedError,
    ProgramName,
    StoredMessage,
    ZonedTime,
    parse_checked,
    parse_own_json,
    record_bytes,
    record_heading,
    require_usual,
)
from lightpen.formats.part_files import sweep_parts
from lightpen.messages import message
from lightpen.model.names import Origin
from lightpen.record.library.entered_files import add_numbered
from lightpen.record.results.result_folder import RECORDS, RESULTS, SIMULATED
from lightpen.record.swings.header import HEADER, Names
from lightpen.record.swings.reading import IMAGES, JOURNAL, OPENER, last_verdict
from lightpen.record.swings.writing import is_locked


class TrialOutcome(StrEnum):
    """Outcome of a verification."""

    ACCEPTED = "accepted"
    REFUSED = "refused"  # solved, but not used
    ABANDONED = "abandoned"  # before a solution


CAMERA_CALIBRATIONS = "camera-calibrations"
CAMERA_CALIBRATION = message("file.camera-calibration")


@dataclass(frozen=True, eq=False)
class CalibratedCamera:
    """A calibration of a camera by a board, whose file is in use."""

    board: str
    serial: str  # empty for images from a folder
    origin: Origin | None
    images: Mapping[str, str]  # SHA-256 of file or pixels by name
    found: Mapping[str, Any]  # the result, plain
    camera_file: InputFile


class EnteredCamera(Struct, frozen=True):
    """Content of the file of a camera calibration, without the result."""

    program: ProgramName
    created: ZonedTime
    station: str
    operator: str
    board: str
    serial: str
    origin: Origin | None = None

    def __post_init__(self) -> None:
        require_usual(self.created)


def keep_camera_calibration(
    data: Path, camera: CalibratedCamera, names: Names, now: datetime
) -> Path:
    """Write the file of a camera calibration and return it."""
    file = camera.camera_file
    record = {
        **record_heading(now),
        "station": names.station,
        "operator": names.operator,
        "board": camera.board,
        "serial": camera.serial,
        "origin": camera.origin,
        "camera_file": _entry(file.path.name, file.sha256),
        "calibration": camera.found,
        "inputs": {"images": [_entry(*image) for image in camera.images.items()]},
    }
    return add_numbered(data, data / CAMERA_CALIBRATIONS, record_bytes(record))


def read_camera_calibration(content: bytes, file: Path) -> EnteredCamera:
    """Read the file of a camera calibration."""
    try:
        return parse_checked(content, EnteredCamera)
    except DamagedError as error:
        raise FileError("camera-calibration.damaged", file=file) from error


def _entry(name: str, sha256: str) -> dict[str, str]:
    return {"file": name, "sha256": sha256}


def check_writable(data: Path) -> None:
    """Check by a temporary file that a folder can be written; create it if missing."""
    try:
        data.mkdir(parents=True, exist_ok=True)
        with TemporaryFile(dir=data) as file:
            file.write(b"\n")
            file.flush()
            os.fsync(file.fileno())
    except OSError as error:
        raise FileError(
            "data-folder.unwritable", folder=data, reason=why_unwritten(error)
        ) from error


OLDEST = 1.0  # s; longest time between creating a folder and locking its journal


def sweep_leftovers(data: Path) -> None:
    """Remove the parts of files, and folders of swings that never began.

    Files that a running program is writing are left alone, and so are all other files.
    """
    sweep_parts(data / RESULTS)
    with suppress(OSError):  # the search for interrupted swings shows it
        for folder in list((data / RECORDS).iterdir()):
            with suppress(OSError, FileError):
                _sweep_record(folder)


def _sweep_record(folder: Path) -> None:
    with suppress(FileNotFoundError):
        if last_verdict(folder) is not None:
            return
    is_fresh = time.time() - folder.stat().st_mtime < OLDEST
    sweep_parts(folder)
    sweep_parts(folder / IMAGES)
    if not is_fresh and _has_never_begun(folder):
        for path in folder.iterdir():
            path.rmdir() if path.name == IMAGES else path.unlink()
        folder.rmdir()


def _has_never_begun(folder: Path) -> bool:
    """Return whether a record was made here and was not completed."""
    names = {path.name for path in folder.iterdir()}
    others = {name for name in names if not name.startswith(("camera.", "pen."))}
    if HEADER in names or not others <= {JOURNAL, IMAGES, OPENER}:
        return False
    if IMAGES in names and any((folder / IMAGES).iterdir()):
        return False
    journal = folder / JOURNAL
    return JOURNAL not in names or not (journal.stat().st_size or is_locked(journal))


VERIFICATIONS = "verifications"
TOUCHES = "touches"  # in that folder: the images of live points, session by session
VERIFIED = "verified"  # key of the task in the settings of an entry
MEASURED_PART: Final = "part"  # kind of the task that measures a part
BALL_CENTRE = "ball centre"  # of a measured feature: no surface was touched


class _Verdict(StoredMessage, frozen=True, kw_only=True):
    grade: str
    limits_mm: dict[str, float] = field(default_factory=dict)


class StoredImages(Struct, frozen=True):
    """Folder of the images of a session."""

    folder: str
    journal_sha256: str


class _Inputs(Struct, frozen=True):
    touches: tuple[StoredImages, ...] = ()


class StoredVerification(Struct, frozen=True):
    """A verification in a data folder."""

    program: ProgramName
    created: ZonedTime
    verification: str  # kind of the task; "conclusion" for the end of the session
    station: str = ""
    operator: str = ""
    pen: str = ""
    tip: str = ""
    origin: Origin | None = None
    temperature_c: float | None = None  # of the pen; None if not measured
    humidity_percent: float | None = None  # of the room; None if not measured
    camera_serials: tuple[str, ...] = ()  # of the cameras that saw the pen
    verdict: _Verdict | None = None
    ended: TrialOutcome | None = field(name="outcome", default=None)
    inputs: _Inputs = _Inputs()

    def __post_init__(self) -> None:
        require_usual(self.created)

    @property
    def outcome(self) -> TrialOutcome:
        """Outcome of the verification."""
        if self.ended is not None:
            return self.ended
        has_passed = self.verdict is None or self.verdict.grade == "pass"
        return TrialOutcome.ACCEPTED if has_passed else TrialOutcome.REFUSED

    @property
    def why(self) -> StoredMessage | None:
        """Reason of the grade."""
        verdict = self.verdict
        if verdict is None:
            return None
        return StoredMessage(verdict.code, verdict.text, verdict.values)


class _Kind(Struct):
    verification: str = ""


def is_verification(content: bytes) -> bool:
    """Return whether a JSON file says that it is a verification."""
    try:
        return parse_own_json(content, _Kind).verification != ""
    except DamagedError:
        return False


def read_verification(content: bytes, file: Path) -> StoredVerification:
    """Read the file of a verification."""
    try:
        return parse_checked(content, StoredVerification)
    except DamagedError as error:
        raise FileError("verification.damaged", file=file) from error


def data_folder_of_verification(file: Path) -> Path | None:
    """Return the data folder that a file is a verification of; None of other files."""
    folder = file.absolute().parent
    if folder.name != VERIFICATIONS:
        return None
    return folder.parents[folder.parent.name == SIMULATED]
