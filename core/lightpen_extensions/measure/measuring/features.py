"""Features of least squares of the orthogonal distances, with the full covariance.

The sum of the squared distances is minimised by Gauss-Newton steps with
Levenberg-Marquardt's damping; the frame of the feature moves along, so the unknowns are
small motions of it. At the solution the unknowns follow the points by

    dp = -(J^T J)^-1 J^T G dX

with the derivatives ``J`` of the distances by the unknowns and ``G`` by the points. It
propagates the covariance of all points, common parts included, to the feature.

References
----------
.. [1] A. B. Forbes, "Least-squares best-fit geometric elements", NPL Report DITC 140/89
   (1989).
.. [2] ISO 10360-6:2001, Estimation of errors in computing Gaussian associated features.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.model.rigid import rotation_from_vector, skew
from lightpen_extensions.measure.measuring.surfaces import (
    NAMES,
    SURFACES,
    FeatureKind,
    FeatureModel,
)

# Initial values of feature fits: algebraic solutions.
#
# Cylinder and cone are quadrics about an axis along z, ``x^2 + y^2 = 2 a x + 2 b y + c
# + d z + e z^2``, linear in the unknowns once the direction of the axis is given.
# Directions over a half sphere are tried, and each of the best few starts a fit. With
# few points each direction goes some steps first, all of them together, as the best at
# first may lead to a false minimum.


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
    """Return right-handed axes (..., 3, 3) as columns, z along vectors (..., 3).

    The first is as near as can be to the axis that lies most across.
    """
    z = axis / np.linalg.norm(axis, axis=-1, keepdims=True)
    x = np.eye(3)[np.argmin(np.abs(z), axis=-1)]
    x = x - np.sum(x * z, axis=-1, keepdims=True) * z
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


MAX_STEPS = 200
ROUGHLY, CONVERGED = 1e-7, 1e-15  # of the extent of the points
SHRINKS = 0.5  # a step before rounding by this at least
LEAST_DAMPING, LARGEST_DAMPING = 1e-14, 1e8  # the least keeps a system regular
ROUNDING = 1e-12  # relative, of a sum of squares: within it, no step is worse
UNDETERMINED = 1e-7  # of the largest singular value, columns scaled
FRAMED = {FeatureKind.POINT, FeatureKind.SPHERE}  # their axes mean nothing
FOLLOWING = {
    *(FeatureKind.LINE, FeatureKind.PLANE, FeatureKind.CYLINDER, FeatureKind.CONE)
}
PLACE, AXIS = slice(0, 3), slice(3, 6)


@dataclass(frozen=True, eq=False)
class Feature:
    """A fitted feature."""

    kind: FeatureKind
    # (3,), mm: centre of point, circle, sphere; of line, plane, cylinder and cone
    # the point nearest to the mean of the points
    origin: FloatArray
    # (3, 3), of its frame, as columns; z is the axis of cylinder and cone, direction of
    # a line, normal of plane and circle
    axes: FloatArray
    sizes: FloatArray  # (S,), see `FeatureModel.sizes`; radius of a cone at its origin
    distances: FloatArray  # (N, K), of the points from it, mm
    # (6 + S, 3 N), derivative of origin, axis and sizes by the points
    by_points: FloatArray
    # (N K, 3 N), derivative of the distances by the points, the feature following
    distances_by_points: FloatArray
    offsets: FloatArray  # (N, 3), from the feature to the points, mm

    @property
    def axis(self) -> FloatArray:
        """Direction of the line, axis or normal, (3,)."""
        return self.axes[:, 2]

    @property
    def values(self) -> FloatArray:
        """Origin, axis and sizes, (6 + S,)."""
        return np.concatenate([self.origin, self.axis, self.sizes])

    @property
    def form_error(self) -> float:
        """Peak-to-valley distance, mm; of a line twice the largest."""
        if self.kind in {FeatureKind.LINE, FeatureKind.POINT}:
            return 2 * float(np.linalg.norm(self.distances, axis=1).max())
        return float(np.ptp(self.distances[:, 0]))

    def distance_of(self, point: FloatArray) -> float:
        """Return the signed distance of a point (3,) from a surface, or its length."""
        q = (point - self.origin) @ self.axes
        off = SURFACES[self.kind].distances(q[None], self.sizes).values[0]
        return float(off[0] if len(off) == 1 else np.linalg.norm(off))


def fit_feature(kind: FeatureKind, points: FloatArray) -> Feature:
    """Fit a feature of a kind to points (N, 3), mm.

    Raises `CalibrationError` if they are too few or do not determine the feature.
    """
    surface = SURFACES[kind]
    if len(points) < surface.min_points:
        raise CalibrationError(
            "measuring.too-few",
            kind=NAMES[kind],
            n_points=len(points),
            needed=surface.min_points,
        )
    solved = [_solve(surface, points, start, ROUGHLY) for start in starts(kind, points)]
    best, _ = min(solved, key=lambda each: each[1])
    return _feature(kind, points, _solve(surface, points, best, CONVERGED)[0])


def _jacobian(
    surface: FeatureModel, points: FloatArray, at: Start
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return distances (M,), their derivatives (M, U), and by the points (N, K, 3)."""
    origin, axes, sizes = at
    q = (points - origin) @ axes
    found, J = surface.derivatives(q, sizes)
    by_points = found.by_point @ axes.T
    return found.values.ravel(), J.reshape(-1, surface.n_unknowns), by_points


