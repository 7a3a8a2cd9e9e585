"""Checks of the intrinsics in a file, before they are believed."""

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.errors import FileError
from lightpen.formats.entries import Entries
from lightpen.messages import Message, message
from lightpen.model.camera import Camera, LensModel
from lightpen.model.fisheye import N_COEFFICIENTS

LARGEST_IMAGE = 100_000  # px, along a side
SMALLEST_FOCAL_LENGTH = 0.02  # of the image's longer side: 175 degrees are seen
LARGEST_ASPECT = 1.5  # of a pixel
LARGEST_FOLD = 0.5  # of the image; corners that no view reached fold in many real files
SKEW_TOLERANCE = 0.05  # px; a third of it at the edge of a usual image


def checked_size(size: tuple[float, float], name: str | Message) -> tuple[int, int]:
    """Return width and height of the images, px; refuse implausible ones."""
    for side in size:
        if side != round(side) or not 0 < side <= LARGEST_IMAGE:
            raise FileError(
                "camera-file.image-size",
                name=name,
                width=size[0],
                height=size[1],
                most=LARGEST_IMAGE,
            )
    return int(size[0]), int(size[1])


def check_pinhole(
    pinhole: FloatArray, width: int, height: int, name: str | Message
) -> None:
    """Refuse implausible fx fy cx cy, px, as of other units or other images."""
    fx, fy, cx, cy = pinhole
    if fx <= 0 or fy <= 0:
        raise FileError("camera-file.focal-length-sign", name=name, fx=fx, fy=fy)
    if min(fx, fy) < SMALLEST_FOCAL_LENGTH * max(width, height):
        raise FileError(
            "camera-file.focal-length-short",
            name=name,
            fx=fx,
            fy=fy,
            width=width,
            height=height,
        )
    if max(fx, fy) > LARGEST_ASPECT * min(fx, fy):
        raise FileError("camera-file.focal-lengths-differ", name=name, fx=fx, fy=fy)
    if abs(cx - width / 2) > width or abs(cy - height / 2) > height:
        raise FileError(
            "camera-file.principal-point",
            name=name,
            cx=cx,
            cy=cy,
            width=width,
            height=height,
        )


def check_skew(skew: float, entries: Entries) -> None:
    """Refuse a skew, px, that shifts points by more than lenses are uncertain."""
    if abs(skew) > SKEW_TOLERANCE:
        raise FileError("camera-file.skew", name=entries.name, skew=skew)


def checked_distortion(
    coefficients: FloatArray, entries: Entries, lens: LensModel = LensModel.BROWN
) -> FloatArray:
    """Return 5 or 8 coefficients, or the 4 of a fisheye; refuse others unless zero."""
    count = len(coefficients)
    given = [each for _, each in entries.values.values()]
    lists = [each.get("data") if isinstance(each, dict) else each for each in given]
    model = entries.word("distortion_model")
    if count == 0 and (model == "none" or (model and [] in lists)):
        return np.zeros(5 if lens is LensModel.BROWN else N_COEFFICIENTS)
    is_fisheye = lens is LensModel.KANNALA_BRANDT
    if is_fisheye and count == N_COEFFICIENTS:
        return coefficients
    if is_fisheye or count not in (4, 5, 8, 12, 14):
        counted = (
            message("count.one-distortion-coefficient")
            if count == 1
            else message("count.distortion-coefficients", count=count)
        )
        if is_fisheye:
            raise FileError(
                "camera-file.fisheye-count", name=entries.name, counted=counted
            )
        raise FileError(
            "camera-file.distortion-count", name=entries.name, counted=counted
        )
    if np.any(coefficients[8:]):
        raise FileError("camera-file.distortion-terms", name=entries.name, count=count)
    return np.append(coefficients, 0.0) if count == 4 else coefficients[:8]


def check_fold(camera: Camera, entries: Entries) -> None:
    """Refuse a distortion that is not invertible in much of the image."""
    if camera.folded_share > LARGEST_FOLD:
        raise FileError(
            "camera-file.fold",
            name=entries.name,
            width=camera.width,
            height=camera.height,
        )


def check_window(
    camera: Camera,
    roi: tuple[int, int, int, int] | None,
    binning: tuple[int, int],
    name: str | Message,
) -> None:
    """Refuse a region x y width height, px, or a binning that no image can have."""
    x, y, width, height = roi or (0, 0, *camera.image_size)
    is_inside = x + width <= camera.width and y + height <= camera.height
    if not is_inside or width < binning[0] or height < binning[1]:
        raise FileError(
            "camera-file.window",
            name=name,
            roi=f"{x} {y} {width} {height}",
            columns=binning[0],
            lines=binning[1],
            width=camera.width,
            height=camera.height,
        )
