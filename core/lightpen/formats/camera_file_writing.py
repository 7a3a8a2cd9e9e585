"""Writing of the intrinsics of a camera, as YAML of OpenCV or Kalibr.

`lightpen.formats.camera_files` describes the layouts and reads them.
"""

import json
from enum import StrEnum
from pathlib import Path

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.errors import UsageError
from lightpen.formats.files import write_whole
from lightpen.messages import printable
from lightpen.model.camera import Camera, LensModel
from lightpen.model.lens_field import LensField
from lightpen.model.self_calibration import MARK_DIGITS, FoundCamera

FISHEYE_NAME = "equidistant"  # of the model of Kannala and Brandt, in Kalibr and ROS


class CameraForm(StrEnum):
    """Layouts that camera files are written in."""

    OPENCV = "opencv"
    KALIBR = "kalibr"


def write_camera(
    camera: Camera, path: Path, form: CameraForm = CameraForm.OPENCV
) -> None:
    """Write the intrinsics of a camera as YAML of OpenCV or Kalibr, to the last digit.

    Raises `UsageError` unless the name ends in .yaml or .yml.
    """
    if path.suffix.lower() not in (".yaml", ".yml"):
        raise UsageError("camera-file.suffix", name=printable(path.name))
    is_kalibr = form is CameraForm.KALIBR
    name = printable(path.name)
    lines = _kalibr_lines(camera, name) if is_kalibr else _opencv_lines(camera)
    write_whole(path, "".join(f"{line}\n" for line in lines).encode())


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


def _kalibr_lines(camera: Camera, name: str) -> list[str]:
    """Return the lines of a camchain of Kalibr with one camera."""
    coefficients = camera.distortion
    if camera.lens is LensModel.BROWN:
        if np.any(coefficients[4:]):
            raise UsageError("camera-file.kalibr-coefficients", name=name)
        coefficients = coefficients[:4]
    pinhole = [camera.fx, camera.fy, camera.cx, camera.cy]
    is_fisheye = camera.lens is LensModel.KANNALA_BRANDT
    lines = [
        "camera_model: pinhole",
        f"distortion_coeffs: [{', '.join(map(_decimal, coefficients))}]",
        f"distortion_model: {FISHEYE_NAME if is_fisheye else 'radtan'}",
        f"intrinsics: [{', '.join(map(_decimal, pinhole))}]",
        f"resolution: [{camera.width}, {camera.height}]",
        *_further_lines(camera, 4 + len(coefficients)),
    ]
    return ["cam0:", *("  " + line.replace("\n", "\n  ") for line in lines)]


def _further_lines(camera: Camera, n: int | None = None) -> list[str]:
    """Return the lines that both forms have, of the first n intrinsics."""
    lines = []
    if camera.covariance is not None:
        lines += _matrix_lines("intrinsics_covariance", camera.covariance[:n, :n])
    if camera.calibrated_on is not None:
        lines.append(f'calibration_date: "{camera.calibrated_on.isoformat()}"')
    if camera.serial:
        lines.append(f"camera_serial: {json.dumps(camera.serial, ensure_ascii=False)}")
    if camera.temperature_c is not None:
        lines.append(f"calibration_temperature: {_decimal(camera.temperature_c)}")
    if camera.lens_field is not None:
        lines += ["lens_field:", *_field_lines(camera.lens_field, n)]
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


def _field_lines(field: LensField, n: int | None) -> list[str]:
    """Return the lines below ``lens_field``, of the first n intrinsics."""
    lines = [
        f"amplitude: {_decimal(field.amplitude)}",
        f"correlation_length: {_decimal(field.length)}",
        f"columns: {field.columns}",
        f"rows: {field.rows}",
        *_matrix_lines("values", field.values),
        *_matrix_lines("covariance", field.covariance),
    ]
    if field.intrinsics_covariance is not None:
        own = field.intrinsics_covariance[:n, :n]
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
