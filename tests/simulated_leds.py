"""Luminance patterns of real LEDs, what scatters their light, and their images.

The face of an LED gives each point of its disc a brightness of 0 to 1. It is drawn
point by point: sub-pixels are traced back to the disc, and those that the contour
passes through count as the share of them that is inside.
"""

from dataclasses import dataclass, replace
from typing import TypeAlias

import cv2
import numpy as np
import numpy.typing as npt
from numpy.linalg import inv

from lightpen.arrays import FloatArray, IntArray
from lightpen.model.camera import Camera
from lightpen.model.pen import Pen
from lightpen_extensions.simulator.image_plans import stream
from lightpen_extensions.simulator.render import (
    REACH,
    LightArray,
    Patch,
    View,
    even_discs,
    orthogonal,
)
from lightpen_extensions.simulator.scenes import Scene

SAMPLES = 4  # per pixel and axis
COARSE = 4  # px, over which distortion is linear to 1e-4 px
TINY = 1e-9
HALO_SIGMA, BOARD_SIGMA = 15.0, 2.0  # px
HALO_REACH = 3.0  # standard deviations; zero beyond
GHOST_OFFSET, BOARD_OFFSET = (9, 4), (1, 8)  # px, right and down
HOT_DISTANCE = (0.15, 0.45)  # of a hot spot from the middle, in radii
HOT_WIDTH, HOT_SHARE = (0.3, 0.5), (0.3, 0.7)
_FACES = 5  # its stream of the seed of a scene


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


@dataclass(frozen=True)
class RealLeds:
    """Draws LEDs as they are, as `even_discs` draws even ones."""

    faces: tuple[Face, ...] = ()  # of each LED; empty for evenly lit ones
    halo: float = 0.0  # share of the light of each LED that is scattered round it
    ghost: float = 0.0  # share that the filter reflects to `GHOST_OFFSET` beside
    board: float = 0.0  # share that the board reflects, blurred, `BOARD_OFFSET` beside

    def __call__(
        self, camera: Camera, pen: Pen, view: View, lit: IntArray, sigma: float
    ) -> list[Patch]:
        """Return the images of the LEDs with these indices."""
        if not self.faces:
            patches = even_discs(camera, pen, view, lit, sigma)
        else:
            rotations, translations = view.rotations, view.translations
            across = orthogonal(pen.normals)
            axes = np.stack([across, np.cross(pen.normals, across), pen.normals], -1)
            centers = pen.leds @ np.swapaxes(rotations, -1, -2) + translations[:, None]
            patches = [
                _patch(
                    camera,
                    centers[:, led],
                    rotations @ axes[led],
                    pen.diameter / 2,
                    self.faces[led],
                    sigma,
                )
                for led in lit
            ]
        return [self._scattered(patch) for patch in patches]

    def _scattered(self, patch: Patch) -> Patch:
        """Return a patch with halo, ghost image and reflection."""
        if self.halo == 0 and self.ghost == 0 and self.board == 0:
            return patch
        margin = int(max(HALO_REACH * HALO_SIGMA, *GHOST_OFFSET))
        sharp = np.pad(patch.levels, margin)
        levels = sharp * np.float32(1 - self.halo - self.ghost - self.board)
        levels += np.float32(self.halo) * _blurred(sharp, HALO_SIGMA)
        across, down = GHOST_OFFSET
        levels[down:, across:] += np.float32(self.ghost) * sharp[:-down, :-across]
        across, down = BOARD_OFFSET
        reflected = _blurred(sharp, BOARD_SIGMA)
        levels[down:, across:] += np.float32(self.board) * reflected[:-down, :-across]
        return Patch(levels, patch.top - margin, patch.left - margin)


def _blurred(light: LightArray, sigma: float) -> LightArray:
    border = cv2.BORDER_CONSTANT
    return _single(cv2.GaussianBlur(light, (0, 0), sigma, borderType=border))


LEDS = ("even", "hot-spot", "dome", "ring", "halo", "ghost", "board")


def with_leds(scene: Scene, leds: str) -> Scene:
    """Return a scene with LEDs of a kind of `LEDS`."""
    n_leds = scene.pen.n_leds
    domes = (Dome(height=0.35, darkening=0.75),) * n_leds
    match leds:
        case "even":
            return scene
        case "hot-spot":
            rng = stream(scene, _FACES)
            drawn = RealLeds(tuple(_random_hot_spot(rng) for _ in range(n_leds)))
        case "dome":
            drawn = RealLeds(domes)
        case "ring":
            drawn = RealLeds((Ring(inner=0.55, softness=0.12, middle=0.15),) * n_leds)
        case "halo":
            drawn = RealLeds(halo=0.15)
        case "ghost":
            drawn = RealLeds(ghost=0.03)
        case "board":
            drawn = RealLeds(domes, halo=0.1, board=0.1)
        case _:
            raise ValueError(f"`leds` must be one of {LEDS}, got {leds!r}.")
    return replace(scene, optics=replace(scene.optics, draw_leds=drawn))


def _random_hot_spot(rng: np.random.Generator) -> HotSpot:
    distance, direction = rng.uniform(*HOT_DISTANCE), rng.uniform(0, 2 * np.pi)
    place = distance * np.cos(direction), distance * np.sin(direction)
    return HotSpot(place, rng.uniform(*HOT_WIDTH), rng.uniform(*HOT_SHARE))


def _patch(
    camera: Camera,
    centers_cam: FloatArray,
    cam_from_disc: FloatArray,
    radius: float,
    face: Face,
    sigma: float,
) -> Patch:
    """Return the mean image of a disc over the times of an exposure."""
    pixels = camera.project(centers_cam)
    reach = camera.fx * radius / centers_cam[:, 2].min() + REACH * sigma + 2
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
