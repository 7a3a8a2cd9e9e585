"""Writing of the intrinsics of a camera, as YAML of OpenCV.

`lightpen.formats.camera_files` describes the layout and reads it.
"""

import json
from pathlib import Path

from lightpen.arrays import FloatArray
from lightpen.errors import UsageError
from lightpen.formats.camera_checks import check_window
from lightpen.formats.camera_files import read_camera
from lightpen.formats.files import write_whole
from lightpen.messages import printable
from lightpen.model.camera import Camera, LensModel
from lightpen.model.lens_field import LensField
from lightpen.model.self_calibration import MARK_DIGITS, FoundCamera

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
