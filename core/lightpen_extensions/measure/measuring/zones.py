"""Features by the minimum-zone, inscribed and circumscribed criteria.

Each is the limit of linear programs: the distances are linearised at the present
feature, and the best step within a trust region is taken while it improves the fit.

References
----------
.. [1] ISO 1101:2017, ISO 12180, 12181, 12780, 12781 (definitions).
.. [2] G. T. Anthony et al., "Reference software for finding Chebyshev best-fit
   geometric elements", Precision Engineering 19 (1996) 28-36.
.. [3] C. E. Lemke, "The dual method of solving the linear programming problem", Naval
   Research Logistics Quarterly 1 (1954) 36-47.
"""

from dataclasses import replace
from enum import Enum

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.messages import message
from lightpen.model.rigid import rotation_from_vector
from lightpen_extensions.measure.measuring.features import fit_feature
from lightpen_extensions.measure.measuring.starts import Start
from lightpen_extensions.measure.measuring.surfaces import (
    NAMES,
    RADIAL,
    SURFACES,
    FeatureKind,
)

MAX_STEPS = 100
CONVERGED = 1e-13  # of the extent of the points
MAX_EXCHANGES = 200  # of a linear program; then a shorter step is tried
ROUNDING, TINY = 1e-15, 1e-12


class Criterion(Enum):
    """Criterion: minimum or maximum."""

    MINIMUM_ZONE = "minimum zone"
    INSCRIBED = "maximum inscribed"
    CIRCUMSCRIBED = "minimum circumscribed"


CRITERIA = {
    Criterion.MINIMUM_ZONE: message("measuring.minimum-zone"),
    Criterion.INSCRIBED: message("measuring.inscribed"),
    Criterion.CIRCUMSCRIBED: message("measuring.circumscribed"),
}
ZONES = {
    Criterion.MINIMUM_ZONE: RADIAL
    | {FeatureKind.LINE, FeatureKind.PLANE, FeatureKind.CONE},
    Criterion.INSCRIBED: RADIAL,
    Criterion.CIRCUMSCRIBED: RADIAL,
}
"""The kinds that each criterion is defined for. A circle stays in the plane of least
squares; a line is the axis of the thinnest cylinder about the points."""


def fit_zone(
    kind: FeatureKind, points: FloatArray, criterion: Criterion
) -> tuple[FloatArray, FloatArray, FloatArray, float]:
    """Fit a feature to points (N, 3), mm, by a criterion.

    Returns origin, axes and sizes as `features.Feature` has them, and the width of the
    zone, mm: peak to valley; of a line the diameter of its cylinder. Raises
    `CalibrationError` if the criterion is not defined for the kind, or the points do
    not determine it.
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

    # Each criterion lowers the highest of some heights, functions of motions and sizes.
    sign = -1.0 if criterion is Criterion.INSCRIBED else 1.0

    def heights(at: Start) -> tuple[FloatArray, FloatArray]:
        origin, axes, sizes = at
        (values, *_), J = surface.derivatives((points - origin) @ axes, sizes)
        d, A = values[:, 0], J[:, 0]
        if criterion is Criterion.MINIMUM_ZONE:
            return np.concatenate([d, -d]), np.concatenate([A, -A])
        return sign * (d + sizes[0]), sign * A[:, : len(free)]  # free of the radius

    at = origin, axes, sizes
    h, A = heights(at)
    for _ in range(MAX_STEPS):
        step = _lowering_step(h, A, reach)
        if h.max() - (h + A @ step).max() <= CONVERGED * extent:
            break
        motion, resized = np.zeros(6), at[2].copy()
        motion[free] = step[: len(free)]
        resized[: len(step) - len(free)] += step[len(free) :]
        after = (
            at[0] + at[1] @ motion[:3],
            at[1] @ rotation_from_vector(motion[3:]),
            resized,
        )
        h_after, A_after = heights(after)
        gain = float(h.max() - h_after.max())
        if gain > 0:
            at, h, A = after, h_after, A_after
        reach *= 2 if gain > 0 else 0.25
        if 0 < gain <= CONVERGED * extent or reach <= CONVERGED * extent:
            break
    (origin, axes, sizes), highest = at, float(h.max())
    if kind is FeatureKind.LINE:
        return origin, axes, np.zeros(0), 2 * highest
    if criterion is Criterion.INSCRIBED and -highest > extent:
        raise CalibrationError("measuring.undetermined", kind=NAMES[kind])
    if criterion is not Criterion.MINIMUM_ZONE:
        sizes = np.array([sign * highest])
    d = surface.distances((points - origin) @ axes, sizes).values
    return origin, axes, sizes, float(np.ptp(d))


def _lowering_step(h: FloatArray, A: FloatArray, reach: float) -> FloatArray:
    """Return the step (U,) within a reach for which the highest of h + A step is least.

    The dual simplex method [3]_ exchanges constraints ``G x <= b``, of which as many as
    unknowns hold exactly; at the start the highest point and one bound of each unknown.
    """
    n, n_steps = A.shape
    scale = np.maximum(np.abs(A).max(axis=0), TINY)
    scaled, box = A / scale, np.eye(n_steps, n_steps + 1)
    G = np.concatenate([np.column_stack([scaled, -np.ones(n)]), box, -box])
    b = np.concatenate([-h, np.full(2 * n_steps, reach)])
    first = int(np.argmax(h))
    upper = n + np.arange(n_steps)
    held = np.append(np.where(scaled[first] < 0, upper, upper + n_steps), first)
    x = np.zeros(n_steps + 1)
    for _ in range(MAX_EXCHANGES):
        inverse = np.linalg.inv(G[held])
        x = inverse @ b[held]
        new = int(np.argmax(G @ x - b))
        if new in held or G[new] @ x - b[new] <= ROUNDING * reach:
            break
        prices, shares = inverse[-1].clip(max=0), G[new] @ inverse
        with np.errstate(divide="ignore", invalid="ignore"):
            ratios = np.where(shares > TINY, -prices / shares, np.inf)
        held[int(np.argmin(ratios))] = new
    return np.asarray(x[:-1] / scale)
