"""The outline of an unevenly lit disc, from its edge alone.

Inside its rim a real LED has a hot spot, a dark middle, or a dome whose bright part
moves with the view. Its outline is the disc's all the same. Along a ray across the rim,
s px outwards from it, a disc of local brightness ``p0 + p1 s + p2 s^2``, blurred by a
Gaussian of standard deviation sigma, gives the light

    I(s) = b + p0 M0 + p1 M1 + p2 M2,    Mk(s) = integral over t < 0 of t^k g(s - t),

with ``M0 = Phi``, ``M1 = s Phi - sigma^2 g`` and ``M2 = (s^2 + sigma^2) Phi - s sigma^2
g``, where Phi is the share of the blur that lies inside. A rim that is d px further out
adds ``p0 g d``, since the derivatives of M1 and M2 are among the functions already; a
wider blur adds ``p0 s g / sigma`` per px. So each ray shows d by linear least squares
with its own b, p0, p1, p2, and all rays of a disc share one matrix. The ellipse follows
the d of all rays; a few rounds lead to the rim [1]_.

Where d stays off the ellipse something hides the disc, or merges with it. A ring is
fitted near its outer rim alone, with ``p1 = p2 = 0``: its dark middle is no parabola.

References
----------
.. [1] M. Hagara, P. Kulla, "Edge detection with sub-pixel accuracy based on
   approximation of edge with Erf function", Radioengineering 20 (2011) 516-524: the
   edge of an even plateau.
"""

from functools import lru_cache
from math import ceil, log, pi, sqrt
from typing import Any, NamedTuple, Self

import numpy as np
import numpy.typing as npt
from numpy.lib.stride_tricks import as_strided

from lightpen.arrays import BoolArray, FloatArray, Image, IntArray
from lightpen.model.coverage import normal_quantile

STEP = 0.5  # px between samples of a ray
RAY_SPACING = 2.0  # px along the rim
COARSE_SPACING = 4.0  # px, as long as the blur is sought
BESIDE = 0.5  # px from a ray to the lines that are read for it
MIN_RAYS, MAX_RAYS = 32, 128
# The unknowns of a ray are b, p0, p1, p0 d, p0 dsigma and p2. From afar p2 would lead
# astray; in the end the blur is held.
SLOPE, SHARPNESS, BEND = 2, 4, 5
STIFF = 1e6  # of the slope and bend of a ring
CONVERGED = 0.05  # px


class _Stage(NamedTuple):
    """Rounds of a fit with the same unknowns, until all rims hardly move."""

    unknowns: list[int]
    n_rounds: int
    rest: float  # px


STAGES = (
    _Stage([0, 1, 2, 3, 4], 3, 0.4),
    _Stage([0, 1, 2, 3, 4, 5], 2, 0.1),
    _Stage([0, 1, 2, 3, 5], 4, CONVERGED),
)
# From the image before, whose shape and blur a disc still has nearly.
KNOWN_STAGES = (STAGES[1]._replace(n_rounds=1), STAGES[2])
RIDGE = 1e-12  # of the normal matrix, which no disc of many may spoil
LONGEST_STEP = 1.5  # px, of the rim in one round
INSIDE, OUTSIDE = 3.0, 3.0  # reach of a ray in standard deviations of the blur
MORE_INSIDE, MORE_OUTSIDE = 2.5, 1.0  # px beyond that
INSIDE_RING = 2.2  # standard deviations of the blur
MAX_INSIDE = 0.5  # of the shorter semi-axis: deeper, brightness is no parabola
MIN_INSIDE = 3.5  # standard deviations of the blur: less shows little from it
DEEPEST = 0.8  # of the shorter semi-axis, whatever the blur
MIN_SIGMA = 0.4  # px
MAX_SIGMA = 0.3  # of the shorter semi-axis, beyond which blur hides the rim
MIN_SEMI_AXIS = 4.0  # px
LARGEST_SHARPENING = 0.3  # of the blur in one round
START_SIGMA = 0.7  # of the blur that all rays together seem to have
HALF_WIDTH = sqrt(2 * log(2))  # of a Gaussian at half its height, standard deviations
SMOOTHED = 7  # rays whose mean shows the brightness at one
BRIGHTEST = 1.5  # times the usual brightness, at which rays are capped
DARK = 0.1  # of the usual brightness inside the rim; darker rays show no rim

