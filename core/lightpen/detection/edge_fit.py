"""The outline of a disc that is not evenly lit, from its rim alone.

Inside its rim a real LED has a hot spot, a dark middle, or a dome whose bright part
moves with the view. Its outline is the disc's all the same. Along a ray across the rim,
s px outwards from it, a disc of local brightness ``p0 + p1 s + p2 s^2``, blurred by a
Gaussian of standard deviation sigma, gives the light

    I(s) = b + p0 M0 + p1 M1 + p2 M2,    Mk(s) = integral over t < 0 of t^k g(s - t),

with ``M0 = Phi``, ``M1 = s Phi - sigma^2 g`` and ``M2 = (s^2 + sigma^2) Phi - s sigma^2
g``, where Phi is the share of the blur that lies inside. A rim that is d px further out
adds ``p0 g d``, since the derivatives of M1 and M2 are among the functions already; a
wider blur adds ``p0 s g / sigma`` per px. So each ray tells d by linear least squares
with its own b, p0, p1, p2, and all rays of a disc share one matrix. The ellipse follows
the d of all rays; a few rounds lead to the rim [1]_.

Where d stays off the ellipse something hides the disc, or merges with it.

References
----------
.. [1] M. Hagara, P. Kulla, "Edge detection with sub-pixel accuracy based on
   approximation of edge with Erf function", Radioengineering 20 (2011) 516-524: the
   edge of an even plateau.
"""

from functools import lru_cache
from math import hypot, log, pi, sqrt
from typing import NamedTuple

import numpy as np

from lightpen.arrays import FloatArray, Image
from lightpen.model.quantiles import normal_quantile

STEP = 0.5  # px between samples of a ray
RAY_SPACING = 2.0  # px along the rim
BESIDE = 0.5  # px from a ray to the lines that are read for it
MIN_RAYS, MAX_RAYS = 32, 128
# The unknowns of a ray are b, p0, p1, p0 d, p0 dsigma and p2. From afar p2 would lead
# astray; in the end the blur is held.
SHARPNESS = 4
ROUNDS = 3 * [[0, 1, 2, 3, 4]] + 2 * [[0, 1, 2, 3, 4, 5]] + 2 * [[0, 1, 2, 3, 5]]
LONGEST_STEP = 1.5  # px, of the rim in one round
CONVERGED = 0.05  # px
INSIDE, OUTSIDE = 3.0, 3.0  # reach of a ray in standard deviations of the blur
MORE_INSIDE, MORE_OUTSIDE = 2.5, 1.0  # px beyond that
MAX_INSIDE = 0.5  # of the shorter semi-axis: deeper, brightness is no parabola
MIN_INSIDE = 3.5  # standard deviations of the blur: less tells little from it
DEEPEST = 0.8  # of the shorter semi-axis, whatever the blur
MIN_SIGMA = 0.4  # px
MAX_SIGMA = 0.3  # of the shorter semi-axis, beyond which blur hides the rim
MIN_SEMI_AXIS = 4.0  # px
LARGEST_SHARPENING = 0.3  # of the blur in one round
START_SIGMA = 0.7  # of the blur that all rays together seem to have
HALF_WIDTH = sqrt(2 * log(2))  # of a Gaussian at half its height, standard deviations
SMOOTHED = 7  # rays whose mean tells the brightness at one
BRIGHTEST = 1.5  # times the usual brightness: brighter rays count no more
DARK = 0.1  # of the usual brightness inside the rim, which tells no place of it

# A sliver of 1 px off a disc of 42 px leaves 0.5 px.
MAX_DENT = 0.15  # px, of three neighbouring rays off the ellipse
MAX_RELATIVE_DENT = 0.015  # of the shorter semi-axis
DENT_SIGMAS = 3.5


class EdgeFit(NamedTuple):
    """The outline of a disc.

    Attributes
    ----------
    center : (2,) array
        px.
    shape : (2, 2) array
        Covariance of the area, px^2; eigenvalues a^2 / 4 and b^2 / 4.
    sigma : float
        Standard deviation of the blur, px.
    is_whole : bool
        Whether no part of the rim lies off the ellipse, nor is missing.
    """

    center: FloatArray
    shape: FloatArray
    sigma: float
    is_whole: bool


class _Ellipse(NamedTuple):
    """The points ``center + root u`` for unit vectors u; an array each."""

    center: FloatArray
    root: FloatArray

    @property
    def semi_axes(self) -> tuple[float, float]:
        """Semi-axes, the longer first, px."""
        (a, b), (c, d) = self.root.tolist()
        sum_of_both = hypot(a + d, b - c)
        difference = hypot(a - d, b + c)
        return (sum_of_both + difference) / 2, abs(sum_of_both - difference) / 2


