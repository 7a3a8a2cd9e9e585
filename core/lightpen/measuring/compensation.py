"""Compensation of the ball: from the feature of ball centres to the surface.

The surface is parallel to the feature of the centres, so that a least-squares feature
moves by the ball radius along its normal: radii change by it, a plane is shifted, and a
cone of half angle ``a`` changes by ``r / cos a`` in radius [1]_. The side is given by
the plan, by a point in air, by the approach of the ball, or by the stylus, which leaves
the surface.

References
----------
.. [1] ISO 10360-6:2001; R. J. Hocken and P. H. Pereira (eds.), "Coordinate Measuring
   Machines and Systems", 2nd ed., chapter on probing systems.
"""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.measuring.features import AXIS, PLACE, Feature
from lightpen.measuring.plan import PlannedFeature, Side
from lightpen.measuring.quantities import Quantity, derive, quantity_of
from lightpen.measuring.surfaces import SURFACES, FeatureKind
from lightpen.measuring.touches import PartTouches

CLEAR = 0.2  # cosine from which a direction decides the side
MIXED = 0.25  # share of touches on the other side from which they contradict
ROUND = {
    FeatureKind.CIRCLE,
    FeatureKind.SLOT,
    FeatureKind.SPHERE,
    FeatureKind.CYLINDER,
    FeatureKind.CONE,
}


class Evidence(StrEnum):
    """Origin of the choice of the side."""

    NONE = "no ball"
    PLAN = "plan"
    AIR = "point in air"
    APPROACH = "approach"
    STYLUS = "stylus"


@dataclass(frozen=True, eq=False)
class TouchedSurface:
    """A feature at the surface of a part."""

    kind: FeatureKind
    # Origin, axis and sizes. The axis of a plane points out of the material, that of
    # line and cylinder from the first touch to the last.
    quantity: Quantity
    side: Side  # inside or outside; outside of planes, lines and points
    evidence: Evidence


def surface_of(
    planned: PlannedFeature, feature: Feature, touches: PartTouches
) -> TouchedSurface:
    """Return the surface that was touched.

    Raises `CalibrationError` if the side is unknown, or touches are on both sides.
    """
    at = touches.of(planned.name)
    assert planned.kind is not None
    quantity = quantity_of(feature, 3 * at, touches.n_inputs)
    if planned.kind in {FeatureKind.LINE, FeatureKind.CYLINDER}:
        quantity = _along_touches(quantity, touches.points_cam[at])
    if planned.kind is not FeatureKind.PLANE and not touches.ball_radius:
        return TouchedSurface(planned.kind, quantity, Side.OUTSIDE, Evidence.NONE)
    if planned.kind in ROUND:
        side, evidence = _side(planned, feature, touches)
        sign = 1.0 if side is Side.INSIDE else -1.0

        def resized(values: FloatArray, ball: FloatArray) -> FloatArray:
            moved = values.copy()
            slope = 1 / np.cos(values[7]) if planned.kind is FeatureKind.CONE else 1.0
            moved[6] += sign * ball[0] * slope
            return moved

        moved = derive(resized, quantity, touches.ball)
        if moved.values[6] <= 0:
            raise CalibrationError("measuring.ball-too-large", name=planned.name)
        return TouchedSurface(planned.kind, moved, side, evidence)
    outwards, evidence = _outwards(planned, feature, touches)
    if planned.kind is FeatureKind.PLANE:
        sign = 1.0 if feature.axis @ outwards > 0 else -1.0

        def shifted(values: FloatArray, ball: FloatArray) -> FloatArray:
            normal = sign * values[AXIS]
            return np.concatenate([values[PLACE] - ball[0] * normal, normal])

        moved = derive(shifted, quantity, touches.ball)
        return TouchedSurface(planned.kind, moved, Side.OUTSIDE, evidence)

    def offset(values: FloatArray, ball: FloatArray) -> FloatArray:
        way = outwards
        if planned.kind is FeatureKind.LINE:
            way = way - (way @ values[AXIS]) * values[AXIS]
        moved = values.copy()
        moved[PLACE] -= ball[0] * way / np.linalg.norm(way)
        return moved

    moved = derive(offset, quantity, touches.ball)
    return TouchedSurface(planned.kind, moved, Side.OUTSIDE, evidence)


def _along_touches(axis: Quantity, points: FloatArray) -> Quantity:
    """Return an axis that points from the first touch to the last."""
    if (points[-1] - points[0]) @ axis.values[AXIS] >= 0:
        return axis
    turned = np.ones(len(axis.values))
    turned[AXIS] = -1.0
    return Quantity(turned * axis.values, turned[:, None] * axis.by_inputs)


def _side(
    planned: PlannedFeature, feature: Feature, touches: PartTouches
) -> tuple[Side, Evidence]:
    """Return on which side of a round surface the ball was."""
    if planned.side is not Side.AUTO:
        return planned.side, Evidence.PLAN
    if planned.kind is FeatureKind.SLOT:
        return Side.INSIDE, Evidence.PLAN
    assert planned.kind is not None
    surface = SURFACES[planned.kind]
    if planned.air is not None:
        q = (np.array(planned.air) - feature.origin) @ feature.axes
        distance = float(surface.distances(q[None], feature.sizes).values[0, 0])
        return (Side.INSIDE if distance < 0 else Side.OUTSIDE), Evidence.AIR
    at = touches.of(planned.name)
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
    planned: PlannedFeature, feature: Feature, touches: PartTouches
) -> tuple[FloatArray, Evidence]:
    """Return the direction out of the material, (3,), by the mean of the touches."""
    if planned.air is not None:
        return np.array(planned.air) - feature.origin, Evidence.AIR
    at = touches.of(planned.name)
    approaches = touches.approaches_cam[at]
    known = np.isfinite(approaches).all(axis=1)
    if planned.kind is FeatureKind.PLANE:  # not along the surface
        known &= np.abs(np.nan_to_num(approaches) @ feature.axis) > CLEAR
    found, evidence = touches.styli_cam[at], Evidence.STYLUS
    if known.any():
        found, evidence = -approaches[known], Evidence.APPROACH
    if planned.kind is FeatureKind.PLANE:
        _by_cosines(planned, found @ feature.axis, Side.OUTSIDE)
    mean = found.mean(axis=0)
    return mean / np.linalg.norm(mean), evidence
