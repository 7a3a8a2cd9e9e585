"""Compensation of the ball: from the feature of ball centres to the surface.

The surface is parallel to the feature of the centres, so that a least-squares feature
moves by the ball radius along its normal: radii change by it, a plane is shifted, and a
cone of half angle ``a`` changes by ``r / cos a`` in radius [1]_. The side is given by
the plan, by the approach of the ball, or by the stylus, which leaves the surface.

A point or a line does not show its normal, and an approach that is off it by an angle
``a`` puts it off by ``2 r sin(a / 2)``. So the normal is that of a plane on which it
lies, or a vector of the plan; without one they are refused.

References
----------
.. [1] ISO 10360-6:2001; R. J. Hocken and P. H. Pereira (eds.), "Coordinate Measuring
   Machines and Systems", 2nd ed., chapter on probing systems.
"""

from dataclasses import dataclass, replace
from enum import Enum, StrEnum

import numpy as np

from lightpen.arrays import FloatArray, IntArray
from lightpen.errors import CalibrationError
from lightpen.messages import message
from lightpen.model.artefacts import Side
from lightpen.model.rigid import rotation_from_vector
from lightpen.record.folder import BALL_CENTRE
from lightpen_extensions.measure.measuring.alignment import Quantity, derive
from lightpen_extensions.measure.measuring.features import (
    AXIS,
    PLACE,
    Feature,
    Start,
    fit_feature,
)
from lightpen_extensions.measure.measuring.next_touch import PartTouches
from lightpen_extensions.measure.measuring.plan import PlannedFeature
from lightpen_extensions.measure.measuring.surfaces import (
    NAMES,
    RADIAL,
    ROUND,
    SURFACES,
    FeatureKind,
)

CLEAR = 0.2  # cosine from which a direction decides the side
MIXED = 0.25  # share of touches on the other side from which they contradict


class Evidence(StrEnum):
    """Origin of the choice of the side, or of the normal of a point or line."""

    NONE = BALL_CENTRE
    PLAN = "plan"
    PLANE = "plane"
    APPROACH = "approach"
    STYLUS = "stylus"


@dataclass(frozen=True, eq=False)
class Normal:
    """The normal of the surface at a point or line, out of the material."""

    direction: Quantity  # (3,), of length 1
    evidence: Evidence


@dataclass(frozen=True, eq=False)
class TouchedSurface:
    """A feature at the surface of a part."""

    kind: FeatureKind
    # Origin, axis and sizes. The axis of a plane points out of the material, that of
    # line and cylinder from the first touch to the last.
    quantity: Quantity
    side: Side
    evidence: Evidence


@dataclass(frozen=True, eq=False)
class ProbedFeature:
    """A feature of ball centres, and the touches that it is fitted to."""

    planned: PlannedFeature
    fit: Feature
    at: IntArray  # touches
    quantity: Quantity  # of the fit
    points: Quantity  # (3 n,), ball centres

    @property
    def kind(self) -> FeatureKind:
        """Its kind."""
        return self.fit.kind

    @property
    def needs_normal(self) -> bool:
        """Whether the ball is compensated along a normal that it does not show."""
        is_thin = self.kind in {FeatureKind.POINT, FeatureKind.LINE}
        return is_thin and self.planned.side is Side.AUTO


def surface_of(
    probed: ProbedFeature, touches: PartTouches, normal: Normal | None = None
) -> TouchedSurface:
    """Return the surface that was touched.

    Raises `CalibrationError` if the side or the normal is unknown, or touches are on
    both sides.
    """
    planned, kind, quantity = probed.planned, probed.kind, probed.quantity
    if kind is FeatureKind.PLANE:
        return _plane(probed, touches)
    is_centre = not touches.ball_radius or planned.side is Side.CENTRE
    if is_centre:
        return TouchedSurface(kind, quantity, Side.CENTRE, Evidence.NONE)
    if kind in ROUND:
        side, evidence = _side(probed, touches)
        sign = 1.0 if side is Side.INSIDE else -1.0

        def resized(values: FloatArray, ball: FloatArray) -> FloatArray:
            moved = values.copy()
            slope = 1 / np.cos(values[7]) if kind is FeatureKind.CONE else 1.0
            moved[6] += sign * ball[0] * slope
            return moved

        moved = derive(resized, quantity, touches.ball)
        if moved.values[6] <= 0:
            raise CalibrationError("measuring.ball-too-large", name=planned.name)
        return TouchedSurface(kind, moved, side, evidence)
    if not probed.needs_normal:  # an end of a length, which knows its direction
        return TouchedSurface(kind, quantity, planned.side, Evidence.PLAN)
    if normal is None:
        raise CalibrationError(
            "measuring.no-normal", name=planned.name, kind=NAMES[kind]
        )

    def offset(values: FloatArray, ball: FloatArray, way: FloatArray) -> FloatArray:
        if kind is FeatureKind.LINE:
            way = way - (way @ values[AXIS]) * values[AXIS]
        moved = values.copy()
        moved[PLACE] -= ball[0] * way / np.linalg.norm(way)
        return moved

    moved = derive(offset, quantity, touches.ball, normal.direction)
    return TouchedSurface(kind, moved, Side.OUTSIDE, normal.evidence)


