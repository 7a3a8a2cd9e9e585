"""Intrinsics in the files of other programs, one description a layout.

A layout says where a file has its numbers and what they are called here: fx fy cx cy, a
focal length f of both, an aspect ratio fy / fx, k1 to k6, p1 p2, and OpenCV's s1 to s4,
tx, ty of thin prism and tilt. ``dx dy`` is the principal point from the centre of the
image, ``b1`` what fx has more than f, ``r8`` the coefficient of r^8, ``skew`` and ``-``
a number that means nothing. What a file does not have is 0.
"""

import re
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.errors import FileError
from lightpen.formats.camera_checks import check_skew
from lightpen.formats.documents import Tree
from lightpen.formats.entries import Entries
from lightpen.formats.files import foreign_program, quoted
from lightpen.messages import message
from lightpen.model.camera import LensModel

BROWN, KANNALA_BRANDT = LensModel.BROWN, LensModel.KANNALA_BRANDT
_FOCAL = "f"
_BASE = "ptr_wrapper/data/CameraModelCRT/CameraModelBase"  # of calib.io
_RADIAL = "k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4 tx ty"  # in the order of OpenCV
_WIDTH = ("image_width", "width", "w", "cols")
_HEIGHT = ("image_height", "height", "h", "rows")
_SIZE = (
    *("image_size", "resolution", "image_resolution", "img_size", "size"),
    *("camera_res", "camera_resolution", "image_dimension", "image_dimensions"),
)
DISTORTION = (
    *("distortion_coefficients", "dist_coeffs", "distortion_coeffs", "dist_coef"),
    *("dist_coefficients", "dist_coeff", "distortion", "distortions", "dist", "D"),
    *("dist_coefs", "camera_extrinsics"),  # as PhotonVision named them before 2024
    *("disto", "kc"),  # of ZED, of Bouguet
)


@dataclass(frozen=True)
class FileLayout:
    """Where a program writes the intrinsics of a camera.

    A path is names with ``/`` between them; ``|`` separates other spellings.
    """

    program: str
    marks: str  # entries that tell the layout
    numbers: dict[str, str]  # by path: the names of the numbers there
    size: str = ""  # paths of width and height, or of both, unless of usual names
    lens: LensModel = BROWN  # where the file names no model
    model: str = ""  # path of the name of the lens model
    # Names of lens models without blanks and marks; of the last, if undistorted
    brown: str = ""
    fisheye: str = ""
    undistorted: str = ""
    of_fisheye: dict[str, str] = field(default_factory=dict)  # other `numbers` of it
    first: float = 0.0  # coordinate of the centre of the first pixel


class Given(NamedTuple):
    """The numbers of a file, in the conventions of OpenCV."""

    size: tuple[float, float]
    pinhole: FloatArray  # fx fy cx cy
    coefficients: FloatArray
    lens: LensModel


def _each(names: str, path: str = "{}") -> dict[str, str]:
    """Return the numbers at paths, by names such as ``f cx:dx``: in the file, here."""
    pairs = [name.partition(":") for name in names.split()]
    return {path.format(name): here or name for name, _, here in pairs}


