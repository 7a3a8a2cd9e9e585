"""A calibration read back from its file: what `lightpen calibrate` wrote, or a result.

Both hold the same record of the calibration, and tell when they were changed since.
"""

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from msgspec import Meta, Struct

from lightpen.arrays import BoolArray, FloatArray
from lightpen.errors import FileError, UsageError
from lightpen.formats.files import MEGABYTE, printable, read_bytes
from lightpen.formats.own_json import (
    DamagedError,
    Digest,
    Length,
    Moment,
    Vector,
    has_checksum,
    in_shape,
    parse_own_json,
)
from lightpen.model.assumptions import USUAL, Assumptions
from lightpen.record.results import Row, has_head, parse_result
from lightpen.sentences import sentence

WHAT = sentence("file.calibration", "calibration")
LIMIT = 64 * MEGABYTE
N_PLACE = 6  # parameters of where a camera of a rig stands


class _File(Struct):
    file: str
    sha256: Digest


class _Inputs(Struct):
    camera: _File
    pen: _File
    rig: _File | None = None
    cameras: tuple[_File, ...] = ()


class _OtherCamera(Struct):
    intrinsics: list[float]
    cam_from_rig_rotation: tuple[Vector, Vector, Vector]
    cam_from_rig_translation_mm: Vector


class _Instrument(Struct):
    intrinsics: list[float]
    disc_diameter_mm: Annotated[float, Meta(gt=0, le=1000)]
    leds_mm: list[Vector]
    covariance: list[list[float]]
    other_cameras: tuple[_OtherCamera, ...] = ()


class _Led(Struct):
    led: int
    seen: int
    used: int
    displacement_mm: tuple[float | None, float | None, float | None]


class _SeenLed(Struct):
    led: Annotated[int, Meta(ge=1)]
    x_px: Length
    y_px: Length
    area_px2: Length | None = None


class _Frame(Struct):
    file: str
    used: bool
    leds: list[_SeenLed]
    edge_width_px: Length | None = None
    lamps_px: list[tuple[Length | None, Length | None]] = []


class _Record(Struct):
    created: Moment
    method: str
    tip_pen_mm: Vector
    cone_cam_mm: Vector
    covariance: tuple[Row, Row, Row, Row, Row, Row]
    expanded_uncertainty_mm: Vector
    sigma_px: Annotated[float, Meta(ge=0)]
    inputs: _Inputs
    leds: list[_Led]
    frames: list[_Frame]
    nominal_tip_mm: Vector | None = None
    assumptions: dict[str, float | None] = {}
    instrument: _Instrument | None = None
    rig: Any = None


@dataclass(frozen=True, eq=False)
class FittedCamera:
    """A camera of a rig but the first, as a swing left it.

    Attributes
    ----------
    intrinsics : (k,) array
    rotation, translation : (3, 3) and (3,) array
        Of cam_from_rig, mm.
    """

    intrinsics: FloatArray
    rotation: FloatArray
    translation: FloatArray


@dataclass(frozen=True, eq=False)
class FittedInstrument:
    """What a swing left to measure with; see `lightpen.estimation.instrument`.

    Attributes
    ----------
    intrinsics : (k,) array
        ``fx fy cx cy`` and the distortion coefficients.
    leds : (L, 3) array
        mm.
    covariance : (q, q) array
        Of tip, cameras, diameter and LEDs.
    others : tuple of FittedCamera
        The other cameras of a rig.
    """

    intrinsics: FloatArray
    diameter: float
    leds: FloatArray
    covariance: FloatArray
    others: tuple[FittedCamera, ...] = ()


