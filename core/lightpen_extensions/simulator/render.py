"""Irradiance on the sensor by LEDs and other lights."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple, Protocol, TypeAlias

import numpy as np
import numpy.typing as npt

from lightpen.arrays import FloatArray, IntArray
from lightpen.model.camera import Camera
from lightpen.model.pen import Pen
from lightpen_extensions.simulator.swings import faces_camera, leds_in_camera

PEAK = 205 / 255

# Exact images of blurred discs, from their contours alone.
#
# A disc D of even brightness, seen through an optics that blurs by a Gaussian g and
# integrated by square pixels b, gives the pixel at (x, y) the level
#
#     I(x, y) = (1_D * k)(x, y),    k(x, y) = (g * b)(x) (g * b)(y).
#
# With Q the integral of g * b, Green's theorem turns the area into the contour (x',
# y'):
#
#     I(x, y) = -+ closed integral of Q(x - x') (g * b)(y - y') dy'.
#
# The contour is projected through perspective and distortion exactly. The integrand is
# smooth on the scale of the blur, so the trapezoidal rule on the closed curve converges
# faster than any power of the spacing [1]_. The sum over the nodes is a product of two
# thin matrices, which is what makes it fast. Movement during the exposure is a mean
# over contours.
#
# References
# ----------
# .. [1] L. N. Trefethen, J. A. C. Weideman, "The exponentially convergent trapezoidal
#    rule", SIAM Review 56 (2014) 385-458.


LightArray: TypeAlias = npt.NDArray[np.float32]

MIN_SIGMA = 0.3  # px, below which a contour would need too many nodes
MIN_NODES = 128
SPACING = 1.1  # standard deviations of the blur between nodes: error below 1e-6
REACH = 5.0  # standard deviations after which the blur is nil
STEPS_PER_PIXEL = 4096  # of the tables of the blur


@dataclass(frozen=True, eq=False)
class Contours:
    """Closed outlines as nodes of the trapezoidal rule."""

    # (N, M, 2), on N outlines, px; the S contours of a moving disc follow each other
    nodes: FloatArray
    steps: FloatArray  # (N, M, 2), tangent times parameter step, px, divided by S


class Patch(NamedTuple):
    """A small image and its place in a large one."""

    levels: LightArray  # (h, w), 1 inside the outline
    top: int  # row and column of its first pixel
    left: int


def disc_contours(
    camera: Camera,
    centers_cam: FloatArray,
    normals_cam: FloatArray,
    radius: float,
    sigma: float,
) -> Contours:
    """Return the imaged contours of discs, moving or not.

    Centres, mm, and unit normals (S, N, 3) of N discs are in the camera frame at S
    times, the radius in mm; sigma is their Gaussian blur, px.
    """
    n_times = len(centers_cam)
    longest = 2 * np.pi * camera.fx * radius / centers_cam[..., 2].min()
    angles = node_angles(longest, sigma)
    across = orthogonal(normals_cam)[..., None, :]
    along = np.cross(normals_cam[..., None, :], across)
    cosine, sine = np.cos(angles)[:, None], np.sin(angles)[:, None]
    spokes = radius * (across * cosine + along * sine)
    tangents = radius * (along * cosine - across * sine)
    there = camera.project_with_jacobian(centers_cam[..., None, :] + spokes)
    steps = np.einsum("...ij,...j->...i", there.jacobian, tangents)
    steps *= 2 * np.pi / len(angles) / n_times
    return Contours(_in_a_row(there.points), _in_a_row(steps))


def blurred_insides(contours: Contours, sigma: float) -> list[Patch]:
    """Return the blurred, pixel-integrated inside of each outline.

    Sigma of the Gaussian blur is in px.
    """
    reach = REACH * sigma + 1
    lows = np.floor(contours.nodes.min(axis=1, initial=np.inf) - reach)
    highs = np.ceil(contours.nodes.max(axis=1, initial=-np.inf) + reach)
    sizes = (highs - lows).astype(int) + 1
    areas = np.einsum("nm,nm->n", contours.nodes[..., 0], contours.steps[..., 1])
    weights = (-np.sign(areas)[:, None] * contours.steps[..., 1]).astype(np.float32)
    tables = _blur_tables(sigma)
    patches = []
    for n, nodes in enumerate(contours.nodes - lows[:, None, :]):
        rows = _look_up(tables.pixel, nodes[:, 1], sizes[n, 1]) * weights[n]
        columns = _look_up(tables.step, nodes[:, 0], sizes[n, 0])
        left, top = lows[n].astype(int)
        patches.append(Patch(rows @ columns.T, int(top), int(left)))
    return patches


class _BlurTables(NamedTuple):
    """The blurred pixel g * b and its integral Q, sampled finely around 0."""

    pixel: LightArray
    step: LightArray


@lru_cache(maxsize=32)
def _blur_tables(sigma: float) -> _BlurTables:
    from scipy.special import ndtr  # takes 0.1 s

    half = int(np.ceil((REACH * sigma + 1) * STEPS_PER_PIXEL))
    reach = half + STEPS_PER_PIXEL // 2  # of the right or left edge of a pixel
    z = np.arange(-reach, reach + 1) / (STEPS_PER_PIXEL * sigma)
    normal = ndtr(z)
    density = np.exp(-0.5 * z * z) / np.sqrt(2 * np.pi)
    integral = sigma * (z * normal + density)
    pixel = normal[STEPS_PER_PIXEL:] - normal[:-STEPS_PER_PIXEL]
    step = integral[STEPS_PER_PIXEL:] - integral[:-STEPS_PER_PIXEL]
    return _BlurTables(pixel.astype(np.float32), step.astype(np.float32))


def _look_up(table: LightArray, nodes: FloatArray, size: int) -> LightArray:
    """Return the table at pixel minus node, shape (size, M) from nodes (M,)."""
    scaled = np.rint(nodes * STEPS_PER_PIXEL).astype(np.int32)
    pixels = np.arange(size, dtype=np.int32) * STEPS_PER_PIXEL + len(table) // 2
    index = pixels[:, None] - scaled
    return table.take(index, mode="clip")


def node_angles(longest: float, sigma: float) -> FloatArray:
    """Return the parameters of the nodes of a contour, rad, by its length, px."""
    n_nodes = max(MIN_NODES, int(np.ceil(longest / (SPACING * sigma))))
    return np.asarray(np.arange(n_nodes) * (2 * np.pi / n_nodes))


def orthogonal(normals: FloatArray) -> FloatArray:
    """Return a unit vector (..., 3) in the plane of each disc, by its unit normal."""
    flat = np.abs(normals[..., :1]) < 0.9
    helper = np.where(flat, np.array([1.0, 0, 0]), np.array([0, 1.0, 0]))
    across = np.cross(normals, helper)
    return np.asarray(across / np.linalg.norm(across, axis=-1, keepdims=True))


def _in_a_row(nodes: FloatArray) -> FloatArray:
    """Join the contours of each disc over time: (S, N, M, 2) to (N, S M, 2)."""
    n_times, n_discs, n_nodes, _ = nodes.shape
    return np.swapaxes(nodes, 0, 1).reshape(n_discs, n_times * n_nodes, 2)


@dataclass(frozen=True, eq=False)
class View:
    """View of the camera during one exposure."""

    rotations: FloatArray  # (S, 3, 3), cam_from_pen at S times, even in the exposure
    translations: FloatArray  # (S, 3), mm
    gains: FloatArray  # (L,), brightness of each LED, 0 if it is off
    others: "tuple[OtherLight, ...]" = ()


def even_discs(
    camera: Camera, pen: Pen, view: View, lit: IntArray, sigma: float
) -> list[Patch]:
    """Return the images of the LEDs with these indices as evenly lit discs."""
    leds, normals = leds_in_camera(pen, view.rotations, view.translations)
    contours = disc_contours(
        camera, leds[:, lit], normals[:, lit], pen.diameter / 2, sigma
    )
    return blurred_insides(contours, sigma)


DrawLeds: TypeAlias = Callable[[Camera, Pen, View, IntArray, float], list[Patch]]


@dataclass(frozen=True)
class Optics:
    """Brightness and sharpness of the image."""

    peak: float = PEAK  # of an LED of gain 1 seen head-on, fraction of full scale
    exposure: float = 1.0  # multiplies every light
    cos_power: float = 0.3  # of the level, by the cosine of the viewing angle
    psf_sigma: float = 0.8  # standard deviation of the Gaussian blur, px, at least 0.3
    draw_leds: DrawLeds = even_discs  # as `even_discs`, at most 1 where brightest

    def __post_init__(self) -> None:
        if self.psf_sigma < MIN_SIGMA:
            raise ValueError(
                f"`psf_sigma` must be at least {MIN_SIGMA} px, got {self.psf_sigma}."
            )


class Window(NamedTuple):
    """Rows ``top`` to ``bottom`` and columns ``left`` to ``right`` of an image."""

    top: int
    bottom: int
    left: int
    right: int

    @property
    def slices(self) -> tuple[slice, slice]:
        """Index of the window into an image."""
        return slice(self.top, self.bottom), slice(self.left, self.right)


class OtherLight(Protocol):
    """What adds light to an image of the pen, or takes some away."""

    def draw(self, levels: LightArray, optics: Optics) -> Sequence[Window]:
        """Draw it on the light (H, W), fraction of full scale, and return where."""


@dataclass(frozen=True, eq=False)
class Light:
    """Light on the sensor, before noise."""

    levels: LightArray  # (H, W), fraction of full scale
    windows: tuple[Window, ...]  # where levels are not zero; they may overlap


def render_view(camera: Camera, pen: Pen, view: View, optics: Optics) -> Light:
    """Return the light of one exposure."""
    levels = np.zeros((camera.height, camera.width), dtype=np.float32)
    windows = add_patches(levels, _led_patches(camera, pen, view, optics))
    for other in view.others:
        windows += other.draw(levels, optics)
    return Light(levels, tuple(windows))


def led_levels(
    leds_cam: FloatArray, normals_cam: FloatArray, optics: Optics
) -> FloatArray:
    """Return the level of every LED of gain 1, fraction of full scale, (..., L).

    Zero for those that face away.
    """
    ranges = np.linalg.norm(leds_cam, axis=-1)
    cosines = -np.einsum("...i,...i->...", leds_cam, normals_cam) / ranges
    peak = optics.peak * optics.exposure
    levels = peak * np.maximum(cosines, 0) ** optics.cos_power
    return np.where(faces_camera(leds_cam, normals_cam), levels, 0.0)


def _led_patches(camera: Camera, pen: Pen, view: View, optics: Optics) -> list[Patch]:
    leds, normals = leds_in_camera(pen, view.rotations, view.translations)
    levels = (view.gains * led_levels(leds, normals, optics)).min(axis=0)
    lit = np.flatnonzero(levels)
    if len(lit) == 0:
        return []
    patches = optics.draw_leds(camera, pen, view, lit, optics.psf_sigma)
    for patch, level in zip(patches, levels[lit], strict=True):
        patch.levels[:] *= np.float32(level)
    return patches


def add_patches(levels: LightArray, patches: list[Patch]) -> list[Window]:
    """Add patches to the light (H, W), and return where."""
    windows = []
    for patch in patches:
        top, left = patch.top, patch.left
        height, width = patch.levels.shape
        window = clipped(levels, Window(top, top + height, left, left + width))
        if window is not None:
            rows = slice(window.top - top, window.bottom - top)
            columns = slice(window.left - left, window.right - left)
            levels[window.slices] += patch.levels[rows, columns]
            windows.append(window)
    return windows


def clipped(levels: LightArray, window: Window) -> Window | None:
    """Return the part of a window that is within an image; None if it is outside."""
    height, width = levels.shape
    inside = Window(
        max(int(window.top), 0),
        min(int(window.bottom), height),
        max(int(window.left), 0),
        min(int(window.right), width),
    )
    empty = inside.top >= inside.bottom or inside.left >= inside.right
    return None if empty else inside