LAYOUTS = (
    FileLayout(
        "mrcal",
        marks="lensmodel imagersize",
        size="imagersize",
        numbers={"intrinsics": f"fx fy cx cy {_RADIAL}"},
        model="lensmodel",
        brown="lensmodelpinhole lensmodelopencv4 lensmodelopencv5 lensmodelopencv8 "
        "lensmodelopencv12",
    ),
    FileLayout(
        "COLMAP",
        marks="colmap",
        numbers=_each(f"f fx fy cx cy {_RADIAL}"),
        model="colmap",
        brown="simplepinhole pinhole simpleradial radial opencv fullopencv",
        fisheye="simpleradialfisheye radialfisheye opencvfisheye",
        first=0.5,
    ),
    FileLayout(
        "Metashape",
        marks="projection f",
        numbers=_each(
            "f b1 b2:skew cx:dx cy:dy k1 k2 k3 k4:r8 p1:p2 p2:p1 p3:s1 p4:s2"
        ),
        model="projection",
        brown="frame",
        fisheye="fisheye",
        first=0.5,
    ),
    FileLayout(
        "calib.io",
        marks="polymorphic_name ptr_wrapper",
        size=f"{_BASE}/imageSize|{_BASE}/imageWidth {_BASE}/imageHeight",
        numbers=_each(
            f"f ar:aspect cx cy skew {_RADIAL} tauX:tx tauY:ty",
            "ptr_wrapper/data/parameters/{}/val",
        ),
        model="polymorphic_name",
        brown="libcalibcameramodelopencv libcalibcameramodelmatlab",
    ),
    FileLayout(
        "RealSense",
        marks="ppx ppy",
        numbers=_each("fx fy ppx:cx ppy:cy") | {"coeffs": "k1 k2 p1 p2 k3"},
        model="model|distortion_model",
        brown="none brownconrady",
        fisheye="kannalabrandt4",
        undistorted="inversebrownconrady modifiedbrownconrady",
        of_fisheye={"coeffs": "k1 k2 k3 k4 -"},
    ),
    FileLayout(
        "camodocal",
        marks="model_type projection_parameters",
        numbers=_each(
            "fx fy cx cy mu:fx mv:fy u0:cx v0:cy k2:k1 k3:k2 k4:k3 k5:k4",
            "projection_parameters/{}",
        )
        | _each("k1 k2 p1 p2", "distortion_parameters/{}"),
        model="model_type",
        brown="pinhole",
        fisheye="kannalabrandt",
    ),
    FileLayout(
        "SVO",
        marks="intrinsics distortion/parameters",
        numbers={"intrinsics": "fx fy cx cy", "distortion/parameters": "k1 k2 p1 p2"},
        model="distortion/type",
        brown="radialtangential none",
        fisheye="equidistant",
        of_fisheye={"distortion/parameters": "k1 k2 k3 k4"},
    ),
    FileLayout(
        "OKVIS",
        marks="focal_length principal_point distortion_type",
        numbers={"focal_length": "fx fy", "principal_point": "cx cy"},
        model="distortion_type",
        brown="radialtangential radialtangential8",
        fisheye="equidistant",
    ),
    FileLayout(
        "Nerfies",
        marks="focal_length principal_point pixel_aspect_ratio",
        numbers=_each("focal_length:f pixel_aspect_ratio:aspect skew")
        | {"principal_point": "cx cy"},
        first=0.5,
    ),
    FileLayout(
        "Basalt",
        marks="resolution intrinsics/camera_type",
        numbers=_each(f"fx fy cx cy {_RADIAL}", "intrinsics/intrinsics/{}"),
        model="intrinsics/camera_type",
        brown="pinhole pinholeradtan8",
        fisheye="kb4",
    ),
    FileLayout(
        "Nerfstudio",
        marks="fl_x w",
        numbers=_each("fl_x:fx fl_y:fy cx cy k1 k2 p1 p2 k3 k4"),
        model="camera_model",
        brown="opencv pinhole simplepinhole",
        fisheye="opencvfisheye",
        first=0.5,
    ),
    FileLayout(
        "ORB-SLAM",
        marks="Camera.fx|Camera1.fx",
        size="Camera.width Camera.height",
        numbers=_each("fx fy cx cy", "Camera.{0}|Camera1.{0}")
        | _each("k1 k2 p1 p2 k3 k4", "Camera.{0}|Camera1.{0}"),
        model="Camera.type",
        brown="pinhole",
        fisheye="kannalabrandt8",
    ),
    FileLayout(
        "Open3D",
        marks="intrinsic_matrix width height",
        numbers={"intrinsic_matrix": "fx - - skew fy - cx cy -"},  # column by column
    ),
    FileLayout(
        "Gyroflow",
        marks="fisheye_params calib_dimension",
        size="calib_dimension/w calib_dimension/h",
        numbers={
            "fisheye_params/camera_matrix": "fx skew cx - fy cy - - -",
            "fisheye_params/distortion_coeffs": "k1 k2 k3 k4",
        },
        lens=KANNALA_BRANDT,
    ),
    FileLayout(
        "fisheye of OpenCV",
        marks="DIM K D",
        size="DIM",
        numbers={"K": "fx skew cx - fy cy - - -", "D": "k1 k2 k3 k4"},
        lens=KANNALA_BRANDT,
    ),
    FileLayout(
        "another program",
        marks="fx fy cx cy",
        numbers=_each(f"fx fy cx cy skew {_RADIAL}"),
        model="distortion_model|camera_model|model",
        brown="plumbbob radtan brown brownconrady opencv pinhole rationalpolynomial "
        "perspective pinholeradtan",
        fisheye="equidistant fisheye kannalabrandt opencvfisheye",
    ),
)
_DISTORTION = r".*(distort\w*|coeff\w*)(?<!model|.type)"  # under whatever name
_COUNTS = (4, 5, 8, 12, 14)  # of coefficients in a list
_MOST = 100.0  # of the first coefficient; a focal length or a place in an image is more
COLMAP_MODELS = {
    "SIMPLE_PINHOLE": "f cx cy",
    "PINHOLE": "fx fy cx cy",
    "SIMPLE_RADIAL": "f cx cy k1",
    "RADIAL": "f cx cy k1 k2",
    "OPENCV": "fx fy cx cy k1 k2 p1 p2",
    "FULL_OPENCV": "fx fy cx cy k1 k2 p1 p2 k3 k4 k5 k6",
    "OPENCV_FISHEYE": "fx fy cx cy k1 k2 k3 k4",
    "SIMPLE_RADIAL_FISHEYE": "f cx cy k1",
    "RADIAL_FISHEYE": "f cx cy k1 k2",
}
_COLMAP_LINE = (
    r"(?am)^[ \t]*\d+[ \t]+([A-Z][A-Z_0-9]+)((?:[ \t]+[-+.\deE]+){3,})[ \t]*$"
)
_BY_IMAGES = message("camera-file.by-images")
_REMEDIES = {
    "by-images": _BY_IMAGES,
    "of-project": message("camera-file.of-project"),
    "of-pair": message("camera-file.of-pair"),
    "other-file": message("camera-file.other-file"),
    "ost-yaml": message("camera-file.ost-yaml"),
    "colmap-text": message("camera-file.colmap-text"),
    "camchain": message("camera-file.camchain"),
    "no-intrinsics": message("camera-file.no-intrinsics"),
}


