"""Rectangles of pixels."""

from typing import NamedTuple

import cv2
from cv2.typing import MatLike


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

    def grown(self, margin: int, shape: tuple[int, ...]) -> "PixelBox":
        """Return the box with a margin, clipped to the image."""
        return PixelBox(
            max(self.left - margin, 0),
            max(self.top - margin, 0),
            min(self.right + margin, shape[1]),
            min(self.bottom + margin, shape[0]),
        )

    def moved(self, right: int, down: int) -> "PixelBox":
        """Return the box at another place."""
        return PixelBox(
            self.left + right, self.top + down, self.right + right, self.bottom + down
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
