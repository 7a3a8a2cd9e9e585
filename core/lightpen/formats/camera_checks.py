"""What the intrinsics of a pinhole camera can be, whatever file they are in."""

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError, FileError
from lightpen.formats.entries import Entries
from lightpen.model.camera import Camera
from lightpen.sentences import Sentence, sentence

LARGEST_IMAGE = 100_000  # px, along a side
SMALLEST_FOCAL_LENGTH = 0.02  # of the image's longer side: 175 degrees are seen
LARGEST_ASPECT = 1.5  # of a pixel
FOLD_SAMPLES = 17  # along a side; a lens folds from the corners inwards
SKEW_TOLERANCE = 1e-6  # px; rounding, where the file has a skew of zero


def checked_size(size: tuple[float, float], name: str | Sentence) -> tuple[int, int]:
    """Return width and height of the images, px.

    Raises
    ------
    FileError
        No camera has such images.
    """
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


def check_pinhole(
    pinhole: FloatArray, width: int, height: int, name: str | Sentence
) -> None:
    """Refuse fx fy cx cy, px, that no camera with such images has.

    Raises
    ------
    FileError
        They are in other units, of other images, or no numbers of a camera at all.
    """
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


def check_skew(skew: float, entries: Entries) -> None:
    """Refuse pixels that are no rectangles; the skew in px.

    Raises
    ------
    FileError
        They are not.
    """
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


def checked_distortion(coefficients: FloatArray, entries: Entries) -> FloatArray:
    """Return 5 or 8 coefficients.

    Raises
    ------
    FileError
        There are as many as no model here has, or others than these are not zero.
    """
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


def check_fold(camera: Camera, entries: Entries) -> None:
    """Refuse a distortion that turns the image over before its corners.

    Raises
    ------
    FileError
        It does.
    """
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