def refuse_foreign(data: bytes, name: str) -> None:
    """Refuse the file of a program whose lens model or form is not read, by name."""
    program, way = foreign_program(data, "cameras")
    if program:
        remedy = _REMEDIES.get(way, message("camera-file.as-text"))
        raise FileError(
            "camera-file.foreign", name=name, program=program, remedy=remedy
        )


def colmap_tree(text: str, name: str) -> dict[str, Tree] | None:
    """Return the only camera of a ``cameras.txt`` of COLMAP; None of another file."""
    lines = re.findall(_COLMAP_LINE, text)
    if not lines:
        return None
    if len(lines) > 1:
        raise FileError("camera-file.several-cameras", name=name, n_cameras=len(lines))
    model, cells = lines[0]
    names = ["width", "height", *COLMAP_MODELS.get(model, "").split()]
    values = cells.split()
    if model in COLMAP_MODELS and len(values) != len(names):
        raise FileError(
            "camera-file.colmap-count",
            name=name,
            model=model,
            count=len(values) - 2,
            names=COLMAP_MODELS[model],
        )
    return {"colmap": model, **dict(zip(names, values, strict=False))}


def foreign_intrinsics(entries: Entries) -> Given | None:
    """Return the intrinsics in the layout of another program; None in no such layout.

    Raises `FileError` for a lens model that is not read, or if a number is missing.
    """
    layout = layout_of(entries)
    return None if layout is None else _given(layout, entries)