# A sliver of 1 px off a disc of 42 px leaves 0.5 px.
MAX_DENT = 0.15  # px, of three neighbouring rays off the ellipse
MAX_RELATIVE_DENT = 0.015  # of the shorter semi-axis
DENT_SIGMAS = 3.5


class EdgeFits(NamedTuple):
    """The outlines of N discs; NaN without a sharp enough edge."""

    centers: FloatArray  # (N, 2), px
    # (N, 2, 2), covariances of the areas, px^2; eigenvalues a^2 / 4 and b^2 / 4.
    shapes: FloatArray
    sigmas: FloatArray  # (N,), standard deviations of the blur, px
    # (N,), whether no part of the rim lies off the ellipse, nor is missing
    are_whole: BoolArray


class EdgeStarts(NamedTuple):
    """Start values of N edge fits."""

    centers: FloatArray  # (N, 2), of the regions, px
    shapes: FloatArray  # (N, 2, 2), covariances of their areas, px^2
    # (N,), blur of discs in the previous image, which have these shapes, px; NaN: new.
    sigmas: FloatArray
    # (N, 2), from the disc's centre to the region's in the previous image, px.
    offsets: FloatArray
    are_rings: BoolArray  # (N,)

    @classmethod
    def anew(cls, centers: FloatArray, shapes: FloatArray) -> Self:
        """Return starts of discs that no previous image shows."""
        n = len(centers)
        nowhere = np.full((n, 2), np.nan)
        return cls(centers, shapes, nowhere[:, 0], nowhere, np.zeros(n, dtype=bool))


class _Ellipses(NamedTuple):
    """The points ``center + root u`` for unit vectors u, of D discs."""

    centers: FloatArray  # (D, 2)
    roots: FloatArray  # (D, 2, 2)

    @property
    def semi_axes(self) -> tuple[FloatArray, FloatArray]:
        """Semi-axes, the longer first, px, (D,) each."""
        a, b, c, d = self.roots.reshape(-1, 4).T
        sums, differences = np.hypot(a + d, b - c), np.hypot(a - d, b + c)
        return (sums + differences) / 2, np.abs(sums - differences) / 2

    def of(self, chosen: BoolArray) -> "_Ellipses":
        """Return the ellipses of some discs."""
        return _Ellipses(self.centers[chosen], self.roots[chosen])


class _Rays(NamedTuple):
    """Intersections of rays with ellipses, and their derivatives by the parameters."""

    # `feet` and `normals`: (D, N, 2), crossings, px, and unit normals, outwards.
    feet: FloatArray
    normals: FloatArray
    # (D, N, 5), movement along the normal, px, by the centre, px, and by relative
    # changes of the size and of the two ways to stretch it.
    moves: FloatArray


class _Edges(NamedTuple):
    """Edge positions along rays."""

    places: FloatArray  # (D, N), of the edge along the ray, px from its foot
    weights: FloatArray  # (D, N)
    blurs: FloatArray  # (D,), by how much the blur is wider than supposed, px
    are_dark: BoolArray  # (D,), whether rays meet no light inside the rim
    are_lit: BoolArray  # (D,), whether there is light inside at all


def fit_edges(image: Image, starts: EdgeStarts) -> EdgeFits:
    """Fit ellipses to the edges of discs in a whole image (H, W), all at once.

    The area is that within the edge, not reduced by blur. A disc that is not found from
    its fit in the previous image is searched without it.
    """
    if image.strides[1] != image.itemsize or image.strides[0] < 0:
        image = image.copy()
    n = len(starts.centers)
    fits = EdgeFits(
        np.full((n, 2), np.nan),
        np.full((n, 2, 2), np.nan),
        np.full(n, np.nan),
        np.zeros(n, dtype=bool),
    )
    known = np.flatnonzero(np.isfinite(starts.sigmas))
    if len(known):
        _fit(image, starts, fits, known, is_known=True)
    anew = np.flatnonzero(~fits.are_whole)
    if len(anew):
        for column in fits[:3]:
            column[anew] = np.nan
        _fit(image, starts, fits, anew, is_known=False)
    return fits