@dataclass(frozen=True, eq=False)
class CalibrationFile:
    """A calibration as its file has it.

    Attributes
    ----------
    pen, tip : str
        Names of a result; empty of a record that nobody accepted.
    grade : str
        Likewise of the verdict with which it was accepted.
    when : datetime
        When it was accepted, or made.
    method : str
        Which estimator the tip is by.
    tip_pen, cone_cam : (3,) array
        mm.
    covariance : (6, 6) array
        Of both, mm^2.
    uncertainty : (3,) array
        U (k = 2) of the tip, mm.
    sigma : float
        Noise of one image coordinate, px.
    nominal_tip : (3,) array or None
        mm.
    assumptions : Assumptions
        What stood in for what the files do not state.
    camera_sha256, pen_sha256 : str
        Of the files that it was made with.
    seen_by : tuple of str
        SHA-256 of the camera file, or of a rig file and those of all its cameras.
    pen_file : str
        Name of the pen file.
    displacements : (L, 3) array
        How far each LED sits off its place in the pen file, mm; NaN if not known.
    instrument : FittedInstrument or None
        None of a version that did not keep it.
    frames : tuple of str
        Names of all images.
    used : (N,) array of bool
    pixels : (N, L, 2) array
        LED centres in the images, px; NaN where not seen.
    areas : (N, L) array
        Of the LEDs in the images, px^2; NaN where not known.
    edge_widths : (N,) array
        Of the rims of the LEDs in each image, px; NaN where not known.
    lamps : (N, K, 2) array
        Fixed lamps in each image, px; NaN where not seen.
    is_of_rig : bool
        Whether several cameras looked; the frames are then of all of them.
    has_checksum : bool
        Whether a change of the file would have been noticed.
    """

    path: Path
    pen: str
    tip: str
    grade: str
    when: datetime
    method: str
    tip_pen: FloatArray
    cone_cam: FloatArray
    covariance: FloatArray
    uncertainty: FloatArray
    sigma: float
    nominal_tip: FloatArray | None
    assumptions: Assumptions
    camera_sha256: str
    pen_sha256: str
    seen_by: tuple[str, ...]
    pen_file: str
    displacements: FloatArray
    instrument: FittedInstrument | None
    frames: tuple[str, ...]
    used: BoolArray
    pixels: FloatArray
    areas: FloatArray
    edge_widths: FloatArray
    lamps: FloatArray
    is_of_rig: bool
    has_checksum: bool

    @property
    def n_leds(self) -> int:
        """Number of LEDs of the pen."""
        return len(self.displacements)


def read_calibration(path: Path) -> CalibrationFile:
    """Read a calibration.

    Raises
    ------
    FileError
        It cannot be read, or is not as it was written.
    """
    data = read_bytes(path, WHAT, LIMIT)
    if has_head(data):
        result = parse_result(data, path, Path)
        read = _calibration(path, result.calibration, is_checked=True)
        return replace(
            read,
            pen=result.names.pen,
            tip=result.names.tip,
            grade=result.grade,
            when=result.accepted,
        )
    tree, is_checked = record_tree(data, path)
    return _calibration(path, tree, is_checked=is_checked)


def read_record(path: Path) -> Mapping[str, Any]:
    """Read the record of a calibration as it was written.

    Raises
    ------
    FileError
        It cannot be read, or is not as it was written.
    """
    data = read_bytes(path, WHAT, LIMIT)
    if has_head(data):
        return parse_result(data, path, Path).calibration
    return record_tree(data, path)[0]


def record_tree(data: bytes, path: Path) -> tuple[dict[str, Any], bool]:
    """Return the record in a file, and whether a change would have been noticed.

    Parameters
    ----------
    path : Path
        For the sentence.

    Raises
    ------
    FileError
        It is not as it was written.
    UsageError
        It is no record.
    """
    try:
        is_checked = has_checksum(data)
    except DamagedError as error:
        raise _changed(path) from error
    try:
        return parse_own_json(data, dict[str, Any]), is_checked
    except DamagedError as error:
        raise _changed(path) if is_checked else _other(path) from error


