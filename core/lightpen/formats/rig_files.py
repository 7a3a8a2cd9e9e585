"""Rig files: the cameras of a rig and their poses, as JSON or YAML.

A rig file has ``cameras``, a list of which the first is the reference, and optionally a
``comment``, which is not read. Of each camera it has

============================ =========================================================
``name``                     by which the program refers to it
``intrinsics``               its camera file, from the folder of the rig file
``cam_from_rig_rotation``    9 numbers, the rotation matrix row by row, or 4, a unit
                             quaternion w x y z
``cam_from_rig_translation`` 3 numbers, mm
============================ =========================================================

A point of the reference camera's frame is in the camera's own at ``R p + t``. The
reference itself has the identity, or neither of the two entries. All other cameras or
none of them state how well that is known, by

============================ =========================================================
``extrinsics_covariance``    6 x 6, of a small rotation vector w (rad), the true
                             rotation being ``exp([w]x) R``, and of the translation
                             (mm)
``std_deviations_extrinsics``  or the 6 standard deviations of these
============================ =========================================================
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.errors import FileError, UsageError
from lightpen.formats.camera_checks import check_window
from lightpen.formats.camera_files import read_camera
from lightpen.formats.documents import parse_document
from lightpen.formats.entries import Entries, is_covariance
from lightpen.formats.files import (
    MEGABYTE,
    foreign_program,
    is_simulated,
    quoted,
    read_text,
    write_whole,
)
from lightpen.messages import message, printable
from lightpen.model.camera import Camera, LensModel
from lightpen.model.fisheye import LensField
from lightpen.model.rigid import Rig, nearest_rotation
from lightpen.model.self_calibration import MARK_DIGITS, FoundCamera

RIG_FILE = message("file.rig")
RIG_FILE_LIMIT = MEGABYTE
MAX_CAMERAS = 16
LONGEST_NAME = 40  # characters
LARGEST_TRANSLATION = 1e6  # mm
LARGEST_SIGMAS = np.repeat([1.0, 1e4], 3)  # rad and mm
ROTATION_TOLERANCE = 1e-3  # of R R^T - 1: more is no rotation in a few digits
ROUNDING_TOLERANCE = 1e-6  # of R R^T - 1: less is kept as it is
NEGATIVE = -1e-6  # least eigenvalue of a correlation matrix in a few digits

_NAME = "name"
_INTRINSICS = "intrinsics"
_ROTATION = "cam_from_rig_rotation"
_TRANSLATION = "cam_from_rig_translation"
_COVARIANCE = "extrinsics_covariance"
_DEVIATIONS = "std_deviations_extrinsics"
_UNCERTAINTIES = (_COVARIANCE, _DEVIATIONS)
_CAMERA_KEYS = (_NAME, _INTRINSICS, _ROTATION, _TRANSLATION, *_UNCERTAINTIES)


@dataclass(frozen=True, eq=False)
class RigFile:
    """A rig file that was read, and the camera file of each camera."""

    path: Path
    camera_files: tuple[Path, ...]
    rig: Rig
    is_simulated: bool = False


def read_rig(path: Path, camera_files: Sequence[Path] = ()) -> RigFile:
    """Read a rig file and the camera files it names; see the module for the layout.

    ``camera_files``, one a camera, are read in place of those that it names, as for a
    copy.
    """
    name = printable(path.name)
    text = read_text(path, RIG_FILE, RIG_FILE_LIMIT)
    if program := foreign_program(text.encode(), "rigs")[0]:
        raise FileError("rig-file.foreign", name=name, program=program)
    entries = Entries.of(parse_document(text, name), name)
    entries.refuse_others("cameras", "comment")
    listed = _listed_cameras(entries, name)
    names = _names(listed, name)
    files = tuple(camera_files) or _camera_files(listed, path)
    if len(files) != len(listed):
        n_cameras, n_files = len(listed), len(files)
        raise FileError(
            "rig-file.other-number", name=name, n_cameras=n_cameras, n_files=n_files
        )
    cameras = tuple(_read_of(name, names[c], file) for c, file in enumerate(files))
    _require_reference(listed[0], names[0], name)
    return RigFile(
        path,
        files,
        Rig(
            cameras=cameras,
            rotations=np.stack([np.eye(3), *map(_rotation, listed[1:])]),
            translations=np.stack([np.zeros(3), *map(_translation, listed[1:])]),
            covariance=_covariance(listed[1:], names[1:], name),
            names=names,
        ),
        is_simulated(path),
    )


def write_rig(rig: Rig, path: Path, camera_files: Sequence[str]) -> None:
    """Write a rig, to be read back to the last digit.

    ``camera_files`` are the names of the camera files from the folder of the rig file.
    """
    cameras: list[dict[str, Any]] = []
    for c, (name, file) in enumerate(zip(rig.names, camera_files, strict=True)):
        camera: dict[str, Any] = {_NAME: name, _INTRINSICS: file}
        if c > 0:
            camera[_ROTATION] = rig.rotations[c].tolist()
            camera[_TRANSLATION] = rig.translations[c].tolist()
            if rig.covariance is not None:
                own = slice(6 * (c - 1), 6 * c)
                camera[_COVARIANCE] = rig.covariance[own, own].tolist()
        cameras.append(camera)
    write_whole(path, json.dumps({"cameras": cameras}, indent=1).encode())


def _listed_cameras(entries: Entries, name: str) -> list[Entries]:
    listed = entries.value("cameras")
    if not isinstance(listed, list) or not 2 <= len(listed) <= MAX_CAMERAS:
        raise FileError("rig-file.no-cameras", name=name, most=MAX_CAMERAS)
    cameras = []
    for number, tree in enumerate(listed, 1):
        place = message("rig-file.camera", number=number, name=name)
        if not isinstance(tree, dict):
            raise FileError("rig-file.no-mapping", place=place)
        camera = Entries.of(tree, place)
        camera.refuse_others(*_CAMERA_KEYS)
        cameras.append(camera)
    return cameras


def _names(listed: list[Entries], name: str) -> tuple[str, ...]:
    names = tuple(printable(_text(each, _NAME))[:LONGEST_NAME] for each in listed)
    for c, each in enumerate(names):
        if each in names[:c]:
            raise FileError("rig-file.name-twice", name=name, camera=quoted(each))
    return names


def _text(entries: Entries, key: str) -> str:
    text = entries.word(key)
    if not text:
        raise FileError("rig-file.no-text", place=entries.name, key=key)
    return text


def _camera_files(listed: list[Entries], path: Path) -> tuple[Path, ...]:
    return tuple(path.parent / _text(each, _INTRINSICS) for each in listed)


def _read_of(rig_name: str, name: str, file: Path) -> Camera:
    try:
        return read_camera(file)
    except FileError as error:
        raise FileError(
            "rig-file.camera-file", name=rig_name, camera=name, fault=error.message
        ) from error


def _require_reference(entries: Entries, camera: str, name: str) -> None:
    """Refuse a first camera that does not define the rig frame."""
    turned = entries.has(_ROTATION) and not np.allclose(
        _rotation(entries), np.eye(3), rtol=0, atol=ROUNDING_TOLERANCE
    )
    if turned or (entries.has(_TRANSLATION) and np.any(_translation(entries))):
        raise FileError("rig-file.no-reference", name=name, camera=camera)
    if entries.has(*_UNCERTAINTIES):
        raise FileError(
            "rig-file.uncertain-reference",
            place=entries.name,
            key=entries.entry(*_UNCERTAINTIES)[0],
        )


def _rotation(entries: Entries) -> FloatArray:
    numbers = entries.numbers(_ROTATION)
    if len(numbers) == 4:
        return _from_quaternion(numbers, entries)
    matrix = entries.counted(9, _ROTATION).reshape(3, 3)
    deviation = np.abs(matrix @ matrix.T - np.eye(3)).max()
    if not deviation <= ROTATION_TOLERANCE or np.linalg.det(matrix) < 0:
        raise _no_rotation(entries)
    return matrix if deviation <= ROUNDING_TOLERANCE else nearest_rotation(matrix)


def _from_quaternion(numbers: FloatArray, entries: Entries) -> FloatArray:
    from scipy.spatial.transform import Rotation  # takes 0.2 s

    if not abs(np.linalg.norm(numbers) - 1) <= ROTATION_TOLERANCE:
        raise _no_rotation(entries)
    return np.asarray(Rotation.from_quat(np.roll(numbers, -1)).as_matrix())


def _no_rotation(entries: Entries) -> FileError:
    return FileError("rig-file.no-rotation", key=_ROTATION, place=entries.name)


def _translation(entries: Entries) -> FloatArray:
    translation = entries.counted(3, _TRANSLATION)
    if np.abs(translation).max() > LARGEST_TRANSLATION:
        raise FileError(
            "rig-file.far",
            key=_TRANSLATION,
            place=entries.name,
            most=LARGEST_TRANSLATION / 1000,
        )
    return translation


def _covariance(
    listed: list[Entries], names: tuple[str, ...], name: str
) -> FloatArray | None:
    stated = [each.has(*_UNCERTAINTIES) for each in listed]
    if not any(stated):
        return None
    if not all(stated):
        raise FileError(
            "rig-file.some-uncertain",
            name=name,
            one=names[stated.index(True)],
            other=names[stated.index(False)],
        )
    covariance = np.zeros((6 * len(listed), 6 * len(listed)))
    for c, each in enumerate(listed):
        own = slice(6 * c, 6 * c + 6)
        covariance[own, own] = _covariance_of(each)
    return covariance


def _covariance_of(entries: Entries) -> FloatArray:
    key, _ = entries.entry(*_UNCERTAINTIES)
    if entries.has(_DEVIATIONS):
        deviations = entries.counted(6, _DEVIATIONS)
        covariance = np.diag(deviations**2)
        is_right = bool(np.all(deviations >= 0))
    else:
        covariance = entries.counted(36, _COVARIANCE).reshape(6, 6)
        is_right = is_covariance(covariance) and _is_positive(covariance)
    if not is_right or np.any(np.diag(covariance) > LARGEST_SIGMAS**2):
        raise FileError("rig-file.covariance", key=key, place=entries.name)
    return covariance


def _is_positive(covariance: FloatArray) -> bool:
    scale = np.sqrt(np.diag(covariance))
    scale = np.where(scale > 0, scale, 1.0)
    return bool(np.linalg.eigvalsh(covariance / np.outer(scale, scale))[0] > NEGATIVE)


# Writing of the intrinsics of a camera, as YAML of OpenCV.
#
# `lightpen.formats.camera_files` describes the layout and reads it.


FISHEYE_NAME = "equidistant"  # of the model of Kannala and Brandt, in Kalibr and ROS


def write_camera(camera: Camera, path: Path) -> None:
    """Write the intrinsics of a camera as YAML of OpenCV, to the last digit.

    Raises `UsageError` unless the name ends in .yaml or .yml.
    """
    if path.suffix.lower() not in (".yaml", ".yml"):
        raise UsageError("camera-file.suffix", name=printable(path.name))
    lines = _opencv_lines(camera)
    write_whole(path, "".join(f"{line}\n" for line in lines).encode())


def write_window(
    path: Path, binning: int, roi: tuple[int, int, int, int] | None = None
) -> Path:
    """Write the camera of binned or cut images beside the file of the whole ones.

    ``roi`` is x y width height, in pixels of the file, before binning. Returns the path
    of the new file, or the given one for its own images. Raises `FileError` if these
    have no such part.
    """
    camera, name = read_camera(path), path.stem
    check_window(camera, roi, (binning, binning), printable(path.name))
    if roi is not None and roi != (0, 0, *camera.image_size):
        camera, name = camera.cropped(*roi), f"{name}-{'-'.join(map(str, roi))}"
    if binning > 1:
        camera, name = camera.binned(binning, binning), f"{name}-binned-{binning}"
    if name == path.stem:
        return path
    written = path.with_name(f"{name}.yaml")
    write_camera(camera, written)
    return written


def _opencv_lines(camera: Camera) -> list[str]:
    """Return the lines of a FileStorage of OpenCV."""
    lines = [
        "%YAML:1.0",
        "---",
        f"image_width: {camera.width}",
        f"image_height: {camera.height}",
        *_matrix_lines("camera_matrix", camera.matrix),
        *_matrix_lines("distortion_coefficients", camera.distortion[None]),
    ]
    if camera.lens is LensModel.KANNALA_BRANDT:
        lines.append(f"distortion_model: {FISHEYE_NAME}")
    return [*lines, *_further_lines(camera)]


def _further_lines(camera: Camera) -> list[str]:
    """Return the lines beside the intrinsics."""
    lines = []
    if camera.covariance is not None:
        lines += _matrix_lines("intrinsics_covariance", camera.covariance)
    if camera.calibrated_on is not None:
        lines.append(f'calibration_date: "{camera.calibrated_on.isoformat()}"')
    if camera.serial:
        lines.append(f"camera_serial: {json.dumps(camera.serial, ensure_ascii=False)}")
    if camera.temperature_c is not None:
        lines.append(f"calibration_temperature: {_decimal(camera.temperature_c)}")
    if camera.lens_field is not None:
        lines += ["lens_field:", *_field_lines(camera.lens_field)]
    if camera.found is not None:
        lines += ["found_from:", *_found_lines(camera.found)]
    return lines


def _found_lines(found: FoundCamera) -> list[str]:
    """Return the lines below ``found_from``."""
    lines = [
        *_matrix_lines("images", found.marks.round(MARK_DIGITS)),
        *_matrix_lines("intrinsics", found.intrinsics[None]),
    ]
    if found.covariance is not None:
        lines += _matrix_lines("intrinsics_covariance", found.covariance)
    return ["   " + line.replace("\n", "\n   ") for line in lines]


def _field_lines(field: LensField) -> list[str]:
    """Return the lines below ``lens_field``."""
    lines = [
        f"amplitude: {_decimal(field.amplitude)}",
        f"correlation_length: {_decimal(field.length)}",
        f"columns: {field.columns}",
        f"rows: {field.rows}",
        *_matrix_lines("values", field.values),
        *_matrix_lines("covariance", field.covariance),
    ]
    if field.intrinsics_covariance is not None:
        own = field.intrinsics_covariance
        lines += _matrix_lines("intrinsics_covariance", own)
    return ["   " + line.replace("\n", "\n   ") for line in lines]


def _matrix_lines(name: str, matrix: FloatArray) -> list[str]:
    rows = ",\n      ".join(", ".join(map(_decimal, row)) for row in matrix)
    return [
        f"{name}: !!opencv-matrix",
        f"   rows: {len(matrix)}",
        f"   cols: {matrix.shape[1]}",
        "   dt: d",
        f"   data: [ {rows} ]",
    ]


def _decimal(value: float) -> str:
    """Return the shortest round-trip text of a float in YAML 1.1."""
    text = repr(float(value))
    if "e" in text and "." not in text:
        return text.replace("e", ".0e")
    return text
