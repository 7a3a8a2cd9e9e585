"""The course of a part: its plan, run by run. A run is a feature of the plan."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache, lru_cache

import numpy as np

from lightpen.errors import CalibrationError
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.model.artefacts import Side
from lightpen.model.posture import UPRIGHT_AXIS
from lightpen_extensions.measure.measuring.features import Feature, fit_feature
from lightpen_extensions.measure.measuring.next_touch import (
    Place,
    area_of,
    best_places,
    nominal_area,
)
from lightpen_extensions.measure.measuring.part import kind_of
from lightpen_extensions.measure.measuring.plan import PlannedFeature
from lightpen_extensions.measure.measuring.surfaces import FeatureKind
from lightpen_extensions.measure.measuring.touches import PartTouches
from lightpen_extensions.measure.tasks.probed_point import ProbedPoint, joint_covariance
from lightpen_extensions.measure.tasks.task import (
    Conditions,
    HandGoal,
    Points,
    TaskProgress,
    VerificationChoices,
)

N_KEPT = 64  # fits of runs

# The simulated part: its origin from the bottom of the cone, and its axes x to the
# right, y away from the camera, z up, as columns in the camera frame.
SIMULATED_ORIGIN = np.array([0.0, -30.0, 0.0])
SIMULATED_AXES = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])


def touches_of_part(
    found: Sequence[tuple[str, ProbedPoint]], conditions: Conditions
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
        ball_uncertainty=conditions.ball_uncertainty / 2,
    )


def planned_at(choices: VerificationChoices, run: int) -> PlannedFeature | None:
    """Return the feature of run i (from 0); None after the last or without a plan."""
    runs = choices.features
    return runs[run] if run < len(runs) else None


@dataclass(frozen=True, eq=False)
class FeatureSoFar:
    """The current feature."""

    planned: PlannedFeature
    kind: FeatureKind | None  # as planned, or as recognised so far
    fit: Feature | None = None  # to the ball centres, once they determine it
    next_touch: Place | None = None  # the most informative one, frame of the camera


def feature_so_far(
    choices: VerificationChoices, progress: TaskProgress, conditions: Conditions
) -> FeatureSoFar | None:
    """Return the feature that is being probed; None if there is none."""
    planned = planned_at(choices, len(progress.runs))
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
    touches = touches_of_part(found, Conditions(instrument))
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


def hand_goal(choices: VerificationChoices, run: int, step: int) -> HandGoal:
    """Return the goal of a simulated operator for a point of a run, both from 0."""
    planned = planned_at(choices, run)
    places = () if planned is None else planned_places(planned)
    if not places:
        return HandGoal()
    place = places[step % len(places)]
    point = SIMULATED_ORIGIN + SIMULATED_AXES @ place.point
    return HandGoal(point, outwards=SIMULATED_AXES @ place.normal)
