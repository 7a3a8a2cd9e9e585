"""Calibration records: read back, stated, recomputed."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, fields, replace
from datetime import date, datetime
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from lightpen.arrays import BoolArray, FloatArray
from lightpen.detection.spots import EXACT_SIGMA
from lightpen.errors import FileError, UsageError
from lightpen.estimation.bundle.consistency_test import LIMIT as CONTRADICTED
from lightpen.estimation.bundle.led_quality import DISPLACED
from lightpen.estimation.contact.single_images import USUAL_SIGMA
from lightpen.estimation.reports.calibration_record import (
    CalibrationRecord,
    FrameRecord,
    VerdictLimits,
)
from lightpen.estimation.reports.verdict import (
    CHANGE_GATE,
    FAR_MOVED,
    FAR_OFF,
    HALVES_GATE,
    MANY_DROPPED,
    Grade,
)
from lightpen.formats.files import LARGEST_RECORD, read_bytes
from lightpen.formats.own_json import (
    DamagedError,
    StoredMessage,
    has_checksum,
    parse_checked,
)
from lightpen.local_time import local_time
from lightpen.messages import Message, message, printable
from lightpen.model.limits import StationLimits
from lightpen.model.names import Origin
from lightpen.record.library.entered_files import entered_files
from lightpen.record.library.supervision import read_supervision
from lightpen.record.library.tip_library import AnyItem, ItemKind, Library
from lightpen.record.results.result_folder import FolderArchive, data_folder_of
from lightpen.record.results.results import CALIBRATION, JudgedCalibration, parse_result
from lightpen.record.swings.header import Header, Names
from lightpen.record.swings.reading import open_record

SAME = 1e-6  # mm, between the certified values of library and verification


@dataclass(frozen=True)
class TracedItem:
    """An item that a result was measured with; None if it is not in the library."""

    kind: ItemKind
    id: str
    item: AnyItem | None


def traced_items(
    library: Library,
    names: Names,
    cameras: Sequence[str] = (),
    certified: Collection[float] = (),
) -> tuple[TracedItem, ...]:
    """Return pen, tip, cone, cameras and references of a result.

    The cameras are found by their serial numbers, references by the certified values,
    mm, that the result was compared with.
    """
    used = [
        (ItemKind.CAMERA, tuple(cameras)),
        *((ItemKind.PEN, (names.pen,)), (ItemKind.TIP, (names.tip,))),
        (ItemKind.CONE, (names.cone,)),
        (ItemKind.REFERENCE, tuple(_references(library, certified))),
    ]
    return tuple(
        TracedItem(kind, name, library.item(kind, name))
        for kind, ids in used
        for name in ids
        if name
    )


def certified_values(record: Mapping[str, Any]) -> tuple[float, ...]:
    """Return the certified values in the record of a verification, mm."""
    return tuple(
        each["nominal"]
        for each in record.get("characteristics", ())
        if each.get("certified_expanded_uncertainty") is not None and each["nominal"]
    )


def _references(library: Library, certified: Collection[float]) -> Iterator[str]:
    for each in library.references.values():
        value = each.certified_mm
        if value is None or each.is_retired:
            continue
        if any(abs(value - other) <= SAME for other in certified):
            yield each.id


# A calibration read back from its file: what `lightpen calibrate` wrote, or a result.
#
# Both hold the same record of the calibration, and tell when they were changed since.
# Only the file is read; the state of a running program does not matter.


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
    def camera_hashes(self) -> tuple[str, ...]:
        """SHA-256 of the camera file, or of a rig file with its camera files."""
        inputs = self.calibration.inputs
        if inputs.rig is None:
            return (inputs.camera.sha256,)
        return (inputs.rig.sha256, *(each.sha256 for each in inputs.cameras))

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
        judged = {e.name: getattr(result, e.name) for e in fields(JudgedCalibration)}
        judged["why"] = result.why or result.calibration.verdict
        return CalibrationFile(path=path, sha256=digest, swing=result.record, **judged)
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


# The rule by which a calibration is graded, in the words of ILAC-G8 and JCGM 106.
#
# It is what `lightpen.estimation.reports.verdict` does, with its numbers. No statement
# of conformity is made about the tip: what is compared with a limit is its uncertainty.
#
# References
# ----------
# .. [1] ILAC-G8:09/2019, "Guidelines on decision rules and statements of conformity",
#    section 4.2.
# .. [2] JCGM 106:2012, "The role of measurement uncertainty in conformity assessment",
#    section 8.2.


def decision_rule(limits: VerdictLimits) -> tuple[Message, ...]:
    """Return the rule, a paragraph each."""
    limit = limits.max_uncertainty_mm
    return (
        message(
            "decision-rule.uncertainty", limit=limit, far=FAR_OFF * limit, times=FAR_OFF
        ),
        message(
            "decision-rule.consistency",
            halves=HALVES_GATE,
            contradicted=CONTRADICTED,
            moved=FAR_MOVED * limit,
            sigma=USUAL_SIGMA,
            displaced=DISPLACED,
            dropped=100 * MANY_DROPPED,
            n_images=limits.min_images,
        ),
        message("decision-rule.change", gate=CHANGE_GATE),
        message("decision-rule.change-limit"),
    )


RETIRED, OVERDUE = "RETIRED", "OVERDUE"
NOT_ENTERED = "NOT ENTERED"  # in the archive


def with_status(file: CalibrationFile, now: datetime) -> CalibrationFile:
    """Return a calibration with the status of its pen and tip in the data folder."""
    data = data_folder_of(file.path)
    if data is None:
        return file
    results, names = FolderArchive(data), file.names
    library, today = results.library(), local_time(now).date()
    listed = (
        library.item(ItemKind.PEN, names.pen),
        library.item(ItemKind.TIP, names.tip),
    )
    items = [item for item in listed if item is not None]
    usual = results.supervision().limits_at(names.station, StationLimits()).due
    due = library.rule_of(names.tip, usual).due(file.calibration.created)
    found = []
    if any(item.is_retired for item in items):
        found.append(RETIRED)
    if now > due or any(item.is_overdue(today) for item in items):
        found.append(OVERDUE)
    header = _header(data, file)
    serials = () if header is None else _serials(header)
    return replace(
        file,
        measured=None if header is None else header.created,
        traced=traced_items(library, names, serials),
        library_status=tuple(found),
        due=local_time(due).date(),
    )


def _header(data: Path, file: CalibrationFile) -> Header | None:
    """Return the header of the swing of a calibration; None where it is not there."""
    if file.swing is not None:
        with suppress(FileError):
            return open_record(data / file.swing).header
    return None


def _serials(header: Header) -> tuple[str, ...]:
    """Return the serial numbers of the cameras of a swing, the first one first."""
    return tuple(each.in_use.serial for each in header.cameras if each.in_use)


def status_of(file: CalibrationFile) -> tuple[str, ...]:
    """Return the status words of a tip, empty if it is valid."""
    own = []
    if file.origin is Origin.SIMULATED:
        own.append(Origin.SIMULATED.upper())
    if file.grade is not Grade.PASS:
        own.append(file.grade.value.upper())
    if file.is_entered is False:
        own.append(NOT_ENTERED)
    return (*own, *file.library_status)
