"""Initial values of feature fits: algebraic solutions.

Cylinder and cone are quadrics about an axis along z, ``x^2 + y^2 = 2 a x + 2 b y + c
+ d z + e z^2``, linear in the unknowns once the direction of the axis is given.
Directions over a half sphere are tried, and each of the best few starts a fit. With few
points each direction goes some steps first, all of them together, as the best at first
may lead to a false minimum.
"""

from collections.abc import Iterator
from itertools import islice

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.model.rigid import rotation_from_vector
from lightpen_extensions.measure.measuring.surfaces import FeatureKind

N_DIRECTIONS = 200  # over the half sphere: some 10 degrees apart
N_FEW_DIRECTIONS = 400  # with few points
N_NEAR = 15  # directions about a principal axis
RIDGE = 1e-12
FEW = 16  # points, which hardly tell false minima apart
N_STARTS, N_FEW_STARTS = 4, 12  # fits that begin at the best of them
N_STEPS, DAMPING = 6, 1e-3  # of all directions, before the best of few points are taken
N_TRIED = 24  # points, drawn from more, that directions are tried with
APART = 0.995  # cosine between two starts
LEAST_ANGLE = 1e-3  # rad, of a cone at its start
TINY = float(np.finfo(float).tiny)
Start = tuple[FloatArray, FloatArray, FloatArray]
"""Origin (3,), axes (3, 3) as columns, sizes (S,)."""


def frame_about(axis: FloatArray) -> FloatArray:
    """Return right-handed axes (..., 3, 3) as columns, z along vectors (..., 3)."""
    z = axis / np.linalg.norm(axis, axis=-1, keepdims=True)
    x = np.cross(np.eye(3)[np.argmin(np.abs(z), axis=-1)], z)
    x /= np.linalg.norm(x, axis=-1, keepdims=True)
    return np.stack([x, np.cross(z, x), z], axis=-1)


def starts(kind: FeatureKind, points: FloatArray) -> Iterator[Start]:
    """Yield where fits of a feature to points (N, 3) may begin."""
    middle = points.mean(axis=0)
    _, _, axes = np.linalg.svd(points - middle, full_matrices=False)
    match kind:
        case FeatureKind.POINT:
            yield middle, np.eye(3), np.zeros(0)
        case FeatureKind.LINE:
            yield middle, frame_about(axes[0]), np.zeros(0)
        case FeatureKind.PLANE:
            yield middle, frame_about(axes[2]), np.zeros(0)
        case FeatureKind.SPHERE:
            center, radius = _algebraic(points - middle)
            yield middle + center, np.eye(3), np.array([radius])
        case FeatureKind.CIRCLE:
            frame = frame_about(axes[2])
            center, radius = _algebraic((points - middle) @ frame[:, :2])
            yield middle + frame[:, :2] @ center, frame, np.array([radius])
        case FeatureKind.CYLINDER | FeatureKind.CONE:
            few = np.random.default_rng(0).permutation(len(points))[:N_TRIED]
            found = _by_direction(kind, points[few] - middle, middle, axes)
            is_few = len(points) <= FEW
            yield from islice(found, N_FEW_STARTS if is_few else N_STARTS)


def _algebraic(points: FloatArray) -> tuple[FloatArray, float]:
    """Return centre and radius of the algebraic circle or sphere (Kasa 1976)."""
    A = np.column_stack([2 * points, np.ones(len(points))])
    *center, rest = np.linalg.lstsq(A, np.sum(points**2, axis=1))[0]
    return np.array(center), float(np.sqrt(max(rest + np.dot(center, center), 0)))


def _directions(n: int, axes: FloatArray) -> FloatArray:
    """Return n directions evenly over a half sphere, and closer about principal axes.

    The former lie on Fibonacci's spiral; the latter are for flat cones and short arcs.
    """
    k = np.arange(n) + 0.5
    z = k / n
    turn = np.pi * (1 + np.sqrt(5)) * k
    across = np.sqrt(1 - z**2)
    evenly = np.column_stack([across * np.cos(turn), across * np.sin(turn), z])
    near = [
        evenly[::-1][:N_NEAR] @ np.diag((each, each, 1)) @ frame_about(axis).T
        for axis in axes
        for each in (0.0, 0.1, 0.4)
    ]
    directions = np.concatenate([evenly, *near])
    return np.asarray(directions / np.linalg.norm(directions, axis=1)[:, None])