def _moved(surface: FeatureModel, at: Start, step: FloatArray) -> Start:
    origin, axes, sizes = at
    n_free = len(surface.free)
    motion = np.zeros(6)
    motion[list(surface.free)] = step[:n_free]
    return (
        origin + axes @ motion[:3],
        axes @ rotation_from_vector(motion[3:]),
        sizes + step[n_free:],
    )


def _solve(
    surface: FeatureModel, points: FloatArray, start: Start, converged: float
) -> tuple[Start, float]:
    """Return the feature of least squares from a start, and its sum of squares."""
    extent = max(float(np.ptp(points, axis=0).max()), np.finfo(float).tiny)
    at, damping, before = start, 1e-6, np.inf
    values, J, _ = _jacobian(surface, points, at)
    cost = float(values @ values)
    for _ in range(MAX_STEPS):
        scale = np.sqrt(np.einsum("mu,mu->u", J, J)) + np.finfo(float).tiny
        scaled, damper = J / scale, np.eye(J.shape[1])
        if converged >= ROUGHLY:
            normal = scaled.T @ scaled + damping * damper
            step = np.linalg.solve(normal, -scaled.T @ values) / scale
        else:
            damped = np.vstack([scaled, np.sqrt(damping) * damper])
            wanted = np.concatenate([-values, np.zeros(J.shape[1])])
            step = np.linalg.lstsq(damped, wanted)[0] / scale
        after = _moved(surface, at, step)
        values_after, J_after, _ = _jacobian(surface, points, after)
        cost_after = float(values_after @ values_after)
        length = float(np.abs(step * scale).max()) / (extent * np.sqrt(len(points)))
        # At the end rounding alone is left: steps are small and shrink no more.
        small = length <= converged or SHRINKS * before < length < ROUGHLY
        before = length
        if cost_after <= cost * (1 + ROUNDING):
            at, values, J = after, values_after, J_after
            cost, damping = cost_after, max(damping / 10, LEAST_DAMPING)
        else:
            damping *= 10
        if small or damping > LARGEST_DAMPING:
            break
    return at, cost


def _feature(kind: FeatureKind, points: FloatArray, at: Start) -> Feature:
    """Return a solved feature with its derivatives, in its standard form."""
    surface = SURFACES[kind]
    origin, axes, sizes = _standard(kind, points, at)
    values, J, by_point = _jacobian(surface, points, (origin, axes, sizes))
    scale = np.linalg.norm(J, axis=0)
    if not (scale > 0).all() or np.linalg.cond(J / scale) > 1 / UNDETERMINED:
        raise CalibrationError("measuring.undetermined", kind=NAMES[kind])
    n, k, _ = by_point.shape
    G = np.zeros((n, k, n, 3))
    G[np.arange(n), :, np.arange(n)] = by_point
    direct = G.reshape(n * k, 3 * n)
    unknowns = -np.linalg.pinv(J) @ direct
    by_distances = direct + J @ unknowns
    n_free = len(surface.free)
    motion = np.zeros((6, 3 * n))
    motion[list(surface.free)] = unknowns[:n_free]
    if kind in FOLLOWING:  # the mean of the points, where the feature is free
        along = [i for i in range(3) if i not in surface.free]
        a, b, _ = (points.mean(axis=0) - origin) @ axes
        of_mean = axes.T @ np.tile(np.eye(3), n) / n
        of_mean[2] += a * motion[4] - b * motion[3]
        motion[along] = of_mean[along]
        if kind is FeatureKind.CONE:
            unknowns[n_free] += np.tan(sizes[1]) * motion[2]
    by_points = np.concatenate(
        [axes @ motion[:3], -skew(axes[:, 2]) @ axes @ motion[3:], unknowns[n_free:]]
    )
    distances = values.reshape(n, k)
    offsets = np.einsum("nk,nkd->nd", distances, by_point)
    return Feature(
        kind, origin, axes, sizes, distances, by_points, by_distances, offsets
    )


def _standard(kind: FeatureKind, points: FloatArray, at: Start) -> Start:
    """Return a feature with a unique frame and positive sizes."""
    origin, axes, sizes = at
    middle = points.mean(axis=0)
    z = axes[:, 2]
    if kind in FOLLOWING - {FeatureKind.PLANE}:
        shift = float((middle - origin) @ z)
        origin = origin + shift * z
        if kind is FeatureKind.CONE:
            sizes = np.array([sizes[0] + shift * np.tan(sizes[1]), sizes[1]])
    elif kind is FeatureKind.PLANE:
        origin = middle - float((middle - origin) @ z) * z
    if kind is FeatureKind.CONE:
        if sizes[1] < 0:
            axes, sizes = axes * (1, -1, -1), sizes * (1, -1)
    elif kind not in FRAMED and z[int(np.argmax(np.abs(z)))] < 0:
        axes = axes * (1, -1, -1)
    return origin, axes, sizes
