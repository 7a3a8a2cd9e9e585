"""Features by the minimum-zone, inscribed and circumscribed criteria.

Each is the limit of linear programs: the distances are linearised at the present
feature, and the best step within a trust region is taken while it improves the fit.

References
----------
.. [1] ISO 1101:2017, ISO 12180, 12181, 12780, 12781 (definitions).
.. [2] G. T. Anthony et al., "Reference software for finding Chebyshev best-fit
   geometric elements", Precision Engineering 19 (1996) 28-36.
"""

from dataclasses import replace
from enum import Enum

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.measuring.features import fit_feature
from lightpen.measuring.surfaces import NAMES, SURFACES, FeatureKind
from lightpen.messages import message
from lightpen.model.rigid import rotation_from_vector

MAX_STEPS = 100
CONVERGED = 1e-13  # of the extent of the points


class Criterion(Enum):
    """What is least, or greatest."""

    MINIMUM_ZONE = "minimum zone"
    INSCRIBED = "maximum inscribed"
    CIRCUMSCRIBED = "minimum circumscribed"


CRITERIA = {
    Criterion.MINIMUM_ZONE: message("measuring.minimum-zone"),
    Criterion.INSCRIBED: message("measuring.inscribed"),
    Criterion.CIRCUMSCRIBED: message("measuring.circumscribed"),
}
ZONES = {
    Criterion.MINIMUM_ZONE: (
        FeatureKind.LINE,
        FeatureKind.PLANE,
        FeatureKind.CIRCLE,
        FeatureKind.SPHERE,
        FeatureKind.CYLINDER,
        FeatureKind.CONE,
    ),
    Criterion.INSCRIBED: (FeatureKind.CIRCLE, FeatureKind.SPHERE, FeatureKind.CYLINDER),
    Criterion.CIRCUMSCRIBED: (
        FeatureKind.CIRCLE,
        FeatureKind.SPHERE,
        FeatureKind.CYLINDER,
    ),
}
"""The kinds that each criterion is defined for. A circle stays in the plane of least
squares; a line is the axis of the thinnest cylinder about the points."""


def fit_zone(
    kind: FeatureKind, points: FloatArray, criterion: Criterion
) -> tuple[FloatArray, FloatArray, FloatArray, float]:
    """Fit a feature by a criterion.

    Parameters
    ----------
    points : (N, 3) array
        mm.

    Returns
    -------
    origin, axes, sizes : (3,), (3, 3), (S,) array
        As `features.Feature` has them.
    zone : float
        Width of the zone, mm: peak to valley; of a line the diameter of its cylinder.

    Raises
    ------
    CalibrationError
        The criterion is not defined for the kind, or the points do not determine it.
    """
    if kind not in ZONES[criterion]:
        raise CalibrationError(
            "measuring.no-criterion", kind=NAMES[kind], criterion=CRITERIA[criterion]
        )
    start = fit_feature(kind, points)
    origin, axes, sizes = start.origin, start.axes, start.sizes
    about = kind
    fixed: tuple[int, ...] = ()
    if kind is FeatureKind.LINE:
        about, criterion = FeatureKind.CYLINDER, Criterion.CIRCUMSCRIBED
        radial = np.linalg.norm(((points - origin) @ axes)[:, :2], axis=1)
        sizes = np.array([radial.max()])
    elif kind is FeatureKind.CIRCLE:
        about, fixed = FeatureKind.CYLINDER, (3, 4)
    surface = SURFACES[about]
    free = [each for each in surface.free if each not in fixed]
    surface = replace(surface, free=tuple(free))
    extent = float(np.ptp(points, axis=0).max())
    reach = 0.1 * extent

    def merit_of(d: FloatArray, sizes: FloatArray) -> float:
        radius = float(sizes[0]) if len(sizes) else 0.0
        match criterion:
            case Criterion.MINIMUM_ZONE:
                return float(np.abs(d).max())
            case Criterion.CIRCUMSCRIBED:
                return radius + float(d.max())
            case Criterion.INSCRIBED:
                return -radius - float(d.min())

    def evaluated(
        origin: FloatArray, axes: FloatArray, sizes: FloatArray
    ) -> tuple[FloatArray, FloatArray, float]:
        (values, *_), J = surface.derivatives((points - origin) @ axes, sizes)
        return values[:, 0], J[:, 0], merit_of(values[:, 0], sizes)

    d, J, merit = evaluated(origin, axes, sizes)
    for _ in range(MAX_STEPS):
        step = _best_step(d, J, len(free), criterion, reach)
        resized = sizes + step[len(free) :]
        if merit - merit_of(d + J @ step, resized) <= CONVERGED * extent:
            break
        motion = np.zeros(6)
        motion[free] = step[: len(free)]
        after = (
            origin + axes @ motion[:3],
            axes @ rotation_from_vector(motion[3:]),
            resized,
        )
        d_after, J_after, merit_after = evaluated(*after)
        if merit_after < merit:
            gain = merit - merit_after
            (origin, axes, sizes), d, J, merit = after, d_after, J_after, merit_after
            reach *= 2
            if gain <= CONVERGED * extent:
                break
        else:
            reach /= 4
            if reach <= CONVERGED * extent:
                break
    if criterion is Criterion.CIRCUMSCRIBED:
        sizes = np.array([merit])
    elif criterion is Criterion.INSCRIBED:
        sizes = np.array([-merit])
    if kind is FeatureKind.LINE:
        return origin, axes, np.zeros(0), 2 * merit
    d = evaluated(origin, axes, sizes)[0]
    return origin, axes, sizes, float(np.ptp(d))


def _best_step(
    d: FloatArray, J: FloatArray, n_motions: int, criterion: Criterion, reach: float
) -> FloatArray:
    """Return the step of a linear program within a reach, (U,)."""
    from scipy.optimize import linprog  # 0.4 s

    n, n_unknowns = J.shape
    scale = np.maximum(np.abs(J).max(axis=0), 1e-12)
    A = J / scale
    bounds: list[tuple[float | None, float | None]] = [(-reach, reach)] * n_unknowns
    if criterion is Criterion.MINIMUM_ZONE:
        # Least t with -t <= d + A s <= t.
        rows = np.vstack(
            [np.column_stack([A, -np.ones(n)]), np.column_stack([-A, -np.ones(n)])]
        )
        right = np.concatenate([-d, d])
        goal = np.append(np.zeros(n_unknowns), 1.0)
        bounds.append((0, None))
    else:
        sign = 1.0 if criterion is Criterion.CIRCUMSCRIBED else -1.0
        # Least (greatest) radius with all points inside (outside).
        rows, right = sign * A, -sign * d
        goal = np.zeros(n_unknowns)
        goal[n_motions] = sign / scale[n_motions]
        bounds[n_motions] = (None, None)
    found = linprog(goal, A_ub=rows, b_ub=right, bounds=bounds, method="highs")
    if found.x is None:
        return np.zeros(n_unknowns)
    return np.asarray(found.x[:n_unknowns] / scale)