def _by_direction(
    kind: FeatureKind, points: FloatArray, middle: FloatArray, axes: FloatArray
) -> Iterator[Start]:
    is_few = len(points) <= FEW
    directions = _directions(N_FEW_DIRECTIONS if is_few else N_DIRECTIONS, axes)
    frames = frame_about(directions)
    x, y, z = np.moveaxis(points @ frames, -1, 0)  # (D, N) each
    columns = [x, y, np.ones_like(x)]
    if kind is FeatureKind.CONE:
        columns += [z, z**2]
    A = np.stack(columns, axis=1)  # (D, C, N)
    # Normal equations do for a start; a direction that determines nothing is damped.
    normal = A @ np.swapaxes(A, 1, 2)
    scale = np.sqrt(np.einsum("dcc->dc", normal)) + TINY
    normal = normal / (scale[:, None] * scale[..., None]) + RIDGE * np.eye(len(columns))
    right = A @ (x**2 + y**2)[..., None] / scale[..., None]
    a, b = (np.linalg.solve(normal, right)[:, :2, 0] / scale[:, :2] / 2).T
    rho = np.hypot(x - a[:, None], y - b[:, None])
    slope, radius = np.zeros(len(x)), rho.mean(axis=1)
    if kind is FeatureKind.CONE:
        own = z - z.mean(axis=1, keepdims=True)
        slope = np.sum(own * rho, axis=1) / (np.sum(own**2, axis=1) + TINY)
        radius = radius - slope * z.mean(axis=1)
    unknowns = np.column_stack([a, b, radius, slope])
    if is_few:
        frames, unknowns = _some_steps(kind, points, frames, unknowns)
        directions = frames[..., 2]
    a, b, radius, slope = unknowns.T
    misfits = np.sum(_residuals(points @ frames, unknowns) ** 2, axis=1)
    taken: list[FloatArray] = []
    for i in np.argsort(misfits).tolist():
        if any(abs(directions[i] @ other) > APART for other in taken):
            continue
        taken.append(directions[i])
        origin = middle + frames[i] @ np.array([a[i], b[i], 0.0])
        if kind is FeatureKind.CYLINDER:
            yield origin, frames[i], radius[i : i + 1]
            continue
        angle = np.arctan(slope[i])
        if abs(angle) < LEAST_ANGLE:
            angle = LEAST_ANGLE
        yield origin, frames[i], np.array([radius[i], angle])


def _residuals(q: FloatArray, unknowns: FloatArray) -> FloatArray:
    """Return distances (D, N) of points (D, N, 3) from cones about z."""
    a, b, radius, slope = unknowns.T[..., None]
    rho = np.hypot(q[..., 0] - a, q[..., 1] - b)
    return np.asarray((rho - radius - slope * q[..., 2]) / np.sqrt(1 + slope**2))


def _some_steps(
    kind: FeatureKind, points: FloatArray, frames: FloatArray, unknowns: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return frames (D, 3, 3) and place, radius, slope (D, 4) after damped steps.

    A frame turns about its x and y axes; a step that makes a fit worse is not taken.
    """
    n_free = 6 if kind is FeatureKind.CONE else 5  # the slope comes last
    before = _residuals(points @ frames, unknowns)
    for _ in range(N_STEPS):
        x, y, z = np.moveaxis(points @ frames, -1, 0)
        a, b, _, slope = unknowns.T[..., None]
        rho = np.hypot(x - a, y - b) + TINY
        cos, sin = (x - a) / rho, (y - b) / rho
        ones = np.ones_like(x)
        columns = [-cos, -sin, -ones, sin * z + slope * y, -cos * z - slope * x, -z]
        J = np.stack(columns[:n_free], axis=2) / np.sqrt(1 + slope**2)[..., None]
        normal = np.swapaxes(J, 1, 2) @ J
        scale = np.einsum("dcc->dc", normal) + TINY
        normal = normal + DAMPING * scale[..., None] * np.eye(n_free)
        right = -np.swapaxes(J, 1, 2) @ before[..., None]
        step = np.linalg.solve(normal, right)[..., 0]
        moved = unknowns.copy()
        moved[:, :3] += step[:, :3]
        moved[:, 3] += step[:, 5] if n_free == 6 else 0.0
        turn = np.column_stack([step[:, 3:5], np.zeros(len(step))])
        turned = frames @ rotation_from_vector(turn)
        after = _residuals(points @ turned, moved)
        is_better = np.sum(after**2, axis=1) < np.sum(before**2, axis=1)
        frames = np.where(is_better[:, None, None], turned, frames)
        unknowns = np.where(is_better[:, None], moved, unknowns)
        before = np.where(is_better[:, None], after, before)
    return frames, unknowns
