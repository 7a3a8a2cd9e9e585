"""The course of a part: its plan, run by run, with the datum points of moved parts.

A run is a feature of the plan. If part or camera was moved, three features are probed
again before the others; all runs since then belong to another position.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache, lru_cache
from itertools import combinations
from typing import Annotated

import numpy as np
from msgspec import Meta, Struct, structs

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.model.artefacts import Side
from lightpen.model.assumptions import BALL_UNCERTAINTY
from lightpen.model.posture import UPRIGHT_AXIS
from lightpen.record.folder.verifications import at_position
from lightpen_extensions.measure.measuring.alignment import MIN_POINTS, THIN
from lightpen_extensions.measure.measuring.features import Feature, fit_feature
from lightpen_extensions.measure.measuring.next_touch import (
    Place,
    area_of,
    best_places,
    nominal_area,
)
from lightpen_extensions.measure.measuring.part import kind_of
from lightpen_extensions.measure.measuring.plan import Plan, PlannedFeature
from lightpen_extensions.measure.measuring.surfaces import CENTRED, FeatureKind
from lightpen_extensions.measure.measuring.touches import PartTouches
from lightpen_extensions.measure.verification.tasks.probed_point import (
    ProbedPoint,
    joint_covariance,
)
from lightpen_extensions.measure.verification.tasks.task import (
    Conditions,
    HandGoal,
    Points,
    TaskOptions,
    TaskProgress,
)

N_KEPT = 64  # fits of runs

# The simulated part: its origin from the bottom of the cone, and its axes x to the
# right, y away from the camera, z up, as columns in the camera frame.
SIMULATED_ORIGIN = np.array([0.0, -30.0, 0.0])
SIMULATED_AXES = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])


class Move(Struct, frozen=True):
    """Part or camera was moved before a run, from 0; datum points are probed again."""

    run: Annotated[int, Meta(ge=0)]
    datums: tuple[str, ...]


class PartOptions(TaskOptions, frozen=True, tag="part"):
    """A plan, U (k = 2) of the ball diameter, mm, and the moves of the session."""

    plan: Plan | None = None
    ball_uncertainty: Annotated[float, Meta(ge=0)] = BALL_UNCERTAINTY
    moves: tuple[Move, ...] = ()


@cache
def course(options: PartOptions) -> tuple[PlannedFeature, ...]:
    """Return the features run by run with their positions; none without a plan."""
    if options.plan is None:
        return ()
    runs = list(options.plan.features)
    for position, move in enumerate(options.moves, start=2):
        left = [base_name(each.name) for each in runs[move.run :]]
        runs[move.run :] = [
            structs.replace(
                options.plan.feature(name), name=at_position(name, position)
            )
            for name in dict.fromkeys((*move.datums, *left))
        ]
    return tuple(runs)


def base_name(name: str) -> str:
    """Return the name of a feature without its position."""
    return name.partition("@")[0]


def with_move(
    options: PartOptions, runs: Sequence[Points], conditions: Conditions
) -> PartOptions:
    """Return the options with a new position of the part after the present runs.

    Its datum points are the three probed features with a centre that span the largest
    triangle (`CalibrationError` if there are none).
    """
    centres: dict[str, FloatArray] = {}
    for planned, points in zip(course(options), runs, strict=False):
        kind, fit = fit_of(planned, points, conditions.instrument)
        if kind in CENTRED and fit is not None:
            centres.setdefault(base_name(planned.name), fit.origin)
    largest, datums = 0.0, tuple[str, ...]()
    for names in combinations(centres, MIN_POINTS):
        a, b, c = (centres[name] for name in names)
        area = float(np.linalg.norm(np.cross(b - a, c - a)))
        if area > max(largest, THIN * float(np.linalg.norm(b - a)) ** 2):
            largest, datums = area, names
    if not datums:
        raise CalibrationError(
            "part.few-datums", n_points=len(centres), needed=MIN_POINTS
        )
    return structs.replace(options, moves=(*options.moves, Move(len(runs), datums)))


def touches_of_part(
    found: Sequence[tuple[str, ProbedPoint]],
    conditions: Conditions,
    options: PartOptions,
) -> PartTouches:
    """Return probed points as the touches of a part, with the motion of the camera."""
    points = [point for _, point in found]
    drift = np.diag(np.tile(conditions.drift**2, len(points)))
    unknown = np.full(3, np.nan)
    return PartTouches(
        points_cam=np.array([point.point_cam for point in points]),
        covariance=joint_covariance(points, conditions.instrument) + drift,
        approaches_cam=np.array(
            [
                unknown if point.approach_cam is None else point.approach_cam
                for point in points
            ]
        ),
        styli_cam=np.array([point.rotation @ UPRIGHT_AXIS for point in points]),
        owners=tuple(name for name, _ in found),
        ball_radius=(conditions.ball_diameter or 0.0) / 2,
        ball_uncertainty=options.ball_uncertainty / 2,
    )


def planned_at(options: PartOptions, run: int) -> PlannedFeature | None:
    """Return the feature of run i (from 0); None after the last or without a plan."""
    runs = course(options)
    return runs[run] if run < len(runs) else None


@dataclass(frozen=True, eq=False)
class FeatureSoFar:
    """The current feature."""

    planned: PlannedFeature
    kind: FeatureKind | None  # as planned, or as recognised so far
    fit: Feature | None = None  # to the ball centres, once they determine it
    next_touch: Place | None = None  # the most informative one, frame of the camera


def feature_so_far(
    options: PartOptions, progress: TaskProgress, conditions: Conditions
) -> FeatureSoFar | None:
    """Return the feature that is being probed; None if there is none."""
    planned = planned_at(options, len(progress.runs))
    if planned is None:
        return None
    points = progress.points
    kind, fit = fit_of(planned, points, conditions.instrument)
    if fit is None:
        return FeatureSoFar(planned, kind)
    places = np.array([point.point_cam for point in points])
    place = best_places(area_of(fit, places), 1, places)[0]
    return FeatureSoFar(planned, kind, fit, place)


@lru_cache(maxsize=N_KEPT)
def fit_of(
    planned: PlannedFeature, points: Points, instrument: Instrument
) -> tuple[FeatureKind | None, Feature | None]:
    """Return the kind of a run, planned or recognised, and the fit to its ball centres.

    The fit is None if the points do not determine it.
    """
    if not points:
        return planned.kind, None
    found = [(planned.name, point) for point in points]
    touches = touches_of_part(found, Conditions(instrument), PartOptions())
    kind = planned.kind or kind_of(planned.name, touches)
    try:
        return kind, None if kind is None else fit_feature(kind, touches.points_cam)
    except CalibrationError:
        return kind, None


@cache
def planned_places(planned: PlannedFeature) -> tuple[Place, ...]:
    """Return the points to probe on a feature by its nominals, frame of the part.

    The normals point out of the material. Empty if the nominals do not tell.
    """
    if planned.kind is None or planned.nominal is None:
        return ()
    area = nominal_area(planned.kind, planned.nominal)
    if area is None:
        return ()
    places = best_places(area, planned.n_touches)
    if planned.side is Side.INSIDE:
        places = [replace(each, normal=-each.normal) for each in places]
    if planned.side is Side.CENTRE:
        places = [replace(each, normal=np.zeros(3)) for each in places]
    elif planned.kind in {FeatureKind.POINT, FeatureKind.LINE}:
        normal = np.array(planned.normal or planned.nominal.axis or (0.0, 0.0, 1.0))
        places = [replace(each, normal=normal) for each in places]
    if planned.kind is FeatureKind.LINE:
        places.sort(key=lambda each: float(each.point[0]))
    return tuple(places)


def hand_goal(options: PartOptions, run: int, step: int) -> HandGoal:
    """Return the goal of a simulated operator for a point of a run, both from 0."""
    planned = planned_at(options, run)
    places = () if planned is None else planned_places(planned)
    if not places:
        return HandGoal()
    place = places[step % len(places)]
    point = SIMULATED_ORIGIN + SIMULATED_AXES @ place.point
    return HandGoal(point, outwards=SIMULATED_AXES @ place.normal)
