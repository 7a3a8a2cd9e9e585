"""A calibration read back from its file: what `lightpen calibrate` wrote, or a result.

Both hold the same record of the calibration, and tell when they were changed since.
Only the file is read; the state of a running program does not matter.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date, datetime
from hashlib import sha256
from pathlib import Path

import numpy as np

from lightpen.arrays import BoolArray, FloatArray
from lightpen.detection.spots import EXACT_SIGMA
from lightpen.errors import FileError, UsageError
from lightpen.estimation.reports.calibration_record import (
    CalibrationRecord,
    FrameRecord,
)
from lightpen.formats.files import LARGEST_RECORD, read_bytes
from lightpen.formats.own_json import DamagedError, has_checksum, parse_checked
from lightpen.formats.stored_messages import StoredMessage
from lightpen.messages import message, printable
from lightpen.record.calibrations.traceability import TracedItem
from lightpen.record.library.entered_files import entered_files
from lightpen.record.library.supervision import read_supervision
from lightpen.record.results.opening import data_folder_of
from lightpen.record.results.results import CALIBRATION, JudgedCalibration, parse_result

CALIBRATION_FILE = message("file.calibration")


@dataclass(frozen=True, eq=False, kw_only=True)
class CalibrationFile(JudgedCalibration):
    """A calibration read from a file; nobody may have accepted it."""

    path: Path
    sha256: str  # checksum of the whole file
    why: StoredMessage  # the verdict when it was accepted, else by itself
    swing: Path | None = None  # folder of the swing as a result names it
    measured: datetime | None = None  # start of its swing, if looked up
    library_status: tuple[str, ...] = ()  # retired, overdue, if looked up
    due: date | None = None  # next due date of the tip by its age, if looked up
    traced: tuple[TracedItem, ...] = ()  # items it was measured with, if looked up
    is_entered: bool | None = None  # in the archive; None if not looked up

    @property
    def when(self) -> datetime:
        """When it was accepted, or else computed."""
        return self.accepted or self.calibration.created

    @property
    def name(self) -> str:
        """Name of the file, fit to be shown."""
        return printable(self.path.name)

    @property
    def cone_cam(self) -> FloatArray:
        """Centre of the cone, frame of the first camera, (3,), mm."""
        return np.array(self.calibration.cone_cam_mm)

    @property
    def is_of_rig(self) -> bool:
        """Whether several cameras were used; frames then have detections of each."""
        return self.calibration.rig is not None

    @property
    def camera_hashes(self) -> tuple[str, ...]:
        """SHA-256 of the camera file, or of a rig file with its camera files."""
        inputs = self.calibration.inputs
        if inputs.rig is None:
            return (inputs.camera.sha256,)
        return (inputs.rig.sha256, *(each.sha256 for each in inputs.cameras))

    @property
    def camera_sha256(self) -> str:
        """SHA-256 of the camera file, for a rig of the first camera's."""
        return self.calibration.inputs.camera.sha256

    @property
    def pen_sha256(self) -> str:
        """SHA-256 of the pen file."""
        return self.calibration.inputs.pen.sha256

    @property
    def displacements(self) -> FloatArray:
        """Of each LED from its place in the pen file, (L, 3), mm; NaN if not known."""
        return floats([led.displacement_mm for led in self.calibration.leds])


@dataclass(frozen=True, eq=False)
class ShownImages:
    """Observations of a calibration."""

    pixels: FloatArray  # (N, L, 2), LED centres, px; NaN where not seen
    fit: BoolArray  # (N, L), which of them were fit for use
    areas: FloatArray  # (N, L), of the LEDs, px^2; NaN where not known
    sigmas: FloatArray  # (N, L), of a coordinate of each centre by detection, px
    edge_widths: FloatArray  # (N,), of the edges of the LEDs, px; NaN where not known
    lamps: FloatArray  # (N, K, 2), fixed lamps, px; NaN where not seen


def shown_images(
    record: CalibrationRecord, frames: Sequence[FrameRecord] = ()
) -> ShownImages:
    """Return the detections in all images of a record, or in those of one camera."""
    frames = frames or record.frames
    shape = len(frames), len(record.leds)
    seen, fit = np.full((*shape, 4), np.nan), np.zeros(shape, dtype=bool)
    for i, frame in enumerate(frames):
        for led in frame.leds:
            sigma = EXACT_SIGMA if led.sigma_px is None else led.sigma_px
            seen[i, led.led - 1] = floats((led.x_px, led.y_px, led.area_px2, sigma))
            fit[i, led.led - 1] = led.fit
    return ShownImages(
        pixels=seen[..., :2],
        fit=fit,
        areas=seen[..., 2],
        sigmas=seen[..., 3],
        edge_widths=floats([frame.edge_width_px for frame in frames]),
        lamps=floats([frame.lamps_px for frame in frames]).reshape(len(frames), -1, 2),
    )


def floats(numbers: object) -> FloatArray:
    """Return numbers of a record as an array, NaN where one could not be found."""
    return np.array(numbers, dtype=np.float64)


def read_calibration(path: Path) -> CalibrationFile:
    """Read a calibration, or raise `UsageError` if the file holds none.

    Raises `FileError` if it was changed, or is a result in a data folder and a
    supervisor whom it names did not approve it.
    """
    content, data = (
        read_bytes(path, CALIBRATION_FILE, LARGEST_RECORD),
        data_folder_of(path),
    )
    found = parse_calibration(content, path)
    if data is None or found.accepted is None:
        return found
    counted = entered_files(data).counted(path, content)
    if counted is not None and found.supervisor:
        counted.require_approved(read_supervision(data).key)
    return found


def parse_calibration(data: bytes, path: Path) -> CalibrationFile:
    """Return the calibration that a file holds, or raise `UsageError`."""
    digest = sha256(data).hexdigest()
    if CALIBRATION in data:
        result = parse_result(data, path, Path)
        return CalibrationFile(
            path=path,
            sha256=digest,
            calibration=result.calibration,
            grade=result.grade,
            why=result.why or result.calibration.verdict,
            doubts=result.doubts,
            origin=result.origin,
            names=result.names,
            accepted=result.accepted,
            reason=result.reason,
            change=result.change,
            swing=result.record,
            supervisor=result.supervisor,
        )
    record = _parse_record(data, path)
    verdict = record.verdict
    return CalibrationFile(
        path=path,
        sha256=digest,
        calibration=record,
        grade=verdict.grade,
        why=verdict,
        doubts=tuple(each for each in record.warnings if each.code != verdict.code),
        origin=record.origin,
    )


def _parse_record(data: bytes, path: Path) -> CalibrationRecord:
    try:
        has_checksum(data)
    except DamagedError as error:
        raise FileError("calibration-file.changed", path=path) from error
    try:
        return parse_checked(data, CalibrationRecord)
    except DamagedError as error:
        raise UsageError("calibration-file.other", path=path) from error
