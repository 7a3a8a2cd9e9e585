"""Exact images of blurred discs, from their contours alone.

A disc D of even brightness, seen through an optics that blurs by a Gaussian g and
integrated by square pixels b, gives the pixel at (x, y) the level

    I(x, y) = (1_D * k)(x, y),    k(x, y) = (g * b)(x) (g * b)(y).

With Q the integral of g * b, Green's theorem turns the area into the contour (x', y'):

    I(x, y) = -+ closed integral of Q(x - x') (g * b)(y - y') dy'.

The contour is projected through perspective and distortion exactly. The integrand is
smooth on the scale of the blur, so the trapezoidal rule on the closed curve converges
faster than any power of the spacing [1]_. The sum over the nodes is a product of two
thin matrices, which is what makes it fast. Movement during the exposure is a mean over
contours.

References
----------
.. [1] L. N. Trefethen, J. A. C. Weideman, "The exponentially convergent trapezoidal
   rule", SIAM Review 56 (2014) 385-458.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from lightpen.arrays import FloatArray
from lightpen.model.camera import Camera

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


@dataclass(frozen=True, eq=False)
class Outlines:
    """Areas and centroids of outlines."""

    areas: FloatArray  # (N,), px^2
    centroids: FloatArray  # (N, 2), px


def measure_insides(contours: Contours) -> Outlines:
    """Return exact areas and centroids of outlines, by Green's theorem."""
    middles = contours.nodes.mean(axis=1, keepdims=True)
    x, y = np.moveaxis(contours.nodes - middles, -1, 0)
    dy = contours.steps[..., 1]
    areas = (x * dy).sum(axis=-1)
    moments = np.stack([(x * x * dy / 2).sum(axis=-1), (x * y * dy).sum(axis=-1)], -1)
    return Outlines(np.abs(areas), middles[:, 0] + moments / areas[:, None])


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