def layout_of(entries: Entries) -> FileLayout | None:
    """Return the layout whose marks a mapping has."""
    for layout in LAYOUTS:
        if all(_holder(entries, mark)[0] for mark in layout.marks.split()):
            return layout
    return None


def _given(layout: FileLayout, entries: Entries) -> Given:
    lens, stated = _lens(layout, entries)
    size = _size(layout.size.split(), entries)
    others = layout.of_fisheye if lens is KANNALA_BRANDT else {}
    named = _named(layout.numbers | others, entries)
    pinhole = _pinhole(named, size, layout, entries)
    if not any(name in named for name in _RADIAL.split()):
        named |= _usual_distortion(entries, lens)
    if lens is None and any(named.get(name) for name in _RADIAL.split()):
        raise _unread(layout, stated, entries)
    lens = lens or BROWN
    return Given(size, pinhole, _coefficients(named, lens), lens)


def _size(paths: list[str], entries: Entries) -> tuple[float, float]:
    if not paths:
        return image_size_of(entries)
    size = np.concatenate([_numbers(entries, path) for path in paths])
    if len(size) != 2:
        raise FileError("camera-file.no-size", name=entries.name)
    return size[0], size[1]


def image_size_of(entries: Entries) -> tuple[float, float]:
    """Return width and height of the images, px, under their usual names."""
    if entries.has(*_SIZE) and not entries.has(*_WIDTH):
        stated = entries.value(*_SIZE)
        if isinstance(stated, dict) and "data" not in stated:
            return image_size_of(entries.part(*_SIZE))
        width, height = entries.counted(2, *_SIZE)
        return width, height
    if not entries.has(*_WIDTH) or not entries.has(*_HEIGHT):
        raise FileError("camera-file.no-size", name=entries.name)
    return entries.counted(1, *_WIDTH)[0], entries.counted(1, *_HEIGHT)[0]


def _named(numbers: dict[str, str], entries: Entries) -> dict[str, float]:
    """Return the numbers at paths by their names here."""
    named: dict[str, float] = {}
    for path, names in numbers.items():
        values = _numbers(entries, path)
        if len(values) > len(names.split()):
            raise FileError(
                "entry.wrong-count",
                entry=path,
                name=entries.name,
                counted=message("count.numbers", count=len(values)),
                needed=len(names.split()),
            )
        named |= dict(zip(names.split(), values.tolist(), strict=False))
    return named


def _usual_distortion(entries: Entries, lens: LensModel | None) -> dict[str, float]:
    """Return the distortion under a usual name that the layout does not have."""
    names = "k1 k2 k3 k4" if lens is KANNALA_BRANDT else _RADIAL
    if entries.has(*DISTORTION):
        key, value = entries.entry(*DISTORTION)
        is_stated = isinstance(value, dict) and "data" not in value
        paths = _each(names, key + "/{}") if is_stated else {key: names}
    else:
        is_stated = any(
            re.fullmatch(_DISTORTION, plain) or _may_distort(entries, key)
            for plain, (key, _) in entries.values.items()
        )
        paths = {"radial_distortion|radial": "k1 k2 k3"}
        paths["tangential_distortion|tangential"] = "p1 p2"
        if all(0 < len(_numbers(entries, key)) < 4 for key in "kp"):
            paths = {"k": "k1 k2 k3", "p": "p1 p2"}
    found = _named(paths, entries)
    if is_stated and not found:
        raise FileError("camera-file.no-distortion", name=entries.name)
    return found


def _may_distort(entries: Entries, key: str) -> bool:
    """Return whether an entry may be coefficients: no whole numbers, pose or matrix."""
    for each in mappings(entries.value(key)):
        part = Entries.of(each, entries.name)
        if part.has("k1") or any(_may_distort(part, own) for own in each):
            return True
    try:
        numbers = entries.numbers(key)
    except FileError:
        return False
    if len(numbers) not in _COUNTS or np.array_equal(numbers, np.round(numbers)):
        return False
    # A row of a rotation, and a quaternion, have the length 1.
    length = np.linalg.norm(numbers[8:11] if len(numbers) == 12 else numbers)
    return bool(abs(numbers[0]) < _MOST) and round(float(length), 3) != 1


