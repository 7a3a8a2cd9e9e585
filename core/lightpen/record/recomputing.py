"""A calibration computed again from its record alone.

The record holds the files of camera and pen, what was assumed where they say nothing,
and the LED centres of each image with the reason why one takes no part. What the images
showed is not judged again.
"""

from base64 import b64decode
from binascii import Error as NoBase64
from collections.abc import Mapping
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Any

import numpy as np
from msgspec import Meta, Struct

from lightpen.arrays import FloatArray
from lightpen.detection.observations import Observations, leave_out, observe_centers
from lightpen.detection.reasons import Reason
from lightpen.errors import UsageError
from lightpen.estimation.calibrate import Calibration, calibrate
from lightpen.estimation.methods import METHODS
from lightpen.formats.camera_files import read_camera
from lightpen.formats.files import printable
from lightpen.formats.hashes import InputFile, Inputs
from lightpen.formats.observation_files import Centers
from lightpen.formats.own_json import (
    DamagedError,
    Digest,
    Length,
    Vector,
    in_shape,
    require_path,
)
from lightpen.formats.pen_files import read_pen
from lightpen.model.assumptions import Assumptions
from lightpen.model.camera import Camera
from lightpen.model.limits import SwingLimits
from lightpen.model.origin import Origin
from lightpen.model.pen import Pen
from lightpen.record.calibrations import read_record
from lightpen.sentences import sentence


class _NamedFile(Struct):
    file: str
    sha256: Digest

    def __post_init__(self) -> None:
        require_path(self.file)


class _KeptFile(_NamedFile):
    base64: str


class _Inputs(Struct):
    camera: _KeptFile
    pen: _KeptFile
    observations: tuple[_NamedFile, ...]
    units: str | None
    led_diameter_mm: float | None


class _SeenLed(Struct):
    led: Annotated[int, Meta(ge=1)]
    x_px: Length
    y_px: Length
    area_px2: Length | None
    fit: bool


class _Frame(Struct):
    file: str
    reason: Reason
    edge_width_px: Length | None
    leds: tuple[_SeenLed, ...]
    lamps_px: tuple[tuple[Length | None, Length | None], ...]


class _Limits(Struct):
    max_uncertainty_mm: float
    min_images: int
    min_per_field: int


class _Verdict(Struct):
    limits: _Limits


class _Record(Struct):
    method: str
    inputs: _Inputs
    frames: tuple[_Frame, ...]
    verdict: _Verdict
    origin: Origin | None
    nominal_tip_mm: Vector | None
    assumptions: Assumptions

    def __post_init__(self) -> None:
        if self.method not in METHODS:
            raise ValueError(f"{self.method} is no method.")
        if len({len(frame.lamps_px) for frame in self.frames}) > 1:
            raise ValueError("Images show different numbers of fixed lamps.")


@dataclass(frozen=True, eq=False)
class Recomputed:
    """A calibration computed again.

    Attributes
    ----------
    method : str
        Which estimator the tip of the record is by.
    limits : SwingLimits
        By which it is judged.
    """

    calibration: Calibration
    inputs: Inputs
    method: str
    limits: SwingLimits


def recompute(path: Path) -> Recomputed:
    """Calibrate again from a record as JSON, or from an accepted result.

    Raises
    ------
    UsageError
        It is of several cameras or two cones, or of a version that did not keep enough.
    FileError
        It cannot be read, or is not as it was written.
    CalibrationError
        It does not determine the tip.
    """
    tree = read_record(path)
    if tree.get("rig") is not None or tree.get("second_cone") is not None:
        raise UsageError(
            sentence(
                "recompute.more-than-one",
                "{path} is of several cameras or two cones; only the record of one "
                "camera and one cone is enough by itself. Calibrate from the images.",
                path=printable(str(path)),
            )
        )
    record, files = _content(path, tree)
    found, nominal = record.inputs, record.nominal_tip_mm
    camera, pen = _read(files, record)
    calibration = calibrate(
        camera, pen, _observations(path, record, camera, pen), record.assumptions
    )
    limits = record.verdict.limits
    return Recomputed(
        calibration,
        Inputs(
            *files,
            tuple(InputFile(Path(f.file), f.sha256) for f in found.observations),
            nominal_tip=None if nominal is None else np.array(nominal),
            origin=record.origin,
            units=found.units,
            led_diameter=found.led_diameter_mm,
        ),
        record.method,
        SwingLimits(
            max_uncertainty=limits.max_uncertainty_mm,
            min_images=limits.min_images,
            min_per_field=limits.min_per_field,
        ),
    )


def _content(
    path: Path, tree: Mapping[str, Any]
) -> tuple[_Record, tuple[InputFile, InputFile]]:
    """Return what a record holds, and its files of camera and pen."""
    try:
        record = in_shape(tree, _Record)
        return record, (_kept(record.inputs.camera), _kept(record.inputs.pen))
    except DamagedError as error:
        raise UsageError(
            sentence(
                "recompute.not-enough",
                "{path} does not hold all that the tip was computed from: it is of an "
                "earlier version of the program, or was changed. Calibrate from the "
                "images.",
                path=printable(str(path)),
            )
        ) from error


def _kept(file: _KeptFile) -> InputFile:
    try:
        content = b64decode(file.base64, validate=True)
    except NoBase64 as error:
        raise DamagedError(str(error)) from error
    if sha256(content).hexdigest() != file.sha256:
        raise DamagedError("A file is not the one that is named.")
    return InputFile(Path(Path(file.file).name), file.sha256, content)


def _read(files: tuple[InputFile, InputFile], record: _Record) -> tuple[Camera, Pen]:
    """Read the files of camera and pen, which are read from a disk as ever."""
    nominal = record.nominal_tip_mm
    with TemporaryDirectory(prefix="lightpen-record-") as folder:
        places = []
        for name, file in zip(("camera", "pen"), files, strict=True):
            place = Path(folder, name + file.path.suffix)
            place.write_bytes(file.content or b"")
            places.append(place)
        camera_file, pen_file = places
        return read_camera(camera_file), read_pen(
            *(pen_file, record.inputs.units, record.inputs.led_diameter_mm),
            None if nominal is None else np.array(nominal),
        )


def _observations(
    path: Path, record: _Record, camera: Camera, pen: Pen
) -> Observations:
    """Return what the images showed, those that took no part left out again."""
    shape = len(record.frames), pen.n_leds
    seen = np.full((*shape, 2), np.nan)
    fit, areas = np.zeros(shape, dtype=bool), np.full(shape, np.nan)
    for i, frame in enumerate(record.frames):
        for led in frame.leds:
            j = led.led - 1
            seen[i, j], fit[i, j] = (led.x_px, led.y_px), led.fit
            areas[i, j] = np.nan if led.area_px2 is None else led.area_px2
    pixels = np.where(fit[..., None], seen, np.nan)
    numbers = np.arange(1, len(record.frames) + 1)
    shown = replace(
        observe_centers(Centers(numbers, pixels, path), camera, pen),
        names=tuple(frame.file for frame in record.frames),
        seen_pixels=seen,
        areas=areas,
        lamps=_lamps(record),
        edge_widths=np.array([f.edge_width_px for f in record.frames], dtype=float),
    )
    reasons = {i: f.reason for i, f in enumerate(record.frames) if f.reason}
    return leave_out(shown, reasons)


def _lamps(record: _Record) -> FloatArray:
    """Return where images show fixed lamps, (N, K, 2), px."""
    lamps = np.array([frame.lamps_px for frame in record.frames], dtype=np.float64)
    return lamps.reshape(len(record.frames), -1, 2)
