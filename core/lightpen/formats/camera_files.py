"""Intrinsics of a camera in the files of OpenCV, ROS, Kalibr, MATLAB and others.

What a file is, is found from its content. Names are compared without regard to case
and underscores, so that ``camera_matrix``, ``cameraMatrix`` and ``Camera_Matrix`` are
the same.

============ ==========================================================================
OpenCV       FileStorage as YAML, XML or JSON: ``image_width``, ``image_height`` (or
             ``image_size``), ``camera_matrix``, ``distortion_coefficients``
ROS          camera_info: the same names, ``distortion_model`` ``plumb_bob``,
             ``rational_polynomial`` or ``equidistant``
Kalibr       camchain with one camera: ``intrinsics`` [fx fy cx cy], ``resolution``,
             ``distortion_model`` ``radtan`` or ``equidistant``, ``distortion_coeffs``
MATLAB       cameraParameters or cameraIntrinsics by ``jsonencode``:
             ``FocalLength`` and ``PrincipalPoint``, ``K`` or ``IntrinsicMatrix``;
             ``RadialDistortion``, ``TangentialDistortion``, ``ImageSize``. Its first
             pixel is (1, 1).
caliscope    and anipose: TOML with one camera: ``size``, ``matrix``, ``distortions``,
             ``fisheye``
others       mrcal, COLMAP, Metashape, calib.io, PhotonVision, RealSense, camodocal,
             and ``fx fy cx cy k1 ...`` by their names:
             `lightpen.formats.camera_layouts`
============ ==========================================================================

The binning and the region of interest of a ROS file are applied: the camera is that of
the images.

A fisheye has ``distortion_model`` ``equidistant`` (or ``fisheye``, ``kannala_brandt``)
and the 4 coefficients of OpenCV's module ``fisheye``, in the layouts of OpenCV, ROS and
Kalibr.

Optional in all: ``intrinsics_covariance``, square, of fx fy cx cy and the distortion
coefficients; or their standard deviations ``std_deviations_intrinsics``, in the order
of OpenCV's ``calibrateCameraExtended``, fx and fy being taken as off together, as they
are; the day of the calibration, ``calibration_date`` or ``calibration_time``; the
serial number of the camera, ``camera_serial``; how warm it was,
``calibration_temperature``, in degrees Celsius; and the residual field of the lens,
``lens_field``, see `lightpen.model.fisheye`: ``amplitude`` and
``correlation_length``, px, and where it was measured ``columns``, ``rows``, ``values``
(a row u v for each node), ``covariance``, and ``intrinsics_covariance`` of what does
not go with the field; and of a camera found from images of a pen (``lightpen
discover``) ``found_from``: an LED centre of each of these ``images``, px, and the
``intrinsics`` without them, fx fy cx cy and the coefficients, with their
``intrinsics_covariance``.
"""

import re
from collections.abc import Iterator
from dataclasses import replace
from datetime import date
from pathlib import Path

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.errors import FileError
from lightpen.formats.camera_checks import (
    check_fold,
    check_pinhole,
    check_skew,
    check_window,
    checked_distortion,
    checked_size,
)
from lightpen.formats.camera_layouts import (
    DISTORTION,
    colmap_tree,
    foreign_intrinsics,
    image_size_of,
    layout_of,
    mappings,
    refuse_foreign,
)
from lightpen.formats.documents import Tree, parse_document
from lightpen.formats.entries import Entries, counted_numbers, is_covariance
from lightpen.formats.files import MEGABYTE, quoted, read_bytes, read_text
from lightpen.messages import Message, message, printable
from lightpen.model.camera import Camera, LensModel
from lightpen.model.fisheye import MOST, LensField
from lightpen.model.self_calibration import FoundCamera

CAMERA_FILE = message("file.camera")
CAMERA_FILE_LIMIT = 4 * MEGABYTE  # some keep the points they were calibrated from
LONGEST_SERIAL = 60  # characters
COLDEST, WARMEST = -50.0, 100.0  # degrees Celsius
LARGEST_AMPLITUDE = 10.0  # px, of a lens field; more is another distortion
SHORTEST_LENGTH = 10.0  # px
FOCAL_CORRELATION = 0.99  # of fx and fy: 0.991 by 24 views of a board, 5 MP

