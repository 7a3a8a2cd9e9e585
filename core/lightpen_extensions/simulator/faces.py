"""Luminance patterns of real LEDs, and their images.

The face of an LED gives each point of its disc a brightness of 0 to 1. It is drawn
point by point: sub-pixels are traced back to the disc, and those that the contour
passes through count as the share of them that is inside.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt
from numpy.linalg import inv

from lightpen.arrays import FloatArray
from lightpen.model.camera import Camera
from lightpen.model.pen import Pen

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
    angles = _node_angles(longest, sigma)
    across = orthogonal(normals_cam)[..., None, :]
    along = np.cross(normals_cam[..., None, :], across)
    cosine, sine = np.cos(angles)[:, None], np.sin(angles)[:, None]
    spokes = radius * (across * cosine + along * sine)
    tangents = radius * (along * cosine - across * sine)
    there = camera.project_with_jacobian(centers_cam[..., None, :] + spokes)
    steps = np.einsum("...ij,...j->...i", there.jacobian, tangents)
    steps *= 2 * np.pi / len(angles) / n_times
    return Contours(_in_a_row(there.points), _in_a_row(steps))


def ellipse_contour(
    center: FloatArray, semi_axes: tuple[float, float], angle: float, sigma: float
) -> Contours:
    """Return the contour of one ellipse in the image.

    Centre (2,), semi-axes and the Gaussian blur sigma are in px; the angle is measured
    from the image's x axis to the first semi-axis, rad.
    """
    angles = _node_angles(2 * np.pi * max(semi_axes), sigma)
    cosine, sine = np.cos(angle), np.sin(angle)
    axes = np.array(semi_axes)[:, None] * np.array([[cosine, sine], [-sine, cosine]])
    spokes = np.stack([np.cos(angles), np.sin(angles)], axis=-1) @ axes
    tangents = np.stack([-np.sin(angles), np.cos(angles)], axis=-1) @ axes
    return Contours((center + spokes)[None], (2 * np.pi / len(angles) * tangents)[None])


def blurred_insides(contours: Contours, sigma: float, margin: int = 0) -> list[Patch]:
    """Return the blurred, pixel-integrated inside of each outline.

    Sigma of the Gaussian blur is in px, ``margin`` the number of dark pixels to add all
    round.
    """
    reach = REACH * sigma + 1 + margin
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


def _node_angles(longest: float, sigma: float) -> FloatArray:
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
