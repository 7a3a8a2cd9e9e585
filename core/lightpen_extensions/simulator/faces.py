"""Luminance patterns of real LEDs, and their images.

The face of an LED gives each point of its disc a brightness of 0 to 1. It is drawn
point by point: sub-pixels are traced back to the disc, and those that the contour
passes through count as the share of them that is inside.
"""

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import numpy.typing as npt
from numpy.linalg import inv

from lightpen.arrays import FloatArray
from lightpen.model.camera import Camera
from lightpen.model.pen import Pen
from lightpen_extensions.simulator.contours import REACH, LightArray, Patch, orthogonal

SAMPLES = 4  # per pixel and axis
COARSE = 4  # px, over which distortion is linear to 1e-4 px
TINY = 1e-9


def _single(values: npt.ArrayLike) -> LightArray:
    """Return numbers in single precision."""
    return np.asarray(values, dtype=np.float32)


@dataclass(frozen=True)
class HotSpot:
    """A diffuser with a visible chip behind it."""

    place: tuple[float, float]  # middle of the spot on the disc, in radii
    width: float  # standard deviation of its Gaussian, in radii
    share: float  # fraction of the central brightness that the spot contributes

    def brightness(
        self, u: LightArray, v: LightArray, towards: FloatArray
    ) -> LightArray:
        """Return the brightness of points u, v of a disc of radius 1, in its axes.

        ``towards`` (3,) is the unit vector to the camera, in these axes and the normal.
        """
        x, y = self.place
        squares = (u - x) ** 2 + (v - y) ** 2
        spot = np.exp(squares * (-0.5 / self.width**2))
        return _single(1 - self.share + self.share * spot)


@dataclass(frozen=True)
class Dome:
    """A spherical cap on the disc with limb darkening.

    It hides nothing and stays within its contour, as a cap does that is seen by less
    than 90 degrees minus the slope at its contour.
    """

    height: float  # over the disc, in radii
    darkening: float  # share lost where the line of sight grazes it, linear

    def brightness(
        self, u: LightArray, v: LightArray, towards: FloatArray
    ) -> LightArray:
        """Return the brightness where lines of sight through the disc meet the dome.

        Parameters as of `HotSpot.brightness`.
        """
        radius = (1 + self.height**2) / (2 * self.height)
        x, y, z = towards.tolist()
        sunk = radius - self.height
        along = x * u + y * v + z * sunk
        # Half the chord of the line of sight over the radius: n . v where it ends.
        chord = along**2 - u**2 - v**2 - sunk**2 + radius**2
        slant = np.sqrt(np.clip(chord, 0, radius**2)) / radius
        return _single(1 - self.darkening * (1 - slant))


@dataclass(frozen=True)
class Ring:
    """A disc with a dark middle."""

    inner: float  # radius at which the brightness is half way, in radii
    softness: float  # width of the passage, in radii
    middle: float  # brightness of the middle

    def brightness(
        self, u: LightArray, v: LightArray, towards: FloatArray
    ) -> LightArray:
        """Return the brightness; parameters as of `HotSpot.brightness`."""
        passage = 0.5 + 0.5 * np.tanh((np.hypot(u, v) - self.inner) / self.softness)
        return _single(self.middle + (1 - self.middle) * passage)


Face: TypeAlias = HotSpot | Dome | Ring


def face_patches(
    camera: Camera,
    pen: Pen,
    rotations: FloatArray,
    translations: FloatArray,
    faces: tuple[Face, ...],
    lit: list[int],
    sigma: float,
    margin: int,
) -> list[Patch]:
    """Return the images of lit LEDs, blurred and integrated by the pixels.

    Rotations (S, 3, 3) and translations (S, 3), mm, are cam_from_pen at S times during
    the exposure; ``faces`` are the faces of all LEDs. Sigma of the Gaussian blur is in
    px, ``margin`` the number of dark pixels to add all round.
    """
    across = orthogonal(pen.normals)
    axes = np.stack([across, np.cross(pen.normals, across), pen.normals], axis=-1)
    centers = pen.leds @ np.swapaxes(rotations, -1, -2) + translations[:, None]
    return [
        _patch(
            camera,
            centers[:, led],
            rotations @ axes[led],
            pen.diameter / 2,
            faces[led],
            sigma,
            margin,
        )
        for led in lit
    ]


