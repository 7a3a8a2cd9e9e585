"""Foreign lights before the camera, and an image out of focus."""

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np

from lightpen.arrays import FloatArray
from lightpen_extensions.simulator.render import (
    PEAK,
    Contours,
    LightArray,
    Optics,
    Window,
    add_patches,
    blurred_insides,
    node_angles,
)

DEFOCUS_SAMPLES = 9  # per pixel and axis, of the defocus kernel


@dataclass(frozen=True, eq=False)
class Lamp:
    """A stray round light: an ellipse in the image."""

    center: FloatArray  # (2,), px
    semi_axes: tuple[float, float]  # px
    angle: float = 0.0  # of the first semi-axis from the image's x axis, rad
    level: float = PEAK  # fraction of full scale

    def draw(self, levels: LightArray, optics: Optics) -> list[Window]:
        """Add its light."""
        sigma = optics.psf_sigma
        contour = ellipse_contour(self.center, self.semi_axes, self.angle, sigma)
        [patch] = blurred_insides(contour, sigma)
        patch.levels[:] *= np.float32(self.level * optics.exposure)
        return add_patches(levels, [patch])


@dataclass(frozen=True)
class Backlight:
    """Light from behind, which may grow across the image."""

    level: float  # in the middle of the image, fraction of full scale
    gradient: tuple[float, float] = (0.0, 0.0)  # of it, over width and height

    def draw(self, levels: LightArray, optics: Optics) -> list[Window]:
        """Add its light to all of the image."""
        height, width = levels.shape
        across, down = self.gradient
        ramp = across * (np.arange(width) / width - 0.5)
        slope = down * (np.arange(height) / height - 0.5)
        behind = optics.exposure * np.maximum(self.level + ramp + slope[:, None], 0)
        levels += behind.astype(np.float32)
        return [_whole(levels)]


@dataclass(frozen=True)
class Defocus:
    """Spreads each point of what was drawn before over a disc."""

    radius: float  # px

    def draw(self, levels: LightArray, optics: Optics) -> list[Window]:
        """Blur all of the image."""
        border = cv2.BORDER_CONSTANT
        levels[:] = cv2.filter2D(
            levels, -1, _disc_kernel(self.radius), borderType=border
        )
        return [_whole(levels)]


def _whole(levels: LightArray) -> Window:
    height, width = levels.shape
    return Window(0, height, 0, width)


@lru_cache(maxsize=32)
def _disc_kernel(radius: float) -> LightArray:
    """Return a uniform disc; the weight of a pixel is its covered area."""
    half = int(np.ceil(radius))
    n_fine = (2 * half + 1) * DEFOCUS_SAMPLES
    fine = (np.arange(n_fine) + 0.5) / DEFOCUS_SAMPLES - half - 0.5
    inside = fine[:, None] ** 2 + fine**2 <= radius**2
    shape = (2 * half + 1, DEFOCUS_SAMPLES, 2 * half + 1, DEFOCUS_SAMPLES)
    covered = inside.reshape(shape).sum(axis=(1, 3))
    return np.asarray(covered / covered.sum(), dtype=np.float32)


def ellipse_contour(
    center: FloatArray, semi_axes: tuple[float, float], angle: float, sigma: float
) -> Contours:
    """Return the contour of one ellipse in the image.

    Centre (2,), semi-axes and the Gaussian blur sigma are in px; the angle is measured
    from the image's x axis to the first semi-axis, rad.
    """
    angles = node_angles(2 * np.pi * max(semi_axes), sigma)
    cosine, sine = np.cos(angle), np.sin(angle)
    axes = np.array(semi_axes)[:, None] * np.array([[cosine, sine], [-sine, cosine]])
    spokes = np.stack([np.cos(angles), np.sin(angles)], axis=-1) @ axes
    tangents = np.stack([-np.sin(angles), np.cos(angles)], axis=-1) @ axes
    return Contours((center + spokes)[None], (2 * np.pi / len(angles) * tangents)[None])