_MATRIX = (
    *("camera_matrix", "K", "intrinsic_matrix", "mtx", "matrix", "intrinsics"),
    "camera_intrinsics",
)
_COVARIANCE = ("intrinsics_covariance",)
_DEVIATIONS = (
    *("std_deviations_intrinsics", "standard_deviations_intrinsics"),
    *("std_deviations", "standard_deviations"),
)
_DATE = ("calibration_date", "calibration_time")
_SERIAL = ("camera_serial",)
_TEMPERATURE = ("calibration_temperature",)
_FIELD = ("lens_field",)
_FOUND = ("found_from",)
_FIELD_ENTRIES = (
    *("amplitude", "correlation_length", "columns", "rows", "values", "covariance"),
    *_COVARIANCE,
)
_MODELS = {"plumb_bob", "rational_polynomial", "radtan", "radial_tangential", "none"}
_FLAG = ("fisheye", "fisheye_model")  # of caliscope, and of samples of OpenCV
_FISHEYE = {"equidistant", "equi", "fisheye", "kannala_brandt", "kannala_brandt4"}
_MONTHS = [
    *("Jan", "Feb", "Mar", "Apr", "May", "Jun"),
    *("Jul", "Aug", "Sep", "Oct", "Nov", "Dec"),
]
_ISO_DATE = r"(?a)(\d{4})[-/](\d\d)[-/](\d\d)(?!\d)"
_C_DATE = rf"(?a)\w{{3}} ({'|'.join(_MONTHS)}) +(\d\d?) \d\d:\d\d:\d\d (\d{{4}})"
_BESIDE = r".*(size|resolution|dist\w*)"  # a camera, of which they are a part
_OTHERS = ("xi", "MappingCoefficients", "RadialDistortion", "PrincipalPoint")


def read_camera(path: Path) -> Camera:
    """Read the intrinsics of a camera; see the module for the layouts.

    It has 5 distortion coefficients, k3 = 0 being added if the file has 4, or 8,
    further ones being dropped if they are zero. ``calibrated_on`` is None if the file
    has no date or an ambiguous one, such as 03/04/25. Raises `FileError` unless it is
    the complete file of a camera.
    """
    name = printable(path.name)
    refuse_foreign(read_bytes(path, CAMERA_FILE, CAMERA_FILE_LIMIT), name)
    text = read_text(path, CAMERA_FILE, CAMERA_FILE_LIMIT)
    tree = colmap_tree(text, name)
    whole = Entries.of(parse_document(text, name) if tree is None else tree, name)
    found = list(_cameras_in(whole))
    if len(found) > 1:
        raise FileError("camera-file.several-cameras", name=name, n_cameras=len(found))
    if not found:
        keys = [printable(key) for key, _ in whole.values.values()][:6]
        raise FileError("camera-file.unknown", name=name, found=", ".join(keys))
    return _of_images(_sensor_camera(found[0]), found[0])


def _cameras_in(entries: Entries) -> Iterator[Entries]:
    """Yield the cameras of a document: itself, or what it has below its names.

    A camera has also what stands beside its name, such as the size of all images.
    """
    if layout_of(entries) or entries.has(*_OTHERS) or _has_matrix(entries):
        yield entries
        return
    own: dict[str, tuple[str, Tree]] = {}
    parts: list[dict[str, Tree]] = []
    for key, (name, value) in entries.values.items():
        below = [] if re.fullmatch(_BESIDE, key) else mappings(value)
        parts += below
        own |= {} if below else {key: (name, value)}
    for part in parts:
        values = own | Entries.of(part, entries.name).values
        yield from _cameras_in(Entries(entries.name, values))


def _has_matrix(entries: Entries) -> bool:
    """Return whether an entry is a camera matrix, or numbers in its place."""
    values = [entries.value(name) for name in _MATRIX if entries.has(name)]
    return any(
        "data" in value if isinstance(value, dict) else not mappings(value)
        for value in values
    )


def _sensor_camera(entries: Entries) -> Camera:
    """Return the camera of the size that its intrinsics are for."""
    given = foreign_intrinsics(entries)
    if given is not None:
        return _camera(entries, *given)
    if entries.has("xi"):
        raise FileError(
            "camera-file.foreign",
            name=entries.name,
            program=message("camera-file.omnidirectional"),
            remedy=message("camera-file.by-images"),
        )
    if entries.has("MappingCoefficients"):
        raise _fisheye(entries.name, "fisheyeIntrinsics")
    if entries.has("RadialDistortion") or entries.has("PrincipalPoint"):
        return _from_matlab(entries)
    if entries.has("intrinsics") and (
        entries.has("camera_model") or len(entries.numbers("intrinsics")) == 4
    ):
        return _from_kalibr(entries)
    return _from_opencv(entries)


