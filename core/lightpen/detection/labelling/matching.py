"""Matching of pose hypotheses with the spots of images, refined and scored.

Everything is batched over candidates, each a pose supposed for one image, and done in
the pinhole pixels of `lightpen.detection.labelling.constellation`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np

from lightpen.arrays import BoolArray, FloatArray, IntArray
from lightpen.detection.labelling.constellation import Constellation, SpotArrays
from lightpen.model.ellipse import conic_centers, conic_images
from lightpen.model.rigid import rotation_from_vector, with_turns

MIN_FACING = 0.1  # cosine between a disc's normal and the direction to the camera

# Scale of the Cauchy weights of each refinement step, then reach of the pairing, px.
SETTLING = ((3.0, 5.0), (0.5, 5.0))
MAX_TURN = 0.5  # rad, of one step
MIN_THRESHOLD = 0.3  # px, of a residual
MAX_THRESHOLD = 1.0  # px
OUTLIER_SIGMAS = 5.0
UNSUSPICIOUS_RMS = 0.1  # px, at which no stray spot is looked for
FLOOR_RMS = 0.03  # px; better fits are not preferred
MAX_CHANCE = 1e-3  # that a pair dropped as stray is genuine

SHAPE_TOLERANCE = 0.12  # difference of shapes over the trace of the predicted one
MAX_COMMON_BROADENING = 0.5  # of all shapes alike, by defocus or motion
AREA_RANGE = (0.5, 2.0)  # measured over predicted, all discs together


@dataclass(frozen=True, eq=False)
class Candidates:
    """Pose hypotheses for images, with the spots they explain."""

    image: IntArray  # (C,), index into the `SpotArrays`
    R: FloatArray  # (C, 3, 3)
    t: FloatArray  # (C, 3), of cam_from_pen
    spot: IntArray  # (C, L), spot of each LED, -1 if none
    residuals: FloatArray  # (C, L), distance to the spot, px; 0 where there is none
    # (C,), median of measured over predicted area of the discs; nan until settled.
    area_ratio: FloatArray

    def __len__(self) -> int:
        return len(self.image)

    @cached_property
    def n_explained(self) -> IntArray:
        """LEDs that have a spot, (C,)."""
        return np.asarray((self.spot >= 0).sum(axis=1))

    @cached_property
    def sum_squares(self) -> FloatArray:
        """Sum of the squared residuals, px^2, (C,)."""
        return np.asarray(np.einsum("cl,cl->c", self.residuals, self.residuals))

    @cached_property
    def rms(self) -> FloatArray:
        """Root mean square over the image coordinates, px, (C,)."""
        n_coordinates = np.maximum(2 * self.n_explained, 1)
        return np.asarray(np.sqrt(self.sum_squares / n_coordinates))

    def of(self, which: IntArray | BoolArray) -> "Candidates":
        """Return some of the candidates."""
        return Candidates(*(getattr(self, f.name)[which] for f in fields(self)))


def join(parts: Sequence[Candidates]) -> Candidates:
    """Return the candidates of several lots as one lot."""
    columns = [[getattr(part, f.name) for part in parts] for f in fields(Candidates)]
    return Candidates(*(np.concatenate(column) for column in columns))


def match(
    sight: SpotArrays,
    pen: Constellation,
    image: IntArray,
    R: FloatArray,
    t: FloatArray,
    tolerance: float | FloatArray,
) -> Candidates:
    """Pair predicted LED centres with the spots that are nearest both ways.

    Parameters
    ----------
    image : (C,) array
    R : (C, 3, 3) array
    t : (C, 3) array
    tolerance : float or (C, 1) array
        Largest distance of a pair, px.
    """
    R_t = R.transpose(0, 2, 1)
    leds = pen.leds @ R_t + t[:, None]
    seen = _facing(leds, pen.normals @ R_t)
    there = leds[..., :2] * (sight.focal / np.maximum(leds[..., 2:], 1e-3))
    spots = sight.points[image]
    squares = (there[:, :, None, 0] - spots[:, None, :, 0]) ** 2
    squares += (there[:, :, None, 1] - spots[:, None, :, 1]) ** 2
    spot = squares.argmin(axis=2)
    led = squares.argmin(axis=1)
    square = squares.min(axis=2)
    mutual = led[np.arange(len(image))[:, None], spot] == np.arange(len(pen.leds))
    paired = mutual & seen & (square < tolerance**2)
    return Candidates(
        image=image,
        R=R,
        t=t,
        spot=np.where(paired, spot, -1),
        residuals=np.sqrt(np.where(paired, square, 0.0)),
        area_ratio=np.full(len(image), np.nan),
    )


def settle(sight: SpotArrays, pen: Constellation, candidates: Candidates) -> Candidates:
    """Refine poses and pairs in turn until only pairs at the noise level are left.

    Robust Gauss-Newton steps on the pose; in the end an LED keeps its spot if it lies
    within some standard deviations of where the others put it, and if it looks as a
    disc of the pen looks there.
    """
    for scale, tolerance in SETTLING:
        weights = 1 / (1 + (candidates.residuals / scale) ** 2)
        there = _step(sight, pen, candidates, weights)
        candidates = match(sight, pen, there.image, there.R, there.t, tolerance)
    settled = _drop_misshapen(sight, pen, candidates)
    settled = fit(sight, pen, _drop(settled, _beyond_threshold(settled)))
    stray = _beyond_threshold(settled)
    if stray.any():
        settled = fit(sight, pen, _drop(settled, stray))
    return _drop_worst(sight, pen, settled)


def fit(
    sight: SpotArrays, pen: Constellation, candidates: Candidates, n_steps: int = 1
) -> Candidates:
    """Refine poses on their pairs by least squares, ellipse centres modelled."""
    R_t = candidates.R.transpose(0, 2, 1)
    leds = pen.leds @ R_t + candidates.t[:, None]
    # How far ellipse centres lie from LED centres hardly depends on the pose.
    eccentric = conic_centers(leds, pen.normals @ R_t, pen.radius) * sight.focal
    eccentric -= _project(sight, leds)
    even = np.ones_like(candidates.residuals)
    for _ in range(n_steps):
        candidates = _step(sight, pen, candidates, even, eccentric)
    leds = pen.leds @ candidates.R.transpose(0, 2, 1) + candidates.t[:, None]
    offsets = _offsets(sight, candidates, leds, eccentric)
    lengths = np.hypot(offsets[..., 0], offsets[..., 1])
    return replace(candidates, residuals=lengths)


def log_false_alarms(sight: SpotArrays, candidates: Candidates) -> FloatArray:
    """Return log10 of the expected number of false labellings, (C,).

    An a-contrario count in the manner of [1]_: the number of ways to give n of L LEDs
    to n of N spots, times the probability that n spots strewn over the area that these
    ones cover fit a pose as well in their 2 n - 6 surplus coordinates.

    References
    ----------
    .. [1] L. Moisan, B. Stival, "A probabilistic criterion to detect rigid point
       matches between two images and estimate the fundamental matrix", International
       Journal of Computer Vision 57 (2004) 201-218.
    """
    from scipy.special import gammaln  # takes 0.1 s

    n = candidates.n_explained
    n_leds = candidates.spot.shape[1]
    n_spots = sight.usable.sum(axis=1)[candidates.image]
    choices = gammaln(n_leds + 1) - gammaln(n + 1) - gammaln(n_leds - n + 1)
    choices += gammaln(n_spots + 1) - gammaln(n_spots - n + 1)
    surplus = np.maximum(2 * n - 6, 0)
    squares = np.maximum(candidates.sum_squares, 1e-12)
    share = np.log(np.pi * squares / _covered_area(sight, candidates))
    ball = 0.5 * surplus * share - gammaln(0.5 * surplus + 1)
    return np.asarray((choices + np.minimum(ball, 0)) / np.log(10))


def _covered_area(sight: SpotArrays, candidates: Candidates) -> FloatArray:
    paired = (candidates.spot >= 0)[..., None]
    points = _paired_points(sight, candidates)
    low = np.where(paired, points, np.inf).min(axis=1)
    high = np.where(paired, points, -np.inf).max(axis=1)
    sides = np.maximum(high - low, 1.0)
    return np.asarray(sides[:, 0] * sides[:, 1])


def _facing(leds: FloatArray, normals: FloatArray) -> BoolArray:
    towards = -np.einsum("...i,...i->...", normals, leds)
    distance = np.sqrt(np.einsum("...i,...i->...", leds, leds))
    return np.asarray((towards > MIN_FACING * distance) & (leds[..., 2] > 0))


def _paired_points(sight: SpotArrays, candidates: Candidates) -> FloatArray:
    return np.asarray(sight.points[candidates.image[:, None], candidates.spot])


def _project(sight: SpotArrays, leds: FloatArray) -> FloatArray:
    return np.asarray(leds[..., :2] * (sight.focal / leds[..., 2:]))


def _offsets(
    sight: SpotArrays,
    candidates: Candidates,
    leds: FloatArray,
    eccentric: FloatArray | float,
) -> FloatArray:
    """Return spots minus predicted ellipse centres, (C, L, 2), px; 0 without a spot."""
    offsets = _paired_points(sight, candidates) - _project(sight, leds) - eccentric
    offsets[candidates.spot < 0] = 0
    return offsets


def _step(
    sight: SpotArrays,
    pen: Constellation,
    candidates: Candidates,
    weights: FloatArray,
    eccentric: FloatArray | float = 0.0,
) -> Candidates:
    """Make one weighted Gauss-Newton step on poses, rotating in the camera frame."""
    arms = pen.leds @ candidates.R.transpose(0, 2, 1)
    leds = arms + candidates.t[:, None]
    offsets = _offsets(sight, candidates, leds, eccentric)
    scale = sight.focal / leds[..., 2]
    moves = np.zeros((*scale.shape, 2, 3))
    moves[..., 0, 0] = moves[..., 1, 1] = scale
    moves[..., 2] = leds[..., :2] * (scale / -leds[..., 2])[..., None]
    J = with_turns(moves, arms)
    weights = np.where(candidates.spot >= 0, weights, 0.0)
    n_equations = 2 * arms.shape[1]
    weighted = (J * weights[..., None, None]).reshape(-1, n_equations, 6)
    weighted = weighted.transpose(0, 2, 1)
    normal = weighted @ J.reshape(-1, n_equations, 6)
    gradient = weighted @ offsets.reshape(-1, n_equations, 1)
    # Too few pairs leave the matrix singular; a trace of damping then keeps the pose.
    diagonal = np.einsum("cii->ci", normal)
    diagonal *= 1 + 1e-9
    diagonal += 1e-9
    step = np.asarray(np.linalg.solve(normal, gradient)[..., 0], dtype=np.float64)
    turn = np.sqrt(np.einsum("ci,ci->c", step[:, :3], step[:, :3]))
    step *= (MAX_TURN / np.maximum(turn, MAX_TURN))[:, None]
    R = rotation_from_vector(step[:, :3]) @ candidates.R
    return replace(candidates, R=R, t=candidates.t + step[:, 3:])


def _drop_misshapen(
    sight: SpotArrays, pen: Constellation, candidates: Candidates
) -> Candidates:
    """Drop the pairs that do not look as discs of the pen look there.

    Blur broadens all spots alike, a wrong disc diameter or threshold scales them all:
    so the spots of an image are compared after the change common to all is taken off.
    """
    paired = candidates.spot >= 0
    measured = sight.shapes[candidates.image[:, None], candidates.spot]
    R_t = candidates.R.transpose(0, 2, 1)
    leds = pen.leds @ R_t + candidates.t[:, None]
    predicted = conic_images(leds, pen.normals @ R_t, pen.radius).shapes
    predicted *= sight.focal**2
    size = np.einsum("clii->cl", predicted)
    difference = (measured - predicted) / size[..., None, None]
    flat = difference.reshape(*size.shape, 4)
    common = _median(flat, paired)
    limited = np.clip(common, -MAX_COMMON_BROADENING, MAX_COMMON_BROADENING)
    flat = flat - limited[:, None]
    squares = np.einsum("clk,clk->cl", flat, flat)
    broadening = common[:, 0] + common[:, 3]
    growth = 1 + np.maximum(broadening, -0.5)
    bad = squares > (SHAPE_TOLERANCE * growth[:, None]) ** 2
    dropped = _drop(candidates, bad)
    return replace(dropped, area_ratio=1 + broadening)


def _beyond_threshold(candidates: Candidates) -> BoolArray:
    """Return which pairs lie farther apart than the noise of the image allows, (C, L).

    The noise is the median residual of the image. The threshold is low because a stray
    spot may lie near the place of a hidden LED by chance.
    """
    n = candidates.n_explained
    freedom = np.maximum(2 * n - 6, 1) / np.maximum(2 * n, 1)
    median = _median(candidates.residuals, candidates.spot >= 0)
    sigma = median / 1.177 / np.sqrt(freedom)  # the median of a Rayleigh distribution
    outlier_threshold = np.clip(OUTLIER_SIGMAS * sigma, MIN_THRESHOLD, MAX_THRESHOLD)
    return np.asarray(candidates.residuals > outlier_threshold[:, None])


def _drop_worst(
    sight: SpotArrays, pen: Constellation, candidates: Candidates
) -> Candidates:
    """Drop from each candidate the pair without which the others fit far better.

    With the pairs of n - 1 LEDs at the noise level, the ratio of the sums of squares
    falls below x with the probability x^(n - 4): the F-test with 2 and 2 n - 8 degrees
    of freedom.
    """
    n = candidates.n_explained
    suspect = (n >= pen.min_leds) & (candidates.rms > UNSUSPICIOUS_RMS)
    suspect &= candidates.rms < MAX_THRESHOLD
    row, led = np.nonzero(suspect[:, None] & (candidates.spot >= 0))
    if not len(row):
        return candidates
    without = candidates.of(row)
    spot = without.spot.copy()
    spot[np.arange(len(row)), led] = -1
    without = fit(sight, pen, replace(without, spot=spot), n_steps=2)
    floor = 2 * n[row] * FLOOR_RMS**2
    ratio = (without.sum_squares + floor) / (candidates.sum_squares[row] + floor)
    chance = ratio ** (n[row] - 4)
    order = np.lexsort((ratio, row))
    best = order[np.unique(row[order], return_index=True)[1]]
    best = best[chance[best] < MAX_CHANCE]
    spared = np.ones(len(candidates), dtype=bool)
    spared[row[best]] = False
    return join([candidates.of(spared), without.of(best)])


def _drop(candidates: Candidates, bad: BoolArray) -> Candidates:
    spot = np.where(bad, -1, candidates.spot)
    residuals = np.where(bad, 0.0, candidates.residuals)
    return replace(candidates, spot=spot, residuals=residuals)


def _median(values: FloatArray, known: BoolArray) -> FloatArray:
    """Return the median over axis 1 of the known values, 0 where there are none."""
    n = known.sum(axis=1)
    extra = (1,) * (values.ndim - 2)
    ordered = np.where(known.reshape(known.shape + extra), values, 1e9)
    ordered.sort(axis=1)
    rows, last = np.arange(len(values)), np.maximum(n - 1, 0)
    median = 0.5 * (ordered[rows, last // 2] + ordered[rows, (last + 1) // 2])
    median[n == 0] = 0.0
    return np.asarray(median)
