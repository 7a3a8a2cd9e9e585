"""Intrinsics of a camera in the files of OpenCV, ROS, Kalibr and MATLAB.

What a file is, is found from its content. Names are compared without regard to case
and underscores, so that ``camera_matrix``, ``cameraMatrix`` and ``Camera_Matrix`` are
the same.

============ ==========================================================================
OpenCV       FileStorage as YAML, XML or JSON: ``image_width``, ``image_height`` (or
             ``image_size``), ``camera_matrix``, ``distortion_coefficients``
ROS          camera_info: the same names, ``distortion_model`` ``plumb_bob`` or
             ``rational_polynomial``
Kalibr       camchain with one camera: ``intrinsics`` [fx fy cx cy], ``resolution``,
             ``distortion_model`` ``radtan``, ``distortion_coeffs``
MATLAB       cameraParameters or cameraIntrinsics by ``jsonencode``:
             ``FocalLength`` and ``PrincipalPoint``, ``K`` or ``IntrinsicMatrix``;
             ``RadialDistortion``, ``TangentialDistortion``, ``ImageSize``. Its first
             pixel is (1, 1).
============ ==========================================================================

Optional in all: ``intrinsics_covariance``, square, of fx fy cx cy and the distortion
coefficients; or their standard deviations ``std_deviations_intrinsics``, in the order
of OpenCV's ``calibrateCameraExtended``, fx and fy being taken as off together, as they
are; the day of the calibration, ``calibration_date`` or ``calibration_time``; the
serial number of the camera, ``camera_serial``; and how warm it was,
``calibration_temperature``, in degrees Celsius.
"""

import json
import re
from collections.abc import Sequence
from datetime import date
from pathlib import Path
from typing import Literal

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError, FileError, UsageError
from lightpen.formats.documents import parse_document
from lightpen.formats.entries import Entries, counted_numbers, is_covariance
from lightpen.formats.files import MEGABYTE, printable, quoted, read_text, write_whole
from lightpen.model.camera import Camera
from lightpen.sentences import Sentence, sentence

CAMERA_FILE = sentence("file.camera", "camera file")
CAMERA_FILE_LIMIT = 4 * MEGABYTE  # some keep the points they were calibrated from
LARGEST_IMAGE = 100_000  # px, along a side
SMALLEST_FOCAL_LENGTH = 0.02  # of the image's longer side: 175 degrees are seen
LARGEST_ASPECT = 1.5  # of a pixel
FOLD_SAMPLES = 17  # along a side; a lens folds from the corners inwards
SKEW_TOLERANCE = 1e-6  # px; rounding, where the file has a skew of zero
LONGEST_SERIAL = 60  # characters
COLDEST, WARMEST = -50.0, 100.0  # degrees Celsius
FOCAL_CORRELATION = 0.99  # of fx and fy: 0.991 by 24 views of a board, 5 MP

_WIDTH = ("image_width", "width")
_HEIGHT = ("image_height", "height")
_SIZE = ("image_size", "resolution", "image_resolution", "img_size")
_MATRIX = ("camera_matrix", "K", "intrinsic_matrix", "mtx")
_DISTORTION = (
    *("distortion_coefficients", "dist_coeffs", "distortion_coeffs"),
    *("dist_coefficients", "distortion", "dist", "D"),
)
_COVARIANCE = ("intrinsics_covariance",)
_DEVIATIONS = (
    *("std_deviations_intrinsics", "standard_deviations_intrinsics"),
    *("std_deviations", "standard_deviations"),
)
_DATE = ("calibration_date", "calibration_time")
_SERIAL = ("camera_serial",)
_TEMPERATURE = ("calibration_temperature",)
_MODELS = {"plumb_bob", "rational_polynomial", "radtan", "none"}
_FISHEYE = {"equidistant", "fisheye", "kannala_brandt", "kannala_brandt4", "fov"}
_MONTHS = [
    *("Jan", "Feb", "Mar", "Apr", "May", "Jun"),
    *("Jul", "Aug", "Sep", "Oct", "Nov", "Dec"),
]
_ISO_DATE = r"(?a)(\d{4})[-/](\d\d)[-/](\d\d)(?!\d)"
_C_DATE = rf"(?a)\w{{3}} ({'|'.join(_MONTHS)}) +(\d\d?) \d\d:\d\d:\d\d (\d{{4}})"
_CAMERA_OF_CHAIN = r"(?a)cam\d+"