def _plane(probed: ProbedFeature, touches: PartTouches) -> TouchedSurface:
    outwards, evidence = _outwards(probed, touches)
    sign = 1.0 if probed.fit.axis @ outwards > 0 else -1.0
    shift = 0.0 if probed.planned.side is Side.CENTRE else 1.0

    def shifted(values: FloatArray, ball: FloatArray) -> FloatArray:
        normal = sign * values[AXIS]
        return np.concatenate([values[PLACE] - shift * ball[0] * normal, normal])

    moved = derive(shifted, probed.quantity, touches.ball)
    return TouchedSurface(FeatureKind.PLANE, moved, Side.OUTSIDE, evidence)


def along_touches(axis: Quantity, points: FloatArray) -> Quantity:
    """Return an axis that points from the first touch to the last."""
    if (points[-1] - points[0]) @ axis.values[AXIS] >= 0:
        return axis
    turned = np.ones(len(axis.values))
    turned[AXIS] = -1.0
    return Quantity(turned * axis.values, turned[:, None] * axis.by_inputs)


def _side(probed: ProbedFeature, touches: PartTouches) -> tuple[Side, Evidence]:
    """Return on which side of a round surface the ball was."""
    planned, feature, at = probed.planned, probed.fit, probed.at
    if planned.side is not Side.AUTO:
        return planned.side, Evidence.PLAN
    surface = SURFACES[feature.kind]
    q = (touches.points_cam[at] - feature.origin) @ feature.axes
    outwards = surface.distances(q, feature.sizes).by_point[:, 0] @ feature.axes.T
    approach = np.einsum("ni,ni->n", touches.approaches_cam[at], outwards)
    approach[~(np.abs(approach) > CLEAR)] = np.nan  # along the surface
    if np.isfinite(approach).any():
        return _by_cosines(planned, approach, Side.INSIDE), Evidence.APPROACH
    stylus = np.einsum("ni,ni->n", touches.styli_cam[at], outwards)
    if abs(stylus.mean()) < CLEAR:
        raise CalibrationError("measuring.unknown-side", name=planned.name)
    return _by_cosines(planned, stylus, Side.OUTSIDE), Evidence.STYLUS


def _by_cosines(planned: PlannedFeature, cosines: FloatArray, positive: Side) -> Side:
    """Return the side of most directions; ``positive`` is that of cosines above 0."""
    known = cosines[np.isfinite(cosines)]
    share = float(np.mean(known > 0))
    if MIXED < share < 1 - MIXED:
        raise CalibrationError("measuring.mixed-sides", name=planned.name)
    negative = Side.OUTSIDE if positive is Side.INSIDE else Side.INSIDE
    return positive if share > 0.5 else negative


def _outwards(
    probed: ProbedFeature, touches: PartTouches
) -> tuple[FloatArray, Evidence]:
    """Return a direction out of the material of a plane, (3,), by its touches."""
    axis = probed.fit.axis
    approaches = touches.approaches_cam[probed.at]
    known = np.abs(np.nan_to_num(approaches) @ axis) > CLEAR  # not along the surface
    found, evidence = touches.styli_cam[probed.at], Evidence.STYLUS
    if known.any():
        found, evidence = -approaches[known], Evidence.APPROACH
    _by_cosines(probed.planned, found @ axis, Side.OUTSIDE)
    return np.asarray(found.mean(axis=0)), evidence


# Features by the minimum-zone, inscribed and circumscribed criteria.
#
# Each is the limit of linear programs: the distances are linearised at the present
# feature, and the best step within a trust region is taken while it improves the fit.
#
# References
# ----------
# .. [1] ISO 1101:2017, ISO 12180, 12181, 12780, 12781 (definitions).
# .. [2] G. T. Anthony et al., "Reference software for finding Chebyshev best-fit
#    geometric elements", Precision Engineering 19 (1996) 28-36.
# .. [3] C. E. Lemke, "The dual method of solving the linear programming problem", Naval
#    Research Logistics Quarterly 1 (1954) 36-47.


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
