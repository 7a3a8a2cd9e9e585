"""Recognition of the images that a pen or a camera was found from.

A file found from a swing (`lightpen_extensions.discover`) has used the information of
its images. A calibration of the same images starts from what was known before them, so
that this information counts once.
"""

from dataclasses import dataclass

import numpy as np

from lightpen.arrays import FloatArray

SAME = 0.02  # px, of one centre found twice in an image
MIN_SHARED = 5  # images; fewer count little
EXACT_SCALE = 1e-6  # relative, of a pen whose lengths are in its LED covariance
MARK_DIGITS = 3  # of a mark in a file, px


@dataclass(frozen=True, eq=False)
class FoundPen:
    """Prior knowledge of a pen that was found from images."""

    marks: FloatArray  # (M, 2), an LED centre of each of these images, px
    diameter: float  # of the LED discs, mm
    # (3 L, 3 L), of all LED coordinates, by the known lengths, mm^2
    led_covariance: FloatArray


@dataclass(frozen=True, eq=False)
class FoundCamera:
    """Prior knowledge of a camera that was found from images."""

    marks: FloatArray  # (M, 2), an LED centre of each of these images, px
    intrinsics: FloatArray  # (k,), as `Camera.intrinsics`
    covariance: FloatArray | None  # (k, k), None if it was not stated


def are_shared(marks: FloatArray, pixels: FloatArray) -> bool:
    """Return whether the marks occur in several images with centres (N, L, 2)."""
    n_shared = sum(
        bool(np.any(np.abs(image[:, None] - marks).max(axis=-1) < SAME))
        for image in pixels
    )
    return n_shared >= MIN_SHARED
