"""Rectangles of pixels."""

from dataclasses import dataclass
from typing import NamedTuple, TypeAlias, TypeVar

import cv2
import numpy as np
import numpy.typing as npt
from cv2.typing import MatLike

from lightpen.arrays import FloatArray, Image, IntArray
from lightpen.model.camera import Camera
from lightpen.model.pen import Pen

Reals: TypeAlias = npt.NDArray[np.float32]
Scalar = TypeVar("Scalar", bound=np.generic)


class PixelBox(NamedTuple):
    """A rectangle of pixels, ends excluded."""

    left: int
    top: int
    right: int
    bottom: int

    @property
    def size(self) -> int:
        """The longer side, px."""
        return max(self.right - self.left, self.bottom - self.top)

    @property
    def area(self) -> int:
        """Number of pixels."""
        return (self.right - self.left) * (self.bottom - self.top)

    def of(self, image: npt.NDArray[Scalar]) -> npt.NDArray[Scalar]:
        """Return this part of an image."""
        return image[self.top : self.bottom, self.left : self.right]

    def grown(self, margin: int, shape: tuple[int, ...]) -> "PixelBox":
        """Return the box with a margin, clipped to the image."""
        return PixelBox(
            max(self.left - margin, 0),
            max(self.top - margin, 0),
            min(self.right + margin, shape[1]),
            min(self.bottom + margin, shape[0]),
        )

    def holds_center_of(self, other: "PixelBox") -> bool:
        """Return whether the centre of the other box is inside."""
        return (
            2 * self.left <= other.left + other.right <= 2 * self.right
            and 2 * self.top <= other.top + other.bottom <= 2 * self.bottom
        )

    def is_close_to(self, other: "PixelBox") -> bool:
        """Return whether no side differs by more than 2 px and a tenth of the size."""
        tolerance = 2 + other.size // 10
        return all(abs(a - b) <= tolerance for a, b in zip(self, other, strict=True))

    def overlap(self, other: "PixelBox") -> int:
        """Return the number of common pixels."""
        width = min(self.right, other.right) - max(self.left, other.left)
        height = min(self.bottom, other.bottom) - max(self.top, other.top)
        return max(width, 0) * max(height, 0)


def bounding_box(contour: MatLike, step: int = 1) -> PixelBox:
    """Return the box of a contour that was found on every `step`-th pixel."""
    x, y, width, height = cv2.boundingRect(contour)
    return PixelBox(
        x * step, y * step, (x + width - 1) * step + 1, (y + height - 1) * step + 1
    )


def stacked(image: Image, frames: IntArray) -> Reals:
    """Return windows (N, 4) of an image, dark below and beside each, to part them."""
    width, height = 1 + (frames[:, 2:] - frames[:, :2]).max(axis=0)
    stack = np.zeros((len(frames), height, width), np.float32)
    for slot, (left, top, right, bottom) in zip(stack, frames.tolist(), strict=True):
        slot[: bottom - top, : right - left] = image[top:bottom, left:right]
    return stack


@dataclass(frozen=True, eq=False)
class RegionOfInterest:
    """Camera, pen and mask for the detection in images."""

    camera: Camera | None = None  # intrinsics, if they are known
    pen: Pen | None = None
    # (M, 3), circles of stray light to leave out: centre x, y and radius, px
    mask: FloatArray | None = None
    # Regions in the images of the other cameras of a rig.
    others: tuple["RegionOfInterest", ...] = ()

    @property
    def regions(self) -> tuple["RegionOfInterest", ...]:
        """The same for each camera."""
        return (self, *self.others)