def _of_images(camera: Camera, entries: Entries) -> Camera:
    """Return a camera of ROS for the images that its driver cuts and bins."""
    whole = camera.image_size
    if entries.has("roi") and isinstance(entries.value("roi"), dict):
        roi = entries.part("roi")
        names = ("x_offset", "y_offset", "width", "height")
        x, y, width, height = (_whole(roi, name) for name in names)
        if width and height:
            check_window(camera, (x, y, width, height), (1, 1), entries.name)
            camera = camera.cropped(x, y, width, height)
    binning = [max(_whole(entries, f"binning_{axis}"), 1) for axis in "xy"]
    if max(binning) > 1:
        check_window(camera, None, (binning[0], binning[1]), entries.name)
        camera = camera.binned(*binning)
    if camera.image_size != whole:
        camera = replace(camera, unbinned_size=whole)
    return camera


def _whole(entries: Entries, name: str) -> int:
    """Return a whole number of at least 0, which is 0 where there is none."""
    number = entries.counted(1, name)[0] if entries.has(name) else 0.0
    if number != round(number) or number < 0:
        raise FileError(
            "camera-file.whole", entry=name, name=entries.name, number=number
        )
    return int(number)


def _from_opencv(entries: Entries) -> Camera:
    lens = _lens(entries)
    matrix = entries.counted(9, *_MATRIX).reshape(3, 3)
    return _camera(
        entries,
        image_size_of(entries),
        _pinhole(matrix, entries),
        _distortion(entries),
        lens,
    )


def _from_kalibr(entries: Entries) -> Camera:
    model = entries.word("camera_model").casefold()
    if model and model != "pinhole":
        raise FileError(
            "camera-file.not-pinhole", name=entries.name, model=quoted(model)
        )
    lens = _lens(entries)
    pinhole = entries.counted(4, "intrinsics")
    return _camera(entries, image_size_of(entries), pinhole, _distortion(entries), lens)


def _distortion(entries: Entries) -> FloatArray:
    if not entries.has(*DISTORTION):
        raise FileError("camera-file.no-distortion", name=entries.name)
    return entries.numbers(*DISTORTION)


def _from_matlab(entries: Entries) -> Camera:
    height, width = entries.counted(2, "ImageSize")
    if entries.has("FocalLength"):
        pinhole = np.concatenate(
            [entries.counted(2, "FocalLength"), entries.counted(2, "PrincipalPoint")]
        )
        if entries.has("Skew"):
            check_skew(entries.counted(1, "Skew")[0], entries)
    else:
        key = "K" if entries.has("K") else "IntrinsicMatrix"
        pinhole = _pinhole(entries.counted(9, key).reshape(3, 3), entries)
    pinhole[2:] -= 1  # the centre of the first pixel is (1, 1) in MATLAB
    radial = entries.numbers("RadialDistortion")
    if len(radial) not in (2, 3):
        raise FileError(
            "camera-file.radial-count",
            name=entries.name,
            counted=counted_numbers(len(radial)),
        )
    tangential = entries.counted(2, "TangentialDistortion")
    coefficients = np.concatenate([radial[:2], tangential, radial[2:]])
    return _camera(entries, (width, height), pinhole, coefficients)


def _lens(entries: Entries) -> LensModel:
    flag = str(entries.value(*_FLAG)) if entries.has(*_FLAG) else ""
    if flag.casefold() in ("true", "1"):
        return LensModel.KANNALA_BRANDT
    model = entries.word("distortion_model").casefold().replace("-", "_")
    if model in _FISHEYE:
        return LensModel.KANNALA_BRANDT
    if model == "fov":
        raise _fisheye(entries.name, model)
    if model and model not in _MODELS:
        raise FileError(
            "camera-file.distortion-model", name=entries.name, model=quoted(model)
        )
    return LensModel.BROWN


def _fisheye(name: str | Message, model: str) -> FileError:
    return FileError("camera-file.fisheye", name=name, model=model)