def _fit(
    image: Image, starts: EdgeStarts, fits: EdgeFits, discs: IntArray, *, is_known: bool
) -> None:
    """Add the fits of some discs that are all new, or all known."""
    wide = np.linalg.eigvalsh(4 * starts.shapes[discs])[:, 0] >= MIN_SEMI_AXIS**2
    left = discs[wide]
    if not len(left):
        return
    roots = np.asarray(np.linalg.cholesky(4 * starts.shapes[left]), dtype=np.float64)
    ellipses, sigmas = _Ellipses(starts.centers[left], roots), starts.sigmas[left]
    rings = starts.are_rings[left]
    if not is_known:
        ellipses, sigmas = _onto_steepest(image, ellipses)
    for unknowns, n_rounds, rest in KNOWN_STAGES if is_known else STAGES:
        for n_left in reversed(range(n_rounds)):
            shorter = ellipses.semi_axes[1]
            sigmas = np.minimum(np.maximum(sigmas, MIN_SIGMA), MAX_SIGMA * shorter)
            spacing = COARSE_SPACING if SHARPNESS in unknowns else RAY_SPACING
            rays = _rays(ellipses, spacing)
            edges = _edges(image, rays, sigmas, shorter, unknowns, rings)
            steps = _steps(rays, edges.places, edges.weights)
            moves = (rays.moves @ steps[..., None])[..., 0]
            longest = np.abs(moves).max(axis=1)
            alive = edges.are_lit & (shorter > MIN_SEMI_AXIS) & np.isfinite(longest)
            shares = np.minimum(1.0, LONGEST_STEP / np.maximum(longest, 1e-9))
            ellipses = _moved(ellipses, steps * shares[:, None])
            at_rest = longest < rest
            if SHARPNESS not in unknowns:
                ended = alive & (at_rest | (n_left == 0))
                are_even = _are_even(edges.places - moves, shorter) & ~edges.are_dark
                sharp = ended & (sigmas < MAX_SIGMA * shorter)
                found = left[sharp]
                fits.centers[found] = ellipses.centers[sharp]
                fits.shapes[found] = _shapes(ellipses.roots[sharp], sigmas[sharp])
                fits.sigmas[found] = sigmas[sharp]
                fits.are_whole[found] = (are_even & at_rest)[sharp]
                alive &= ~ended
            sigmas = sigmas + edges.blurs
            if not alive.all():
                left, ellipses, sigmas = left[alive], ellipses.of(alive), sigmas[alive]
                rings = rings[alive]
                if not len(left):
                    return
            if at_rest[alive].all():
                break


def _shapes(roots: FloatArray, sigmas: FloatArray) -> FloatArray:
    """Return the covariances of the areas within edges, (N, 2, 2), px^2."""
    # Blur pulls the half level of a convex rim inwards, by sigma^2 over its diameter.
    growth = sigmas**2 / np.abs(np.linalg.det(roots))
    scale = (1 + growth)[:, None, None] / 4
    return np.asarray(scale * (roots @ roots.transpose(0, 2, 1)))


def _rays(ellipses: _Ellipses, spacing: float) -> _Rays:
    longest = float(ellipses.semi_axes[0].max())
    n_rays = 4 * round(min(max(2 * pi * longest / spacing, MIN_RAYS), MAX_RAYS) / 4)
    arms, stretching = _arms(n_rays)
    spokes = arms @ np.swapaxes(ellipses.roots, 1, 2)
    normals = arms @ np.linalg.inv(ellipses.roots)
    normals /= np.hypot(normals[..., 0], normals[..., 1])[..., None]
    lengths = (spokes * normals).sum(axis=2)
    moves = np.empty((*lengths.shape, 5))
    moves[..., :2] = normals
    moves[..., 2:] = lengths[..., None] * stretching
    return _Rays(ellipses.centers[:, None] + spokes, normals, moves)


