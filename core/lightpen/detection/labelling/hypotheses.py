"""Hypotheses of the pose of a pen from a few of its spots.

A triple of spots is supposed to be a triple of LEDs, which fixes up to four poses.
There are hundreds of triples of LEDs; the size of a spot shows its distance, and with
it the sides of the triangle, so the likeliest can be tried first.
"""

from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import combinations
from typing import NamedTuple

import numpy as np

from lightpen.arrays import FloatArray, IntArray
from lightpen.detection.labelling.constellation import Constellation, SpotArrays
from lightpen.detection.labelling.matching import (
    AREA_RANGE,
    MIN_FACING,
    Candidates,
    fit,
    join,
    match,
)
from lightpen.model.ellipse import conic_images
from lightpen.model.rigid import reflection

# Pose from three points and their lines of sight, in closed form.
#
# The ranges ``r_i`` along the unit rays ``y_i`` obey three equations of the kind ``|r_1
# y_1 - r_2 y_2|^2 = a_12``. Eliminating the scale leaves two cones in the ranges, and
# the pencil of the two holds a degenerate member, found as a root of a cubic: a pair of
# planes. Each plane cuts a cone in two directions, so there are up to four answers. The
# pencil is that of [1]_; the planes are split with the adjoint matrix as in [2]_.
#
# References
# ----------
# .. [1] M. Persson, K. Nordberg, "Lambda Twist: an accurate fast robust perspective
#    three point (P3P) solver", ECCV 2018.
# .. [2] Y. Ding, J. Yang, V. Larsson, C. Olsson, K. Astrom, "Revisiting the P3P
#    problem", CVPR 2023.


NEWTON_STEPS = 2
DOUBLE_ROOT = 1e-9  # discriminant taken for zero, relative
NEXT, LAST = [1, 2, 0], [2, 0, 1]  # of each axis
# Of the entries of a symmetric matrix that is stored as 00 01 02 11 12 22.
PLACES = np.array([[0, 1, 2], [1, 3, 4], [2, 4, 5]])


class PosesOfThree(NamedTuple):
    """Every real pose of a batch of three-point problems."""

    source: IntArray  # (S,), the problem that each pose solves
    rotations: FloatArray  # (S, 3, 3)
    # (S, 3), ``rays`` times their ranges equal ``points @ R.T + t``.
    translations: FloatArray


def solve_p3p(rays: FloatArray, points: FloatArray) -> PosesOfThree:
    """Return the poses that put three points onto three rays each.

    Each problem has none to four, with all points in front of the camera.

    Parameters
    ----------
    rays : (H, 3, 3) array
        Unit vectors from the camera, one per row.
    points : (H, 3, 3) array
        The points in their own frame, one per row, mm; not on one line.
    """
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        source, ranges = _ranges(rays, points)
    return PosesOfThree(source, *_poses(rays[source], points[source], ranges))


def _ranges(rays: FloatArray, points: FloatArray) -> tuple[IntArray, FloatArray]:
    """Return the problem (S,) and the positive ranges (S, 3) of every solution."""
    cosines = [_dot(rays[:, i], rays[:, j]) for i, j in ((0, 1), (0, 2), (1, 2))]
    sides = [_squared(points[:, i] - points[:, j]) for i, j in ((0, 1), (0, 2), (1, 2))]
    b12, b13, b23 = cosines
    a12, a13 = sides[0] / sides[2], sides[1] / sides[2]
    zero, one = np.zeros_like(b12), np.ones_like(b12)
    # The pencil of [1], eq. 12, over a23.
    first = np.stack([one, -b12, zero, 1 - a12, a12 * b23, -a12])
    second = np.stack([one, zero, -b13, -a13, a13 * b23, 1 - a13])
    c0, c3 = (_inner(_adjoint(s), s) / 3 for s in (first, second))  # determinants
    # A symmetric triangle can make one of the two degenerate: the root is then at
    # infinity, unless they change places.
    swap = np.abs(c0) > np.abs(c3)
    first, second = np.where(swap, second, first), np.where(swap, first, second)
    root = _simple_root(
        np.where(swap, c0, c3),
        _inner(_adjoint(second), first),
        _inner(_adjoint(first), second),
        np.where(swap, c3, c0),
    )
    planes = _split(first + root * second)
    problem = np.tile(np.arange(len(rays)), 2)
    directions = _cut(np.concatenate(planes, axis=1), first[:, problem])
    problem = np.tile(problem, 2)
    l1, l2, l3 = directions
    scale = (sides[0] + sides[1] + sides[2])[problem] / (
        2 * (l1 * l1 + l2 * l2 + l3 * l3)
        - 2 * (b12[problem] * l1 * l2 + b13[problem] * l1 * l3 + b23[problem] * l2 * l3)
    )
    real = np.all(directions > 0, axis=0) & (scale > 0) & np.isfinite(scale)
    ranges = (directions[:, real] * np.sqrt(scale[real])).T
    return problem[real], ranges


