"""Displayed number of images of a swing, which does not follow each estimate."""

from dataclasses import dataclass, replace
from math import ceil
from typing import Self

# Of the images to go: from so many on, rounded up to this.
STEPS = ((30, 10), (10, 5), (-1, 1))
LEAST_ERROR = 2  # images; a smaller change of the estimate is not shown


@dataclass(frozen=True)
class RemainingImages:
    """Displayed number of images, in all and remaining.

    The estimate is renewed with each image and fluctuates. The displayed number in all
    stays until it is wrong by more than the accuracy of the estimate.
    """

    # Images at the end; the remaining ones are rounded to the accuracy of the estimate.
    n_in_all: int
    n_kept: int  # present images
    n_before: int  # remaining images at the last change of ``n_in_all``
    fraction: float  # of all images; decreases only when images are excluded
    # Whether the last change increased the number, although none were excluded.
    has_risen: bool = False

    @property
    def n_images(self) -> int:
        """Remaining images."""
        return self.n_in_all - self.n_kept

    @classmethod
    def first(cls, n_more: int, n_kept: int) -> Self:
        """Return the first displayed number of a swing."""
        n_images = in_true_steps(n_more)
        n_in_all = n_kept + n_images
        return cls(n_in_all, n_kept, n_images, n_kept / max(n_in_all, 1))

    def after(self, n_more: int, n_kept: int) -> Self:
        """Return the displayed number after the next estimate."""
        now = self.first(n_more, n_kept)
        if n_kept < self.n_kept:
            return now
        is_enough = n_kept + min(n_more, 1) <= self.n_in_all
        error = abs(n_kept + n_more - self.n_in_all)
        if is_enough and error <= max(_step(n_more), LEAST_ERROR):
            fraction = n_kept / max(self.n_in_all, 1)
            now = replace(self, n_kept=n_kept, fraction=fraction)
        else:
            now = replace(now, has_risen=now.n_before > self.n_before)
        return replace(now, fraction=max(now.fraction, self.fraction))


def in_true_steps(n_more: int) -> int:
    """Return the number rounded up to the accuracy of the estimate."""
    step = _step(n_more)
    return ceil(n_more / step) * step


def _step(n_more: int) -> int:
    return next(step for least, step in STEPS if n_more > least)