@lru_cache(maxsize=MAX_RAYS // 4)
def _arms(n_rays: int) -> tuple[FloatArray, FloatArray]:
    """Return unit vectors round the circle, (N, 2), and stretch directions, (N, 3)."""
    angles = 2 * pi / n_rays * np.arange(n_rays)
    arms = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    ways = [np.ones(n_rays), np.cos(2 * angles), np.sin(2 * angles)]
    return arms, np.stack(ways, axis=-1)


def _moved(ellipses: _Ellipses, steps: FloatArray) -> _Ellipses:
    size, along, across = steps[:, 2], steps[:, 3], steps[:, 4]
    stretch = np.array([[1 + size + along, across], [across, 1 + size - along]])
    roots = ellipses.roots @ stretch.transpose(2, 0, 1)
    return _Ellipses(ellipses.centers + steps[:, :2], roots)


def _steps(rays: _Rays, places: FloatArray, weights: FloatArray) -> FloatArray:
    """Return the changes of ellipses that follow places along rays best, (D, 5)."""
    weighted = np.swapaxes(rays.moves * weights[..., None], 1, 2)
    normal, right = weighted @ rays.moves, weighted @ places[..., None]
    diagonal = np.einsum("dii->di", normal)
    diagonal *= 1 + RIDGE
    diagonal += RIDGE
    return np.asarray(np.linalg.solve(normal, right)[..., 0])


def _edges(
    image: Image,
    rays: _Rays,
    sigmas: FloatArray,
    shorter_axes: FloatArray,
    unknowns: list[int],
    are_rings: BoolArray,
) -> _Edges:
    """Return the edges along rays."""
    deepest = np.maximum(MAX_INSIDE * shorter_axes, MIN_INSIDE * sigmas)
    inside = np.minimum(INSIDE * sigmas + MORE_INSIDE, deepest)
    inside = np.minimum(inside, DEEPEST * shorter_axes)
    inside = np.where(are_rings, np.minimum(inside, INSIDE_RING * sigmas), inside)
    reach = inside + OUTSIDE * sigmas + MORE_OUTSIDE
    s = -inside[:, None] + STEP * np.arange(ceil(float(reach.max()) / STEP))
    functions = _functions(s, sigmas, shorter_axes)[..., unknowns]
    functions *= (s < (reach - inside)[:, None])[..., None]
    squares = np.swapaxes(functions, 1, 2) @ functions
    are_shape = np.isin(unknowns, (SLOPE, BEND))
    squares += STIFF * are_rings[:, None, None] * np.diag(are_shape)
    inverse = functions @ np.linalg.inv(squares)
    fitted = _profiles(image, rays, s, is_coarse=BEND not in unknowns) @ inverse
    brightness = _smooth(fitted[..., 1], SMOOTHED)
    usual = brightness.mean(axis=1, keepdims=True)
    are_lit = usual[:, 0] > 0
    usual = np.where(usual > 0, usual, 1.0)
    lit = brightness > DARK * usual
    divisor = np.where(lit, brightness, usual)
    bound = inside[:, None]
    places = np.where(lit, fitted[..., 3] / divisor, 0.0)
    places = np.minimum(np.maximum(places, -bound), bound)
    weights = np.minimum(np.maximum(brightness / usual, DARK), BRIGHTEST) ** 2
    blurs = np.zeros(len(s))
    if SHARPNESS in unknowns:
        # To second order, a rim d px further out looks d^2 / (2 sigma) more blurred.
        moved = places**2 / (2 * sigmas[:, None])
        each = np.clip(fitted[..., 4] / divisor - moved, -1, 1)
        blurs = (weights * each).sum(axis=1) / weights.sum(axis=1)
        blurs = np.maximum(blurs, -LARGEST_SHARPENING * sigmas)
    return _Edges(places, weights, blurs, np.asarray(~lit.all(axis=1)), are_lit)


def _smooth(values: FloatArray, n_rays: int) -> FloatArray:
    """Return running means over ``n_rays`` neighbouring rays of each rim, (D, N)."""
    reach = n_rays // 2
    wrapped = np.concatenate([values[:, -reach:], values, values[:, :reach]], axis=1)
    n = values.shape[1]
    return np.asarray(sum(wrapped[:, k : k + n] for k in range(n_rays)) / n_rays)


def _profiles(
    image: Image, rays: _Rays, s: FloatArray, *, is_coarse: bool
) -> FloatArray:
    """Return the light along the rays at distances s (D, S) from their feet, (D, N, S).

    It is the mean of two lines, so that hardly a pixel is passed over, or of one line
    where ``is_coarse``.
    """
    height, width = image.shape
    feet = rays.feet[None]
    if not is_coarse:
        beside = BESIDE * rays.normals[..., ::-1] * np.array([-1.0, 1.0])
        feet = np.stack([rays.feet - beside, rays.feet + beside])
    away, normals = s[:, None].astype(np.float32), rays.normals.astype(np.float32)
    x, y = (
        normals[..., k, None] * away + feet[..., k, None].astype(np.float32)
        for k in range(2)
    )
    for places, end in ((x, width), (y, height)):
        np.maximum(places, 0.0, out=places)
        np.minimum(places, end - 1.001, out=places)
    column, row = np.floor(x), np.floor(y)
    x -= column
    y -= row
    # A window of an image is not one piece of memory; to copy it takes as long as this.
    pitch = image.strides[0] // image.itemsize
    size = (height - 1) * pitch + width
    flat: npt.NDArray[Any] = as_strided(image, (size,), (image.itemsize,))
    at = row.astype(np.intp)
    at *= pitch
    at += column.astype(np.intp)
    above, below = (
        _between(flat.take(at), flat.take(at + 1), x),
        _between(flat.take(at + pitch), flat.take(at + (pitch + 1)), x),
    )
    light = _between(above, below, y)
    return light[0] if is_coarse else np.asarray(0.5 * (light[0] + light[1]))


def _between(
    first: npt.NDArray[Any], second: npt.NDArray[Any], share: npt.NDArray[np.float32]
) -> npt.NDArray[np.float32]:
    """Return values at a share of the way from the first to the second."""
    between: npt.NDArray[np.float32] = np.subtract(second, first, dtype=np.float32)
    between *= share
    between += first
    return between


def _functions(
    s: FloatArray, sigmas: FloatArray, shorter_axes: FloatArray
) -> FloatArray:
    """Return the light along rays by b, p0, p1, p0 d, p0 dsigma and p2, (D, S, 6)."""
    from scipy.special import ndtr  # takes 0.1 s

    sigma, shorter = sigmas[:, None], shorter_axes[:, None]
    z = s / sigma
    share = ndtr(-z)
    g = np.exp(-0.5 * z * z) / (sqrt(2 * pi) * sigma)
    slope = (s * share - sigma**2 * g) / shorter
    bend = ((s * s + sigma**2) * share - s * sigma**2 * g) / shorter**2
    return np.stack([np.ones_like(s), share, slope, g, g * z, bend], axis=-1)


def _onto_steepest(image: Image, ellipses: _Ellipses) -> tuple[_Ellipses, FloatArray]:
    """Return the ellipses grown to where the light falls most, and the blur there.

    The side of the fall that is outside shows the blur: nothing else shines there.
    """
    shorter = ellipses.semi_axes[1]
    depths = MAX_INSIDE * shorter
    spans = 2 * depths + MORE_OUTSIDE
    s = -depths[:, None] + STEP * np.arange(ceil(float(spans.max()) / STEP))
    rays = _rays(ellipses, COARSE_SPACING)
    falls = -np.diff(_profiles(image, rays, s, is_coarse=True).mean(axis=1))
    falls[s[:, 1:] >= (spans - depths)[:, None]] = -np.inf
    discs = np.arange(len(s))
    steepest = falls.argmax(axis=1)
    outside = np.arange(falls.shape[1]) >= steepest[:, None]
    beyond = outside & (falls < 0.5 * falls[discs, steepest][:, None])
    beyond[:, -1] = True
    widths = STEP * (beyond.argmax(axis=1) - steepest)
    there = np.repeat(
        (s[discs, steepest] + STEP / 2)[:, None], rays.feet.shape[1], axis=1
    )
    steps = _steps(rays, there, np.ones_like(there))
    return _moved(ellipses, steps), START_SIGMA * widths / HALF_WIDTH


def _are_even(dents: FloatArray, shorter_axes: FloatArray) -> BoolArray:
    """Return whether noise alone moves each rim off its ellipse, px inwards."""
    smooth = _smooth(dents, 3)
    differences = np.abs(dents - np.roll(dents, 1, axis=1))
    # Of the difference of two normal variables, and the mean of three.
    middle = differences.shape[1] // 2
    medians = np.partition(differences, middle, axis=1)[:, middle]
    sigmas = medians / normal_quantile(0.25) / sqrt(6)
    limits = np.minimum(MAX_DENT, MAX_RELATIVE_DENT * shorter_axes)
    return np.asarray(np.abs(smooth).max(axis=1) < limits + DENT_SIGMAS * sigmas)