class _Rays(NamedTuple):
    """Where rays cross an ellipse, and how its parameters move the crossings.

    Attributes
    ----------
    feet, normals : (N, 2) array
        Crossings, px, and the unit normals there, outwards.
    moves : (N, 5) array
        Movement along the normal, px, by the centre, px, and by relative changes of the
        size and of the two ways to stretch it.
    """

    feet: FloatArray
    normals: FloatArray
    moves: FloatArray


class _Edges(NamedTuple):
    """Edge positions along rays.

    Attributes
    ----------
    places : (N,) array
        Of the edge along the ray, px from its foot.
    weights : (N,) array
    blur : float
        By how much the blur is wider than supposed, px.
    is_dark : bool
        Whether rays meet no light inside the rim.
    """

    places: FloatArray
    weights: FloatArray
    blur: float
    is_dark: bool


def fit_edge(image: Image, center: FloatArray, shape: FloatArray) -> EdgeFit | None:
    """Fit the rim of a disc by its edge alone.

    Parameters
    ----------
    image : (H, W) array
        The whole image.
    center : (2,) array
        Of the region to begin with, px.
    shape : (2, 2) array
        Covariance of its area, px^2.

    Returns
    -------
    Rim or None
        None where no sharp enough rim is found. The area is that of the rim, not
        lessened by blur.
    """
    if np.linalg.eigvalsh(4 * shape)[0] < MIN_SEMI_AXIS**2:
        return None
    ellipse = _Ellipse(center, np.asarray(np.linalg.cholesky(4 * shape)))
    ellipse, sigma = _onto_steepest(image, ellipse)
    for n, unknowns in enumerate(ROUNDS, start=1):
        _, shorter = ellipse.semi_axes
        if not shorter > MIN_SEMI_AXIS:
            return None
        sigma = min(max(sigma, MIN_SIGMA), MAX_SIGMA * shorter)
        rays = _rays(ellipse)
        edges = _edges(image, rays, sigma, shorter, unknowns)
        if edges is None:
            return None
        step = _step(rays, edges.places, edges.weights)
        moves = rays.moves @ step
        longest = float(np.abs(moves).max())
        if n == len(ROUNDS) and sigma < MAX_SIGMA * shorter:
            is_even = not edges.is_dark and _is_even(edges.places - moves, shorter)
            return _rim(ellipse, sigma, is_even and longest < CONVERGED)
        ellipse = _moved(ellipse, step * min(1.0, LONGEST_STEP / max(longest, 1e-9)))
        sigma += edges.blur
    return None


def _rim(ellipse: _Ellipse, sigma: float, is_whole: bool) -> EdgeFit:
    shape = ellipse.root @ ellipse.root.T / 4
    # Blur pulls the half level of a convex rim inwards, by sigma^2 over its diameter.
    growth = sigma**2 / (4 * sqrt(np.linalg.det(shape)))
    return EdgeFit(ellipse.center, shape * (1 + growth), sigma, is_whole)


def _rays(ellipse: _Ellipse) -> _Rays:
    longer, _ = ellipse.semi_axes
    n_rays = 4 * round(min(max(2 * pi * longer / RAY_SPACING, MIN_RAYS), MAX_RAYS) / 4)
    arms, stretching = _arms(n_rays)
    spokes = arms @ ellipse.root.T
    normals = arms @ np.linalg.inv(ellipse.root)
    normals /= np.sqrt(np.einsum("ri,ri->r", normals, normals))[:, None]
    lengths = np.einsum("ri,ri->r", spokes, normals)
    moves = np.empty((n_rays, 5))
    moves[:, :2] = normals
    moves[:, 2:] = lengths[:, None] * stretching
    return _Rays(ellipse.center + spokes, normals, moves)