def _calibration(path: Path, tree: Any, *, is_checked: bool) -> CalibrationFile:
    try:
        record = in_shape(tree, _Record)
        instrument = _instrument(record)
        seen, lamps = _seen(record), _lamps(record)
        assumed = _assumed(record)
    except DamagedError as error:
        raise _other(path) from error
    return CalibrationFile(
        path=path,
        pen="",
        tip="",
        grade="",
        when=record.created,
        method=record.method,
        tip_pen=np.array(record.tip_pen_mm),
        cone_cam=np.array(record.cone_cam_mm),
        covariance=np.array(record.covariance),
        uncertainty=np.array(record.expanded_uncertainty_mm),
        sigma=record.sigma_px,
        nominal_tip=(
            None if record.nominal_tip_mm is None else np.array(record.nominal_tip_mm)
        ),
        assumptions=assumed,
        camera_sha256=record.inputs.camera.sha256,
        pen_sha256=record.inputs.pen.sha256,
        seen_by=_seen_by(record.inputs),
        pen_file=record.inputs.pen.file,
        displacements=np.array(
            [each.displacement_mm for each in record.leds], dtype=np.float64
        ).reshape(-1, 3),
        instrument=instrument,
        frames=tuple(frame.file for frame in record.frames),
        used=np.array([frame.used for frame in record.frames], dtype=bool),
        pixels=seen[..., :2],
        areas=seen[..., 2],
        edge_widths=np.array(
            [f.edge_width_px for f in record.frames], dtype=np.float64
        ),
        lamps=lamps,
        is_of_rig=record.rig is not None,
        has_checksum=is_checked,
    )


def _instrument(record: _Record) -> FittedInstrument | None:
    entry = record.instrument
    if entry is None:
        return None
    n_leds, others = len(entry.leds_mm), entry.other_cameras
    n_parameters = 4 + len(entry.intrinsics) + 3 * n_leds
    n_parameters += sum(N_PLACE + len(other.intrinsics) for other in others)
    if (n_leds, len(entry.covariance)) != (len(record.leds), n_parameters) or any(
        len(row) != n_parameters for row in entry.covariance
    ):
        raise DamagedError("The covariance is of another instrument.")
    return FittedInstrument(
        intrinsics=np.array(entry.intrinsics),
        diameter=entry.disc_diameter_mm,
        leds=np.array(entry.leds_mm),
        covariance=np.array(entry.covariance),
        others=tuple(
            FittedCamera(
                np.array(other.intrinsics),
                np.array(other.cam_from_rig_rotation),
                np.array(other.cam_from_rig_translation_mm),
            )
            for other in others
        ),
    )


def _seen_by(inputs: _Inputs) -> tuple[str, ...]:
    if inputs.rig is None:
        return (inputs.camera.sha256,)
    return (inputs.rig.sha256, *(each.sha256 for each in inputs.cameras))


def _seen(record: _Record) -> FloatArray:
    """Return x, y and area of the LEDs in the images, (N, L, 3), px and px^2."""
    seen = np.full((len(record.frames), len(record.leds), 3), np.nan)
    for i, frame in enumerate(record.frames):
        for led in frame.leds:
            if led.led > len(record.leds):
                raise DamagedError("An LED is seen that the pen does not have.")
            area = math.nan if led.area_px2 is None else led.area_px2
            seen[i, led.led - 1] = led.x_px, led.y_px, area
    return seen


def _assumed(record: _Record) -> Assumptions:
    """Return what was assumed; a version that does not say had what is usual."""
    try:
        return Assumptions(**{**asdict(USUAL), **record.assumptions})
    except (TypeError, ValueError) as error:
        raise DamagedError("The assumptions make no sense.") from error


def _lamps(record: _Record) -> FloatArray:
    """Return where images show fixed lamps, (N, K, 2), px."""
    if record.rig is not None:  # each camera has its own, and none is solved again
        return np.zeros((len(record.frames), 0, 2))
    if len({len(frame.lamps_px) for frame in record.frames}) > 1:
        raise DamagedError("Images show different numbers of fixed lamps.")
    lamps = np.array([frame.lamps_px for frame in record.frames], dtype=np.float64)
    return lamps.reshape(len(record.frames), -1, 2)


def _other(path: Path) -> UsageError:
    return UsageError(
        sentence(
            "calibration-file.other",
            "{path} is no record of a calibration. Give what the command calibrate "
            "wrote, or an accepted result.",
            path=printable(str(path)),
        )
    )


def _changed(path: Path) -> FileError:
    return FileError(
        sentence(
            "calibration-file.changed",
            "The calibration {path} is not as it was written: it was changed or "
            "damaged since. Restore it from a copy, or calibrate again.",
            path=printable(str(path)),
        )
    )
