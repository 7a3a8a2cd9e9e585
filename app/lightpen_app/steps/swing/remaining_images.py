"""Displayed number of remaining images, which does not increase slightly."""

from dataclasses import dataclass, replace
from math import ceil
from typing import Self

# Of the images to go: from so many on, rounded up to this.
STEPS = ((30, 10), (10, 5), (-1, 1))
LEAST_RISE = 2  # by which a small figure must be wrong before it is reported


@dataclass(frozen=True)
class RemainingImages:
    """Displayed number of remaining images.

    The estimate is renewed with each image and fluctuates. Its minimum is displayed,
    except after a significant rise and after images were dropped.

    Attributes
    ----------
    n_images : int
        Remaining images, rounded to the accuracy of the estimate.
    n_kept : int
        Number of images at the time of the estimate.
    fraction : float
        Of all images, that are there; it goes back only when images are dropped.
    has_risen : bool
        Whether more remain than were displayed before, though none were dropped.
    """

    n_images: int
    n_kept: int
    fraction: float
    has_risen: bool = False

    @classmethod
    def first(cls, n_more: int, n_kept: int) -> Self:
        """Return the first displayed number of a swing."""
        fraction = n_kept / max(n_kept + n_more, 1)
        return cls(in_true_steps(n_more), n_kept, fraction)

    def after(self, n_more: int, n_kept: int) -> Self:
        """Return the displayed number after the next estimate."""
        now = self.first(n_more, n_kept)
        if n_kept < self.n_kept:
            return now
        now = replace(now, fraction=max(now.fraction, self.fraction))
        if now.n_images < self.n_images:
            return now
        rise = now.n_images - self.n_images
        if rise > max(_step(self.n_images), LEAST_RISE):
            return replace(now, has_risen=True)
        return replace(now, n_images=self.n_images, has_risen=self.has_risen)


def in_true_steps(n_more: int) -> int:
    """Return the number rounded up to the accuracy of the estimate."""
    step = _step(n_more)
    return ceil(n_more / step) * step


def _step(n_more: int) -> int:
    return next(step for least, step in STEPS if n_more > least)