def read_camera(path: Path) -> Camera:
    """Read the intrinsics of a camera; see the module for the layouts.

    Returns
    -------
    Camera
        With 5 distortion coefficients, k3 = 0 being added if the file has 4, or with 8,
        further ones being dropped if they are zero. ``calibrated_on`` is None if the
        file has no date or one that cannot be told, such as 03/04/25.

    Raises
    ------
    FileError
        The file cannot be read, or is not the complete file of a pinhole camera.
    """
    text = read_text(path, CAMERA_FILE, CAMERA_FILE_LIMIT)
    name = printable(path.name)
    entries = Entries.of(parse_document(text, name), name)
    chain = [key for key in entries.values if re.fullmatch(_CAMERA_OF_CHAIN, key)]
    if chain:
        return _from_kalibr(_only_camera(entries, chain))
    if entries.has("intrinsics") and entries.has("camera_model"):
        return _from_kalibr(entries)
    if entries.has("Intrinsics") and isinstance(entries.value("Intrinsics"), dict):
        entries = entries.part("Intrinsics")
    if entries.has("MappingCoefficients"):
        raise _fisheye(entries.name, "fisheyeIntrinsics")
    if entries.has("RadialDistortion") or entries.has("PrincipalPoint"):
        return _from_matlab(entries)
    return _from_opencv(entries)


def write_camera(
    camera: Camera, path: Path, layout: Literal["opencv", "ros"] = "opencv"
) -> None:
    """Write the intrinsics of a camera as YAML, to be read back to the last digit.

    Parameters
    ----------
    path : Path
        Name that ends in .yaml or .yml.
    layout : {"opencv", "ros"}
        FileStorage of OpenCV, or camera_info of ROS.

    Raises
    ------
    UsageError
        The name ends otherwise.
    FileError
        The file cannot be written.
    """
    if path.suffix.lower() not in (".yaml", ".yml"):
        raise UsageError(
            sentence(
                "camera-file.suffix",
                "A camera file is written as YAML, but {name} does not end in "
                ".yaml. Choose such a name.",
                name=printable(path.name),
            )
        )
    lines = _opencv_lines(camera) if layout == "opencv" else _ros_lines(camera)
    write_whole(path, "".join(f"{line}\n" for line in lines).encode())


def _only_camera(entries: Entries, chain: Sequence[str]) -> Entries:
    if len(chain) > 1:
        raise FileError(
            sentence(
                "camera-file.several-cameras",
                "{name} describes {n_cameras} cameras. Keep the one that looks at "
                "the pen, and remove the others.",
                name=entries.name,
                n_cameras=len(chain),
            )
        )
    return entries.part(chain[0])


def _from_opencv(entries: Entries) -> Camera:
    _check_model(entries, "distortion_model")
    matrix = entries.counted(9, *_MATRIX).reshape(3, 3)
    return _camera(
        entries,
        _size(entries),
        _pinhole(matrix, entries),
        entries.numbers(*_DISTORTION),
    )


def _from_kalibr(entries: Entries) -> Camera:
    model = entries.word("camera_model").casefold()
    if model and model != "pinhole":
        raise FileError(
            sentence(
                "camera-file.not-pinhole",
                "{name} describes a camera of the model {model}; the model pinhole "
                "is needed. Calibrate the camera again with pinhole-radtan.",
                name=entries.name,
                model=quoted(model),
            )
        )
    _check_model(entries, "distortion_model")
    pinhole = entries.counted(4, "intrinsics")
    return _camera(entries, _size(entries), pinhole, entries.numbers(*_DISTORTION))