def _pinhole(matrix: FloatArray, entries: Entries) -> FloatArray:
    """Return fx fy cx cy of a camera matrix, by rows or, as of Apple, by columns."""
    if np.array_equal(matrix[:, 2], [0, 0, 1]):
        matrix = matrix.T
    if not np.array_equal(matrix[2], [0, 0, 1]) or matrix[1, 0] != 0:
        raise FileError("camera-file.matrix-form", name=entries.name)
    check_skew(matrix[0, 1], entries)
    return np.array([matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2]])


def _camera(
    entries: Entries,
    size: tuple[float, float],
    pinhole: FloatArray,
    coefficients: FloatArray,
    lens: LensModel = LensModel.BROWN,
) -> Camera:
    width, height = checked_size(size, entries.name)
    check_pinhole(pinhole, width, height, entries.name)
    distortion = checked_distortion(coefficients, entries, lens)
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
        lens_field=_lens_field(
            entries, width, height, len(coefficients), len(distortion)
        ),
        lens=lens,
        found=_found(entries, width, height, len(distortion)),
    )
    check_fold(camera, entries)
    return camera


def _covariance(entries: Entries, given: int, kept: int) -> FloatArray | None:
    """Return the covariance of fx fy cx cy and the retained coefficients."""
    if entries.has(*_COVARIANCE):
        stated = entries.counted((4 + given) ** 2, *_COVARIANCE)
        stated = stated.reshape(4 + given, 4 + given)
        if not is_covariance(stated):
            raise FileError("camera-file.covariance", name=entries.name)
    elif entries.has(*_DEVIATIONS):
        deviations = entries.numbers(*_DEVIATIONS)
        if len(deviations) < 4 + given or np.any(deviations < 0):
            raise FileError(
                "camera-file.deviations",
                entry=entries.entry(*_DEVIATIONS)[0],
                name=entries.name,
                needed=4 + given,
                n_coefficients=given,
            )
        stated = np.diag(deviations[: 4 + given] ** 2)
        stated[0, 1] = stated[1, 0] = FOCAL_CORRELATION * deviations[0] * deviations[1]
    else:
        return None
    covariance = np.zeros((4 + kept, 4 + kept))
    shared = 4 + min(given, kept)
    covariance[:shared, :shared] = stated[:shared, :shared]
    return covariance


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
            "camera-file.temperature",
            name=entries.name,
            celsius=celsius,
            coldest=COLDEST,
            warmest=WARMEST,
        )
    return celsius


def _found(entries: Entries, width: int, height: int, kept: int) -> FoundCamera | None:
    if not entries.has(*_FOUND):
        return None
    part = entries.part(*_FOUND)
    part.refuse_others("images", "intrinsics", *_COVARIANCE)
    intrinsics = part.counted(4 + kept, "intrinsics")
    check_pinhole(intrinsics[:4], width, height, entries.name)
    covariance = _covariance(part, kept, kept)
    return FoundCamera(part.points("images"), intrinsics, covariance)


def _lens_field(
    entries: Entries, width: int, height: int, given: int, kept: int
) -> LensField | None:
    if not entries.has(*_FIELD):
        return None
    part = entries.part(*_FIELD)
    part.refuse_others(*_FIELD_ENTRIES)
    amplitude, length = (
        float(part.counted(1, name)[0]) for name in ("amplitude", "correlation_length")
    )
    if not (0 < amplitude <= LARGEST_AMPLITUDE and length >= SHORTEST_LENGTH):
        raise FileError(
            "camera-file.lens-field",
            name=entries.name,
            amplitude=amplitude,
            length=length,
            largest=LARGEST_AMPLITUDE,
            shortest=SHORTEST_LENGTH,
        )
    prior = LensField.of(width, height, amplitude, length)
    if not part.has("values"):
        return prior
    sides = part.counted(1, "columns")[0], part.counted(1, "rows")[0]
    if not all(side == round(side) and 2 <= side <= MOST for side in sides):
        raise FileError(
            "camera-file.lens-field-grid",
            name=entries.name,
            columns=sides[0],
            rows=sides[1],
            most=MOST,
        )
    columns, rows = map(int, sides)
    n_nodes = columns * rows
    covariance = part.counted(n_nodes**2, "covariance").reshape(n_nodes, n_nodes)
    if not is_covariance(covariance):
        raise FileError("camera-file.lens-field-covariance", name=entries.name)
    values = part.counted(2 * n_nodes, "values").reshape(n_nodes, 2)
    return replace(
        prior,
        columns=columns,
        rows=rows,
        values=values,
        covariance=covariance,
        intrinsics_covariance=_covariance(part, given, kept),
    )