def _patch(
    camera: Camera,
    centers_cam: FloatArray,
    cam_from_disc: FloatArray,
    radius: float,
    face: Face,
    sigma: float,
    margin: int,
) -> Patch:
    """Return the mean image of a disc over the times of an exposure."""
    pixels = camera.project(centers_cam)
    reach = camera.fx * radius / centers_cam[:, 2].min() + REACH * sigma + 2 + margin
    left, top = np.floor(pixels.min(axis=0) - reach).astype(int)
    right, bottom = np.ceil(pixels.max(axis=0) + reach).astype(int) + 1
    columns, rows = _sub_pixels(left, right), _sub_pixels(top, bottom)
    x, y = _lines_of_sight(camera, columns, rows)
    light = np.zeros(x.shape, dtype=np.float32)
    for center, turn in zip(centers_cam, cam_from_disc, strict=True):
        light += _light(x, y, center, turn, radius, face) / np.float32(len(pixels))
    levels = _blur(rows, sigma) @ light @ _blur(columns, sigma).T
    return Patch(_single(levels), int(top), int(left))


def _sub_pixels(begin: int, end: int) -> FloatArray:
    return (np.arange((end - begin) * SAMPLES) + 0.5) / SAMPLES - 0.5 + begin


def _lines_of_sight(
    camera: Camera, columns: FloatArray, rows: FloatArray
) -> tuple[LightArray, LightArray]:
    """Return sub-pixels in the normalised plane, interpolated from a coarse grid."""
    x = np.arange(columns[0] - COARSE, columns[-1] + COARSE, COARSE)
    y = np.arange(rows[0] - COARSE, rows[-1] + COARSE, COARSE)
    grid = camera.unproject(np.stack(np.meshgrid(x, y), axis=-1))
    across, down = _between(columns, x), _between(rows, y)
    return _single(down @ grid[..., 0] @ across.T), _single(
        down @ grid[..., 1] @ across.T
    )


def _between(fine: FloatArray, coarse: FloatArray) -> FloatArray:
    """Return the weights of linear interpolation, (fine, coarse)."""
    gaps = np.abs(fine[:, None] - coarse) / COARSE
    return np.asarray(np.maximum(1 - gaps, 0))


def _blur(fine: FloatArray, sigma: float) -> LightArray:
    """Return the blur weights of sub-pixels in pixels, (n, fine)."""
    z = (fine[:, None] - fine) / sigma
    weights = np.exp(-0.5 * z * z) / (np.sqrt(2 * np.pi) * sigma * SAMPLES)
    return _single(weights.reshape(-1, SAMPLES, len(fine)).mean(axis=1))


def _light(
    x: LightArray,
    y: LightArray,
    center_cam: FloatArray,
    cam_from_disc: FloatArray,
    radius: float,
    face: Face,
) -> LightArray:
    """Return the brightness along each line of sight, 0 outside the disc."""
    plane = np.column_stack([radius * cam_from_disc[:, :2], center_cam])
    u, v, w = (_single(a) * x + _single(b) * y + _single(c) for a, b, c in inv(plane))
    u, v = u / w, v / w
    rho = np.hypot(u, v)
    steps = np.hypot(*np.gradient(rho))
    inside = np.clip(0.5 + (1 - rho) / np.maximum(steps, TINY), 0, 1)
    towards = -center_cam @ cam_from_disc / np.linalg.norm(center_cam)
    return _single(inside * face.brightness(u, v, towards))
