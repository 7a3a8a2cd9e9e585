"""Pose from three points and their lines of sight, in closed form.

The ranges ``r_i`` along the unit rays ``y_i`` obey three equations of the kind
``|r_1 y_1 - r_2 y_2|^2 = a_12``. Eliminating the scale leaves two cones in the ranges,
and the pencil of the two holds a degenerate member, found as a root of a cubic: a pair
of planes. Each plane cuts a cone in two directions, so there are up to four answers.
The pencil is that of [1]_; the planes are split with the adjoint matrix as in [2]_.

References
----------
.. [1] M. Persson, K. Nordberg, "Lambda Twist: an accurate fast robust perspective three
   point (P3P) solver", ECCV 2018.
.. [2] Y. Ding, J. Yang, V. Larsson, C. Olsson, K. Astrom, "Revisiting the P3P problem",
   CVPR 2023.
"""

from typing import NamedTuple

import numpy as np

from lightpen.arrays import FloatArray, IntArray

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
