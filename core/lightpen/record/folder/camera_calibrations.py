"""Calibrations of cameras in a data folder: a file for each, which is never changed."""

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from msgspec import Struct

from lightpen.errors import FileError
from lightpen.formats.hashes import InputFile
from lightpen.formats.json_records import ProgramName, record_bytes, record_heading
from lightpen.formats.own_json import (
    DamagedError,
    ZonedTime,
    parse_checked,
    require_usual,
)
from lightpen.messages import message
from lightpen.model.origin import Origin
from lightpen.record.folder.outcome import TrialOutcome
from lightpen.record.library.entered_files import add_numbered
from lightpen.record.swings.names import Names

CAMERA_CALIBRATIONS = "camera-calibrations"
CAMERA_CALIBRATION = message("file.camera-calibration")


@dataclass(frozen=True, eq=False)
class CameraTrial:
    """An attempt to calibrate a camera by a board."""

    outcome: TrialOutcome
    board: str
    serial: str  # empty for images from a folder
    origin: Origin | None
    images: Mapping[str, str]  # SHA-256 of file or pixels by name
    found: Mapping[str, Any] | None = None  # the result, plain; None if abandoned
    camera_file: InputFile | None = None  # None if not accepted


class StoredTrial(Struct, frozen=True):
    """Content of the file of an attempt, without the result."""

    program: ProgramName
    created: ZonedTime
    outcome: TrialOutcome
    station: str
    operator: str
    board: str
    serial: str
    origin: Origin | None = None

    def __post_init__(self) -> None:
        require_usual(self.created)


def keep_camera_trial(
    data: Path, trial: CameraTrial, names: Names, now: datetime
) -> Path:
    """Write the file of a camera calibration and return it."""
    file = trial.camera_file
    record = {
        **record_heading(now),
        "outcome": trial.outcome.value,
        "station": names.station,
        "operator": names.operator,
        "board": trial.board,
        "serial": trial.serial,
        "origin": trial.origin,
        "camera_file": None if file is None else _entry(file.path.name, file.sha256),
        "calibration": trial.found,
        "inputs": {"images": [_entry(*image) for image in trial.images.items()]},
    }
    return add_numbered(data, data / CAMERA_CALIBRATIONS, record_bytes(record))


def read_camera_trial(content: bytes, file: Path) -> StoredTrial:
    """Read the file of an attempt."""
    try:
        return parse_checked(content, StoredTrial)
    except DamagedError as error:
        raise FileError("camera-calibration.damaged", file=file) from error


def _entry(name: str, sha256: str) -> dict[str, str]:
    return {"file": name, "sha256": sha256}