@lru_cache(maxsize=MAX_RAYS // 4)
def _arms(n_rays: int) -> tuple[FloatArray, FloatArray]:
    """Return unit vectors all round, (N, 2), and the ways to stretch there, (N, 3)."""
    angles = 2 * pi / n_rays * np.arange(n_rays)
    arms = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    ways = [np.ones(n_rays), np.cos(2 * angles), np.sin(2 * angles)]
    return arms, np.stack(ways, axis=-1)


def _moved(ellipse: _Ellipse, step: FloatArray) -> _Ellipse:
    x, y, size, along, across = step.tolist()
    stretch = np.array([[1 + size + along, across], [across, 1 + size - along]])
    return _Ellipse(ellipse.center + np.array([x, y]), ellipse.root @ stretch)


def _step(rays: _Rays, places: FloatArray, weights: FloatArray) -> FloatArray:
    """Return the change of an ellipse that follows places along its rays best."""
    weighted = rays.moves * weights[:, None]
    normal, right = weighted.T @ rays.moves, weighted.T @ places
    return np.asarray(np.linalg.solve(normal, right))


def _edges(
    image: Image, rays: _Rays, sigma: float, shorter_axis: float, unknowns: list[int]
) -> _Edges | None:
    """Return the edges along rays, None without light inside."""
    deepest = max(MAX_INSIDE * shorter_axis, MIN_INSIDE * sigma)
    inside = min(INSIDE * sigma + MORE_INSIDE, deepest, DEEPEST * shorter_axis)
    s = np.arange(-inside, OUTSIDE * sigma + MORE_OUTSIDE, STEP)
    functions = _functions(s, sigma, shorter_axis)[:, unknowns]
    inverse = functions @ np.linalg.inv(functions.T @ functions)
    fitted = _profiles(image, rays, s) @ inverse
    brightness = _smooth(fitted[:, 1], SMOOTHED)
    usual = float(brightness.mean())
    if not usual > 0:
        return None
    lit = brightness > DARK * usual
    divisor = np.where(lit, brightness, usual)
    places = np.clip(np.where(lit, fitted[:, 3] / divisor, 0.0), -inside, inside)
    weights = np.minimum(np.maximum(brightness / usual, DARK), BRIGHTEST) ** 2
    blur = 0.0
    if SHARPNESS in unknowns:
        blurs = np.clip(fitted[:, 4] / divisor, -1, 1)
        blur = float(weights @ blurs / weights.sum())
        blur = max(blur, -LARGEST_SHARPENING * sigma)
    return _Edges(places, weights, blur, is_dark=not lit.all())


def _smooth(values: FloatArray, n_rays: int) -> FloatArray:
    """Return the means of so many neighbouring rays round the rim."""
    reach = n_rays // 2
    wrapped = np.concatenate([values[-reach:], values, values[:reach]])
    return np.convolve(wrapped, np.full(n_rays, 1 / n_rays), mode="valid")


def _profiles(image: Image, rays: _Rays, s: FloatArray) -> FloatArray:
    """Return the light along the rays at distances s from their feet, (N, S).

    It is the mean of two lines, so that hardly a pixel is passed over.
    """
    height, width = image.shape
    beside = BESIDE * rays.normals[:, ::-1] * np.array([-1.0, 1.0])
    feet = np.stack([rays.feet - beside, rays.feet + beside])
    x, y = (feet[..., k, None] + rays.normals[:, k, None] * s for k in range(2))
    x = np.minimum(np.maximum(x, 0.0), width - 1.001)
    y = np.minimum(np.maximum(y, 0.0), height - 1.001)
    column, row = x.astype(np.int64), y.astype(np.int64)
    x -= column
    y -= row
    left = 1 - x
    flat, at = image.reshape(-1), row * width + column
    above = flat.take(at) * left + flat.take(at + 1) * x
    at += width
    below = flat.take(at) * left + flat.take(at + 1) * x
    light = above * (1 - y) + below * y
    return np.asarray(0.5 * (light[0] + light[1]))


def _functions(s: FloatArray, sigma: float, shorter_axis: float) -> FloatArray:
    """Return the light along a ray by b, p0, p1, p0 d, p0 dsigma and p2, (S, 6)."""
    from scipy.special import ndtr  # takes 0.1 s

    z = s / sigma
    share = ndtr(-z)
    g = np.exp(-0.5 * z * z) / (sqrt(2 * pi) * sigma)
    slope = (s * share - sigma**2 * g) / shorter_axis
    bend = ((s * s + sigma**2) * share - s * sigma**2 * g) / shorter_axis**2
    return np.stack([np.ones_like(s), share, slope, g, g * z, bend], axis=-1)


def _onto_steepest(image: Image, ellipse: _Ellipse) -> tuple[_Ellipse, float]:
    """Return the ellipse grown to where the light falls most, and the blur there.

    The side of the fall that is outside tells the blur: nothing else shines there.
    """
    _, shorter = ellipse.semi_axes
    s = np.arange(-MAX_INSIDE * shorter, MAX_INSIDE * shorter + MORE_OUTSIDE, STEP)
    rays = _rays(ellipse)
    falls = -np.diff(_profiles(image, rays, s).mean(axis=0))
    steepest = int(falls.argmax())
    beyond = falls[steepest:] < 0.5 * falls[steepest]
    width = STEP * (int(beyond.argmax()) if beyond.any() else len(beyond))
    there = np.full(len(rays.feet), s[steepest] + STEP / 2)
    step = _step(rays, there, np.ones(len(there)))
    return _moved(ellipse, step), START_SIGMA * width / HALF_WIDTH


def _is_even(dents: FloatArray, shorter_axis: float) -> bool:
    """Tell whether noise alone moves the rim off its ellipse, px inwards."""
    smooth = _smooth(dents, 3)
    differences = np.abs(dents - np.roll(dents, 1))
    # Of the difference of two normal variables, and the mean of three.
    sigma = float(np.median(differences)) / normal_quantile(0.25) / sqrt(6)
    limit = min(MAX_DENT, MAX_RELATIVE_DENT * shorter_axis) + DENT_SIGMAS * sigma
    return bool(np.abs(smooth).max() < limit)