def _pinhole(
    named: dict[str, float],
    size: tuple[float, float],
    layout: FileLayout,
    entries: Entries,
) -> FloatArray:
    f = named.get(_FOCAL, named.get("fx"))
    if f is None:
        raise FileError("entry.missing", name=entries.name, entry=_FOCAL)
    check_skew(named.get("skew", 0.0), entries)
    fx = f + named.get("b1", 0.0)
    fy = named.get("fy", f * named.get("aspect", 1.0))
    centre = np.zeros(2)
    for i, (own, off) in enumerate((("cx", "dx"), ("cy", "dy"))):
        if own not in named and off not in layout.numbers.values():
            raise FileError("entry.missing", name=entries.name, entry=own)
        centre[i] = named.get(own, size[i] / 2 + named.get(off, 0.0)) - layout.first
    return np.array([fx, fy, *centre])


def _coefficients(named: dict[str, float], lens: LensModel) -> FloatArray:
    """Return coefficients as of OpenCV, with no more zeros than needed."""
    if lens is KANNALA_BRANDT:
        own = [named.get(name, 0.0) for name in ("k1", "k2", "k3")]
        last = named.get("r8", named.get("k4", 0.0))
        rest = [named.get(name, 0.0) for name in ("p1", "p2", "s1", "s2")]
        return np.array([*own, last, *(rest if any(rest) else ())])
    values = np.array([named.get(name, 0.0) for name in _RADIAL.split()])
    values[-1] += named.get("r8", 0.0)  # as little a part of the model as the tilt
    used = max(np.flatnonzero(values), default=0)
    return values[: next(n for n in (5, 8, 12, 14) if used < n)]


def _lens(layout: FileLayout, part: Entries) -> tuple[LensModel | None, str]:
    """Return the lens model, None without distortion, and its name in the file."""
    holder, key = _holder(part, layout.model)
    if holder is None:
        return layout.lens, ""
    stated = holder.word(key)
    plain = re.sub(r"[\W_]|rs2|distortion", "", stated.casefold())
    for lens, names in (
        (BROWN, layout.brown),
        (KANNALA_BRANDT, layout.fisheye),
        (None, layout.undistorted),
    ):
        if plain in names.split():
            return lens, stated
    raise _unread(layout, stated, part)


def _unread(layout: FileLayout, model: str, entries: Entries) -> FileError:
    return FileError(
        "camera-file.foreign-model",
        name=entries.name,
        program=layout.program,
        model=quoted(model),
        remedy=_BY_IMAGES,
    )


def _numbers(entries: Entries, path: str) -> FloatArray:
    """Return the numbers at a path; none if it is not there."""
    holder, key = _holder(entries, path)
    if holder is None:
        return np.zeros(0)
    value = holder.value(key)
    if isinstance(value, dict) and "width" in value and "height" in value:
        size = Entries.of(value, entries.name)
        return np.array([size.counted(1, side)[0] for side in ("width", "height")])
    return holder.numbers(key)


def _holder(entries: Entries, path: str) -> tuple[Entries | None, str]:
    """Return the mapping that has the entry of a path, and the entry's name."""
    for spelling in path.split("|"):
        *above, key = spelling.split("/")
        holder: Entries | None = entries
        for each in above:
            holder = _below(holder, each)
        if holder is not None and holder.has(key):
            return holder, key
    return None, path


def _below(entries: Entries | None, key: str) -> Entries | None:
    """Return the mapping of an entry, None without one; a list must be of one."""
    found = mappings(entries.value(key)) if entries and entries.has(key) else []
    if entries is None or not found:
        return None
    if len(found) > 1:
        raise FileError(
            "camera-file.several-cameras", name=entries.name, n_cameras=len(found)
        )
    return Entries.of(found[0], entries.name)


def mappings(value: Tree) -> list[dict[str, Tree]]:
    """Return the mapping that a value is, or those that it lists."""
    listed = value if isinstance(value, list) else [value]
    return [each for each in listed if isinstance(each, dict)]