def _poses(
    rays: FloatArray, points: FloatArray, ranges: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the motions that bring triangles onto the points at these ranges."""
    seen = rays * ranges[..., None]
    here, there = _triangle_frame(points), _triangle_frame(seen)
    rotations = there @ np.swapaxes(here, 1, 2)
    middle = np.einsum("sij,sj->si", rotations, _middle(points))
    return rotations, _middle(seen) - middle


def _middle(points: FloatArray) -> FloatArray:
    return np.asarray((points[:, 0] + points[:, 1] + points[:, 2]) / 3)


def _triangle_frame(points: FloatArray) -> FloatArray:
    """Return orthonormal axes, in columns, fixed to each triangle."""
    along = points[:, 1] - points[:, 0]
    across = _cross(along, points[:, 2] - points[:, 0])
    frame = np.empty((len(points), 3, 3))
    frame[:, :, 0] = along / np.sqrt(_squared(along))[:, None]
    frame[:, :, 2] = across / np.sqrt(_squared(across))[:, None]
    frame[:, :, 1] = _cross(frame[:, :, 2], frame[:, :, 0])
    return frame


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return vector products; np.cross takes three times as long."""
    return np.asarray(a[:, NEXT] * b[:, LAST] - a[:, LAST] * b[:, NEXT])


def _simple_root(
    c3: FloatArray, c2: FloatArray, c1: FloatArray, c0: FloatArray
) -> FloatArray:
    """Return the real root of each cubic that lies farthest from the others."""
    b, c, d = c2 / c3, c1 / c3, c0 / c3
    q = (b * b - 3 * c) / 9
    r = (b * (2 * b * b - 9 * c) + 27 * d) / 54
    discriminant = r * r - q**3
    # Three real roots: by the cosine; one: by Cardano's formula.
    size = np.sqrt(np.maximum(q, 0))
    angle = np.arccos(np.clip(np.abs(r) / np.maximum(size**3, 1e-300), 0, 1)) / 3
    u = np.cbrt(np.abs(r) + np.sqrt(np.maximum(discriminant, 0)))
    far = np.where(discriminant < 0, 2 * size * np.cos(angle), u + q / u)
    root = np.where(u > 0, -np.copysign(far, r), 0.0) - b / 3
    for _ in range(NEWTON_STEPS):
        slope = (3 * root + 2 * b) * root + c
        step = (((root + b) * root + c) * root + d) / slope
        root = np.where(np.isfinite(step), root - step, root)
    return np.asarray(root)


def _split(conic: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the two planes (3, H) of a degenerate cone, nan where they are complex."""
    each = np.arange(conic.shape[1])
    adjoint = _adjoint(conic)
    diagonal = adjoint[[0, 3, 5]]
    strongest = np.argmin(diagonal, axis=0)
    columns = adjoint[PLACES[strongest].T, each]
    x, y, z = columns / np.sqrt(-diagonal[strongest, each])
    s00, s01, s02, s11, s12, s22 = conic
    product = np.stack(
        [s00, s01 - z, s02 + y, s01 + z, s11, s12 - x, s02 - y, s12 + x, s22]
    )
    row, column = np.divmod(np.argmax(np.abs(product), axis=0), 3)
    rows = product[3 * row + np.arange(3)[:, None], each]
    columns = product[column + 3 * np.arange(3)[:, None], each]
    return rows, columns


def _cut(planes: FloatArray, cones: FloatArray) -> FloatArray:
    """Return the directions (3, 2 P) in which planes (3, P) cut cones (6, P)."""
    each = np.arange(planes.shape[1])
    k = np.argmax(np.abs(planes), axis=0)
    i, j = (k + 1) % 3, (k + 2) % 3
    # On the plane: component i is 1, j is s, k is f + g s.
    f, g = -planes[i, each] / planes[k, each], -planes[j, each] / planes[k, each]
    ii, jj, kk, ij, ik, jk = (
        cones[PLACES[a, b], each]
        for a, b in ((i, i), (j, j), (k, k), (i, j), (i, k), (j, k))
    )
    square = jj + g * (2 * jk + g * kk)
    half = ij + f * jk + g * (ik + f * kk)
    constant = ii + f * (2 * ik + f * kk)
    product = square * constant
    discriminant = half * half - product
    # Two answers that coincide, as face on, must not be lost to rounding.
    rounding = DOUBLE_ROOT * (half * half + np.abs(product))
    root = np.sqrt(np.where(discriminant > -rounding, np.abs(discriminant), np.nan))
    large = -(half + np.copysign(root, half))
    directions = np.empty((3, 2 * len(each)))
    both = np.arange(2 * len(each))
    s = np.concatenate([large / square, constant / large])
    directions[np.tile(i, 2), both] = 1
    directions[np.tile(j, 2), both] = s
    directions[np.tile(k, 2), both] = np.tile(f, 2) + np.tile(g, 2) * s
    return directions


def _adjoint(s: FloatArray) -> FloatArray:
    s00, s01, s02, s11, s12, s22 = s
    return np.stack(
        [
            s11 * s22 - s12 * s12,
            s02 * s12 - s01 * s22,
            s01 * s12 - s02 * s11,
            s00 * s22 - s02 * s02,
            s01 * s02 - s00 * s12,
            s00 * s11 - s01 * s01,
        ]
    )


def _inner(s: FloatArray, t: FloatArray) -> FloatArray:
    """Return the trace of the product of symmetric matrices."""
    return np.asarray(
        s[0] * t[0]
        + s[3] * t[3]
        + s[5] * t[5]
        + 2 * (s[1] * t[1] + s[2] * t[2] + s[4] * t[4])
    )


def _dot(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(np.einsum("...i,...i->...", a, b))


def _squared(a: FloatArray) -> FloatArray:
    return _dot(a, a)


MAX_SPOTS = 14  # for triples
MAX_GAP = 1.15  # between two LEDs, over the size of the pen
MIN_AREA = 0.1  # of a triangle of spots over the pen's largest, seen face on
RANGE_SIGMA = 0.02  # of the distance known from one spot, relative
SCALE_SIGMA = 0.1  # of all distances alike: blur, threshold, disc diameter
COARSE_SHAPE_TOLERANCE = 0.25  # difference of shapes over their trace
TINY = 1e-12  # px^2, keeps the shape of a point from dividing by zero
TRIPLE_TOLERANCE = 8.0  # px, of a pose from three spots

LOOKALIKE_REACH = 25.0  # px, of the pairing
LOOKALIKE_STEPS = 3
MAX_LOOKALIKE_RMS = 3.0  # px, beyond which a pose is no lookalike


@dataclass(frozen=True)
class SearchEffort:
    """Effort of the search of an image."""

    n_triples: int  # triples of spots tried
    n_hypotheses: int  # LED triples tried for each
    n_poses: int  # poses laid over the spots
    n_settled: int  # labellings refined
    sized: bool = True  # believe that the size of a spot shows its distance


def poses_from_triples(
    sight: SpotArrays, pen: Constellation, effort: SearchEffort
) -> Candidates:
    """Return the most promising poses of each image, each with another labelling."""
    image, triple = _spot_triples(sight, pen, effort)
    of, leds = _led_triples(sight, pen, effort, image, triple)
    image, triple = image[of], triple[of]
    solved = solve_p3p(sight.rays[image[:, None], triple], pen.leds[leds])
    of, R, t = solved
    image, triple, leds = image[of], triple[of], leds[of]
    misfit = _triple_misfit(sight, pen, image, triple, leds, R, t)
    good = first_of_each(image, misfit, effort.n_poses)
    good = good[misfit[good] < COARSE_SHAPE_TOLERANCE]
    matched = match(sight, pen, image[good], R[good], t[good], TRIPLE_TOLERANCE)
    matched = matched.of(matched.n_explained > 3)
    return _most_explaining(matched, TRIPLE_TOLERANCE, effort.n_settled)


def lookalike_poses(
    sight: SpotArrays, pen: Constellation, best: Candidates
) -> Candidates:
    """Return the poses that might look like the ``best``: flipped, or by symmetry.

    A flat pen looks nearly the same when its tilt is reversed, a mirroring at the view
    direction and at its own plane.
    """
    paired = (best.spot >= 0)[..., None]
    n = np.maximum(paired.sum(axis=1), 1)
    middle = (pen.leds * paired).sum(axis=1) / n
    arms = (pen.leds - middle[:, None]) * paired
    flat = np.linalg.eigh(np.swapaxes(arms, 1, 2) @ arms).eigenvectors[:, :, 0]
    middle_cam = np.einsum("cij,cj->ci", best.R, middle) + best.t
    view = middle_cam / np.linalg.norm(middle_cam, axis=1, keepdims=True)
    R = reflection(view) @ best.R @ reflection(flat)
    t = middle_cam - np.einsum("cij,cj->ci", R, middle)
    flipped = replace(best, R=R, t=t)
    n_motions = len(pen.self_rotations)
    one = np.repeat(np.arange(len(best)), n_motions)
    R = (best.R[:, None] @ pen.self_rotations).reshape(-1, 3, 3)
    t = (pen.self_translations @ np.swapaxes(best.R, 1, 2) + best.t[:, None]).reshape(
        -1, 3
    )
    turned = match(sight, pen, best.image[one], R, t, LOOKALIKE_REACH)
    # One that explains fewer spots is no rival.
    turned = turned.of(turned.n_explained >= best.n_explained[one] - 1)
    fitted = fit(sight, pen, join([flipped, turned]), n_steps=LOOKALIKE_STEPS)
    return fitted.of(fitted.rms < MAX_LOOKALIKE_RMS)


def _spot_triples(
    sight: SpotArrays, pen: Constellation, effort: SearchEffort
) -> tuple[IntArray, IntArray]:
    """Return images (G,) and triples (G, 3) of spots that may be LEDs."""
    there = sight.rays * np.where(sight.usable, sight.ranges, 0.0)[..., None]
    gaps = np.linalg.norm(there[:, :, None] - there[:, None], axis=-1)
    near = sight.usable[:, :, None] & sight.usable[:, None]
    if effort.sized:
        near = near & (gaps < MAX_GAP * pen.size)
    # Spots with many others at the distances of the pen; brighter ones first.
    order = np.argsort(-near.sum(axis=2), axis=1, kind="stable")[:, :MAX_SPOTS]
    combos = _triples_of(order.shape[1])
    triples = order[:, combos]
    rows = np.arange(len(order))[:, None]
    a, b, c = triples[..., 0], triples[..., 1], triples[..., 2]
    plausible = near[rows, a, b] & near[rows, a, c] & near[rows, b, c]
    p, q = (sight.points[rows, x] - sight.points[rows, a] for x in (b, c))
    scale = (there[rows, a, 2] / sight.focal) ** 2
    area = np.abs(p[..., 0] * q[..., 1] - p[..., 1] * q[..., 0]) * scale
    if effort.n_triples == 1:
        score = -area
    else:
        # Many large triangles share the same, perhaps foreign, spot: draw lots.
        score = _lots(len(combos)) + (area < MIN_AREA * _largest_area(pen))
    score = np.where(plausible, score, np.inf)
    first = np.argsort(score, axis=1)[:, : effort.n_triples]
    image, which = np.nonzero(np.isfinite(np.take_along_axis(score, first, axis=1)))
    return image, triples[image, first[image, which]]


@lru_cache(maxsize=MAX_SPOTS)
def _triples_of(n: int) -> IntArray:
    """Return the index triples of n items, low numbers first.

    So the order of a triple is independent of the other images that are labelled.
    """
    triples = sorted(combinations(range(n), 3), key=lambda triple: triple[::-1])
    return np.array(triples, dtype=np.int64).reshape(-1, 3)


@lru_cache(maxsize=MAX_SPOTS)
def _lots(n: int) -> FloatArray:
    return np.random.default_rng(0).random(n)


@lru_cache(maxsize=16)
def _largest_area(pen: Constellation) -> float:
    """Return twice the area of the largest triangle of LEDs, mm^2 (Heron's formula)."""
    a, b, c = pen.sides.T
    s = (a + b + c) / 2
    return float(2 * np.sqrt(np.max(s * (s - a) * (s - b) * (s - c))))


def _led_triples(
    sight: SpotArrays,
    pen: Constellation,
    effort: SearchEffort,
    image: IntArray,
    triple: IntArray,
) -> tuple[IntArray, IntArray]:
    """Return which spot triple (H,) is supposed to be which LED triple (H, 3).

    The sides of the triangle that the ranges suggest are compared with those of the pen
    by their Mahalanobis distance; the best continue.
    """
    if not effort.sized:
        some = pen.triples[:: 1 + len(pen.triples) // (2 * effort.n_hypotheses)]
        of = np.repeat(np.arange(len(image)), len(some))
        return of, np.tile(some, (len(image), 1))
    ranges = sight.ranges[image[:, None], triple]
    corners = sight.rays[image[:, None], triple] * ranges[..., None]
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    edges = np.stack([a - b, a - c, b - c], axis=1)
    sides = np.linalg.norm(edges, axis=-1)
    # d side / d log range, for each of the corners
    first, second = [0, 0, 1], [1, 2, 2]
    J = np.zeros((len(image), 3, 3))
    side = np.arange(3)
    J[:, side, first] = np.einsum("gsi,gsi->gs", edges, corners[:, first]) / sides
    J[:, side, second] = -np.einsum("gsi,gsi->gs", edges, corners[:, second]) / sides
    one, all_alike = RANGE_SIGMA, SCALE_SIGMA
    covariance = J @ (one**2 * np.eye(3) + all_alike**2) @ np.swapaxes(J, 1, 2)
    bend = (one * ranges.mean(axis=1)[:, None]) ** 2 / sides  # second order in range
    covariance[:, side, side] += bend**2 + 1.0
    whiten = np.linalg.inv(np.linalg.cholesky(covariance))
    distances = pen.sides @ np.swapaxes(whiten, 1, 2)
    distances -= np.einsum("gij,gj->gi", whiten, sides)[:, None]
    misfit = np.einsum("gqi,gqi->gq", distances, distances)
    n = min(effort.n_hypotheses, misfit.shape[1])
    best = np.argpartition(misfit, n - 1, axis=1)[:, :n]
    return np.repeat(np.arange(len(image)), n), pen.triples[best].reshape(-1, 3)


def _triple_misfit(
    sight: SpotArrays,
    pen: Constellation,
    image: IntArray,
    triple: IntArray,
    leds: IntArray,
    R: FloatArray,
    t: FloatArray,
) -> FloatArray:
    """Return how unlike the three spots are to the discs supposed, relative to size."""
    R_t = np.swapaxes(R, 1, 2)
    centers = pen.leds[leds] @ R_t + t[:, None]
    normals = pen.normals[leds] @ R_t
    towards = -np.einsum("hki,hki->hk", normals, centers)
    facing = (towards > MIN_FACING * np.linalg.norm(centers, axis=-1)).all(axis=1)
    misfit = np.full(len(image), np.inf)
    conics = conic_images(centers[facing], normals[facing], pen.radius)
    misfit[facing] = _shape_misfit(
        sight.focal**2 * conics.shapes,
        sight.shapes[image[facing, None], triple[facing]],
    )
    return misfit


def _shape_misfit(predicted: FloatArray, measured: FloatArray) -> FloatArray:
    """Return how unlike shapes (H, 3, 2, 2) are, each three alike to scale, (H,)."""
    size = np.maximum(np.einsum("hkii->hk", predicted), TINY)
    scale = (np.einsum("hkii->hk", measured) / size).mean(axis=1)
    difference = measured / scale[:, None, None, None] - predicted
    squares = np.einsum("hkij,hkij->hk", difference, difference) / size**2
    low, high = AREA_RANGE
    right = (scale > 0.8 * low) & (scale < 1.2 * high)
    return np.where(right, np.sqrt(squares.mean(axis=1)), np.inf)


def first_of_each(group: IntArray, score: FloatArray, n: int) -> IntArray:
    """Return the indices of the n lowest scores (C,) in each group (C,)."""
    order = np.lexsort((score, group))
    ordered = group[order]
    start = np.searchsorted(ordered, ordered)
    return order[np.arange(len(order)) - start < n]


def _most_explaining(candidates: Candidates, reach: float, n: int) -> Candidates:
    """Return n candidates of each image that explain most, with distinct labellings."""
    score = candidates.sum_squares - reach**2 * candidates.n_explained
    base = 2 * candidates.spot.max(initial=0) + 3  # odd: wrapping round loses nothing
    key = (candidates.spot + 1) @ base ** np.arange(candidates.spot.shape[1])
    order = np.lexsort((score, key, candidates.image))
    image, key = candidates.image[order], key[order]
    new = np.ones(len(order), dtype=bool)
    new[1:] = (image[1:] != image[:-1]) | (key[1:] != key[:-1])
    distinct = order[new]
    best = first_of_each(candidates.image[distinct], score[distinct], n)
    return candidates.of(distinct[best])