def _from_matlab(entries: Entries) -> Camera:
    height, width = entries.counted(2, "ImageSize")
    if entries.has("FocalLength"):
        pinhole = np.concatenate(
            [entries.counted(2, "FocalLength"), entries.counted(2, "PrincipalPoint")]
        )
        if entries.has("Skew"):
            _check_skew(entries.counted(1, "Skew")[0], entries)
    else:
        key = "K" if entries.has("K") else "IntrinsicMatrix"
        matrix = entries.counted(9, key).reshape(3, 3)
        transposed = np.array_equal(matrix[:, 2], [0, 0, 1])
        pinhole = _pinhole(matrix.T if transposed else matrix, entries)
    pinhole[2:] -= 1  # the centre of the first pixel is (1, 1) in MATLAB
    radial = entries.numbers("RadialDistortion")
    if len(radial) not in (2, 3):
        raise FileError(
            sentence(
                "camera-file.radial-count",
                "RadialDistortion in {name} has {counted} where 2 or 3 are needed. "
                "Correct it, or export the file again.",
                name=entries.name,
                counted=counted_numbers(len(radial)),
            )
        )
    tangential = entries.counted(2, "TangentialDistortion")
    coefficients = np.concatenate([radial[:2], tangential, radial[2:]])
    return _camera(entries, (width, height), pinhole, coefficients)


def _check_model(entries: Entries, key: str) -> None:
    model = entries.word(key).casefold()
    if model in _FISHEYE:
        raise _fisheye(entries.name, model)
    if model and model not in _MODELS:
        raise FileError(
            sentence(
                "camera-file.distortion-model",
                "{name} has the distortion model {model}, which is not known here. "
                "Calibrate the camera again with plumb_bob (radtan) or "
                "rational_polynomial.",
                name=entries.name,
                model=quoted(model),
            )
        )


def _fisheye(name: str | Sentence, model: str) -> FileError:
    return FileError(
        sentence(
            "camera-file.fisheye",
            "{name} describes a fisheye lens ({model}). A pinhole camera is needed: "
            "calibrate the camera again with the distortion model plumb_bob "
            "(radtan) or rational_polynomial.",
            name=name,
            model=model,
        )
    )


def _size(entries: Entries) -> tuple[float, float]:
    if entries.has(*_SIZE) and not entries.has(*_WIDTH):
        width, height = entries.counted(2, *_SIZE)
        return width, height
    if not entries.has(*_WIDTH) or not entries.has(*_HEIGHT):
        raise FileError(
            sentence(
                "camera-file.no-size",
                "{name} does not say how large the images are. Add the lines "
                "image_width and image_height, in pixels.",
                name=entries.name,
            )
        )
    return entries.counted(1, *_WIDTH)[0], entries.counted(1, *_HEIGHT)[0]


def _pinhole(matrix: FloatArray, entries: Entries) -> FloatArray:
    """Return fx fy cx cy of a camera matrix."""
    if not np.array_equal(matrix[2], [0, 0, 1]) or matrix[1, 0] != 0:
        raise FileError(
            sentence(
                "camera-file.matrix-form",
                "The camera matrix of {name} is not of the form fx 0 cx, 0 fy cy, 0 "
                "0 1; it may be transposed or incomplete. Export the file again.",
                name=entries.name,
            )
        )
    _check_skew(matrix[0, 1], entries)
    return np.array([matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2]])


def _check_skew(skew: float, entries: Entries) -> None:
    if abs(skew) > SKEW_TOLERANCE:
        raise FileError(
            sentence(
                "camera-file.skew",
                "{name} has a skew of {skew:g} px; cameras without skew are needed. "
                "Calibrate the camera again without estimating a skew.",
                name=entries.name,
                skew=skew,
            )
        )


