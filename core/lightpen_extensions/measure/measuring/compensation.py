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

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from lightpen.arrays import FloatArray, IntArray
from lightpen.errors import CalibrationError
from lightpen.model.artefacts import Side
from lightpen.record.folder import BALL_CENTRE
from lightpen_extensions.measure.measuring.alignment import Quantity, derive
from lightpen_extensions.measure.measuring.features import AXIS, PLACE, Feature
from lightpen_extensions.measure.measuring.next_touch import PartTouches
from lightpen_extensions.measure.measuring.plan import PlannedFeature
from lightpen_extensions.measure.measuring.surfaces import (
    NAMES,
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

    def normals(self, touches: PartTouches) -> FloatArray:
        """Return the normals of the surface at its touches, (n, 3), outwards."""
        fit = self.fit
        q = (touches.points_cam[self.at] - fit.origin) @ fit.axes
        gradients = SURFACES[fit.kind].distances(q, fit.sizes).by_point[:, 0]
        return np.asarray(gradients @ fit.axes.T)


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
    planned, at = probed.planned, probed.at
    if planned.side is not Side.AUTO:
        return planned.side, Evidence.PLAN
    outwards = probed.normals(touches)
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
