"""Intrinsics as text; see `lightpen.formats.camera_files`."""

import json

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.model.camera import Camera


def opencv_lines(camera: Camera) -> list[str]:
    """Return the lines of a FileStorage of OpenCV."""
    lines = [
        "%YAML:1.0",
        "---",
        f"image_width: {camera.width}",
        f"image_height: {camera.height}",
        *_matrix_lines("camera_matrix", camera.matrix, "!!opencv-matrix"),
        *_matrix_lines(
            "distortion_coefficients", camera.distortion[None], "!!opencv-matrix"
        ),
    ]
    return lines + _quality_lines(camera, "!!opencv-matrix")


def ros_lines(camera: Camera) -> list[str]:
    """Return the lines of a camera_info of ROS."""
    model = "plumb_bob" if len(camera.distortion) == 5 else "rational_polynomial"
    projection = np.column_stack([camera.matrix, np.zeros(3)])
    return [
        f"image_width: {camera.width}",
        f"image_height: {camera.height}",
        "camera_name: camera",
        *_matrix_lines("camera_matrix", camera.matrix),
        f"distortion_model: {model}",
        *_matrix_lines("distortion_coefficients", camera.distortion[None]),
        *_matrix_lines("rectification_matrix", np.eye(3)),
        *_matrix_lines("projection_matrix", projection),
        *_quality_lines(camera),
    ]


def _quality_lines(camera: Camera, tag: str = "") -> list[str]:
    lines = []
    if camera.covariance is not None:
        lines += _matrix_lines("intrinsics_covariance", camera.covariance, tag)
    if camera.calibrated_on is not None:
        lines.append(f'calibration_date: "{camera.calibrated_on.isoformat()}"')
    if camera.serial:
        lines.append(f"camera_serial: {json.dumps(camera.serial, ensure_ascii=False)}")
    if camera.temperature_c is not None:
        lines.append(f"calibration_temperature: {_decimal(camera.temperature_c)}")
    return lines


def _matrix_lines(name: str, matrix: FloatArray, tag: str = "") -> list[str]:
    rows = ",\n      ".join(", ".join(map(_decimal, row)) for row in matrix)
    return [
        f"{name}: {tag}".rstrip(),
        f"   rows: {len(matrix)}",
        f"   cols: {matrix.shape[1]}",
        *(["   dt: d"] if tag else []),
        f"   data: [ {rows} ]",
    ]


def _decimal(value: float) -> str:
    """Return the shortest text that reads back the same, as YAML 1.1 wants a float."""
    text = repr(float(value))
    if "e" in text and "." not in text:
        return text.replace("e", ".0e")
    return text