def _camera(
    entries: Entries,
    size: tuple[float, float],
    pinhole: FloatArray,
    coefficients: FloatArray,
) -> Camera:
    width, height = _checked_size(size, entries.name)
    _check_pinhole(pinhole, width, height, entries.name)
    distortion = _checked_distortion(coefficients, entries)
    fx, fy, cx, cy = map(float, pinhole)
    camera = Camera(
        width=width,
        height=height,
        fx=fx,
        fy=fy,
        cx=cx,
        cy=cy,
        distortion=distortion,
        covariance=_covariance(entries, len(coefficients), len(distortion)),
        calibrated_on=_day(entries),
        serial=_serial(entries),
        temperature_c=_temperature(entries),
    )
    _check_fold(camera, entries)
    return camera


def _checked_size(size: tuple[float, float], name: str | Sentence) -> tuple[int, int]:
    for side in size:
        if side != round(side) or not 0 < side <= LARGEST_IMAGE:
            raise FileError(
                sentence(
                    "camera-file.image-size",
                    "{name} gives an image size of {width:g} x {height:g} px. Two "
                    "whole numbers from 1 to {most} are needed.",
                    name=name,
                    width=size[0],
                    height=size[1],
                    most=LARGEST_IMAGE,
                )
            )
    return int(size[0]), int(size[1])


def _check_pinhole(
    pinhole: FloatArray, width: int, height: int, name: str | Sentence
) -> None:
    fx, fy, cx, cy = pinhole
    if fx <= 0 or fy <= 0:
        raise FileError(
            sentence(
                "camera-file.focal-length-sign",
                "{name} has the focal lengths {fx:g} and {fy:g} px; both must be "
                "positive. Export the file again, or calibrate the camera again.",
                name=name,
                fx=fx,
                fy=fy,
            )
        )
    if min(fx, fy) < SMALLEST_FOCAL_LENGTH * max(width, height):
        raise FileError(
            sentence(
                "camera-file.focal-length-short",
                "{name} has the focal lengths {fx:g} and {fy:g} px, too short for "
                "images of {width} x {height} px; they may be in millimetres. Give "
                "them in pixels.",
                name=name,
                fx=fx,
                fy=fy,
                width=width,
                height=height,
            )
        )
    if max(fx, fy) > LARGEST_ASPECT * min(fx, fy):
        raise FileError(
            sentence(
                "camera-file.focal-lengths-differ",
                "{name} has the focal lengths {fx:g} and {fy:g} px along u and v; "
                "with the pixels of a camera these are nearly alike. Export the "
                "file again, or calibrate the camera again.",
                name=name,
                fx=fx,
                fy=fy,
            )
        )
    if abs(cx - width / 2) > width or abs(cy - height / 2) > height:
        raise FileError(
            sentence(
                "camera-file.principal-point",
                "{name} has its principal point at ({cx:g}, {cy:g}) px, far outside "
                "the image of {width} x {height} px. Check that both belong to the "
                "same camera and image size.",
                name=name,
                cx=cx,
                cy=cy,
                width=width,
                height=height,
            )
        )


def _checked_distortion(coefficients: FloatArray, entries: Entries) -> FloatArray:
    """Return 5 or 8 coefficients."""
    count = len(coefficients)
    if count == 0 and entries.word("distortion_model").casefold() == "none":
        return np.zeros(5)
    if count not in (4, 5, 8, 12, 14):
        counted = (
            sentence("count.one-distortion-coefficient", "1 distortion coefficient")
            if count == 1
            else sentence(
                "count.distortion-coefficients",
                "{count} distortion coefficients",
                count=count,
            )
        )
        raise FileError(
            sentence(
                "camera-file.distortion-count",
                "{name} has {counted}; 4, 5 or 8 are needed (k1 k2 p1 p2 k3 k4 k5 "
                "k6). Export the file again.",
                name=entries.name,
                counted=counted,
            )
        )
    if np.any(coefficients[8:]):
        raise FileError(
            sentence(
                "camera-file.distortion-terms",
                "{name} has {count} distortion coefficients with a thin prism or a "
                "tilted sensor; 4, 5 or 8 are supported. Calibrate the camera again "
                "without these terms.",
                name=entries.name,
                count=count,
            )
        )
    return np.append(coefficients, 0.0) if count == 4 else coefficients[:8]


def _check_fold(camera: Camera, entries: Entries) -> None:
    """Refuse a distortion that turns the image over before its corners."""
    grid = np.meshgrid(
        np.linspace(0, camera.width - 1, FOLD_SAMPLES),
        np.linspace(0, camera.height - 1, FOLD_SAMPLES),
    )
    try:
        camera.unproject(np.stack(grid, axis=-1))
    except CalibrationError as error:
        raise FileError(
            sentence(
                "camera-file.fold",
                "The distortion coefficients of {name} fold the image of {width} x "
                "{height} px: some pixels have no direction of view, or two. Check "
                "them, or calibrate the camera again with views that reach into the "
                "corners.",
                name=entries.name,
                width=camera.width,
                height=camera.height,
            )
        ) from error


def _covariance(entries: Entries, given: int, kept: int) -> FloatArray | None:
    """Return the covariance of fx fy cx cy and the coefficients that are kept."""
    if entries.has(*_COVARIANCE):
        stated = entries.counted((4 + given) ** 2, *_COVARIANCE)
        stated = stated.reshape(4 + given, 4 + given)
        _check_covariance(stated, entries.name)
    elif entries.has(*_DEVIATIONS):
        deviations = entries.numbers(*_DEVIATIONS)
        if len(deviations) < 4 + given or np.any(deviations < 0):
            raise FileError(
                sentence(
                    "camera-file.deviations",
                    "{entry} in {name} must hold {needed} numbers, none of them "
                    "negative: of fx fy cx cy and the {n_coefficients} distortion "
                    "coefficients. Correct or remove it.",
                    entry=entries.entry(*_DEVIATIONS)[0],
                    name=entries.name,
                    needed=4 + given,
                    n_coefficients=given,
                )
            )
        stated = np.diag(deviations[: 4 + given] ** 2)
        stated[0, 1] = stated[1, 0] = FOCAL_CORRELATION * deviations[0] * deviations[1]
    else:
        return None
    covariance = np.zeros((4 + kept, 4 + kept))
    shared = 4 + min(given, kept)
    covariance[:shared, :shared] = stated[:shared, :shared]
    return covariance


def _check_covariance(covariance: FloatArray, name: str | Sentence) -> None:
    if not is_covariance(covariance):
        raise FileError(
            sentence(
                "camera-file.covariance",
                "The intrinsics_covariance of {name} is not a covariance: it must "
                "be symmetric, with correlations from -1 to 1. Correct or remove it.",
                name=name,
            )
        )


def _day(entries: Entries) -> date | None:
    if not entries.has(*_DATE):
        return None
    text = entries.value(*_DATE)
    if not isinstance(text, str):
        return None
    iso, c_style = re.match(_ISO_DATE, text), re.match(_C_DATE, text)
    try:
        if iso:
            return date(*map(int, iso.groups()))
        if c_style:
            month, day, year = c_style.groups()
            return date(int(year), _MONTHS.index(month) + 1, int(day))
    except ValueError:
        return None
    return None


def _serial(entries: Entries) -> str:
    if not entries.has(*_SERIAL):
        return ""
    value = entries.value(*_SERIAL)
    is_plain = isinstance(value, str | int)
    return printable(str(value))[:LONGEST_SERIAL] if is_plain else ""


def _temperature(entries: Entries) -> float | None:
    if not entries.has(*_TEMPERATURE):
        return None
    celsius = float(entries.counted(1, *_TEMPERATURE)[0])
    if not COLDEST <= celsius <= WARMEST:
        raise FileError(
            sentence(
                "camera-file.temperature",
                "{name} has the calibration_temperature {celsius:g}; degrees Celsius "
                "from {coldest:g} to {warmest:g} are needed. Correct or remove it.",
                name=entries.name,
                celsius=celsius,
                coldest=COLDEST,
                warmest=WARMEST,
            )
        )
    return celsius


def _opencv_lines(camera: Camera) -> list[str]:
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


def _ros_lines(camera: Camera) -> list[str]:
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
