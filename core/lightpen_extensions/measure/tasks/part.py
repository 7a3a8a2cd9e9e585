"""A part measured by a plan, one run for each of its features.

`lightpen_extensions.measure.measuring` does the geometry; here are the touches, their
order, and the shown and recorded results. A plan that is ended early gives the results
of the probed features.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache, lru_cache
from typing import Any

import numpy as np
from msgspec import structs

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.estimation.reports.verdict import Grade
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.messages import Message, message
from lightpen.model.artefacts import Side
from lightpen.model.coverage import Decision
from lightpen.model.rigid import UPRIGHT_AXIS
from lightpen.record.folder import MEASURED_PART
from lightpen_extensions.comparisons.assessment import (
    BETTER_POSTURES,
    CHECK_FILES,
    VerificationAssessment,
    accepted,
    check,
    refused,
)
from lightpen_extensions.measure.measuring.features import Feature, fit_feature
from lightpen_extensions.measure.measuring.next_touch import (
    PartTouches,
    Place,
    places_on,
)
from lightpen_extensions.measure.measuring.part import (
    CharacteristicResult,
    MeasuredPart,
    feature_kind_of,
    measure_part,
)
from lightpen_extensions.measure.measuring.plan import (
    CERTIFIED,
    IS_ANGLE,
    Plan,
    PlannedFeature,
)
from lightpen_extensions.measure.measuring.plan_checks import missing_normal
from lightpen_extensions.measure.measuring.report import part_entries, part_tables
from lightpen_extensions.measure.measuring.surfaces import NAMES, FeatureKind
from lightpen_extensions.measure.tasks.probed_point import (
    ProbedPoint,
    joint_covariance,
    point_entries,
)
from lightpen_extensions.measure.tasks.task import (
    ANY,
    Band,
    Conditions,
    Found,
    HandGoal,
    Points,
    Runs,
    TaskProgress,
    VerificationChoices,
    VerificationTask,
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


def feature_so_far(
    choices: VerificationChoices, progress: TaskProgress, conditions: Conditions
) -> FeatureSoFar | None:
    """Return the feature that is being probed; None if there is none."""
    planned = planned_at(choices, len(progress.runs))
    if planned is None:
        return None
    return FeatureSoFar(
        planned, *fit_of(planned, progress.points, conditions.instrument)
    )


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
    kind = planned.kind or feature_kind_of(planned.name, touches)
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
    places = places_on(planned.kind, planned.nominal, planned.n_touches)
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


NEW_PLACE = 0.5  # mm
MOST_NAMED = 5  # characteristics in a sentence


@dataclass(frozen=True, eq=False)
class Part(Found):
    """A measured part."""

    part: MeasuredPart
    points: tuple[tuple[str, ProbedPoint], ...]  # feature and ball centre
    missing: tuple[str, ...]  # features that were not probed

    def deviations(self) -> list[FloatArray | None]:
        """Return the way from its feature to each point, (3,), mm; None if unknown."""
        found: list[FloatArray | None] = [None] * len(self.points)
        for name, one in self.part.features.items():
            at = self.part.touches.of(name).tolist()
            for i, offset in zip(at, one.feature.offsets, strict=True):
                found[i] = offset
        return found


def measure_by_plan(
    runs: Runs, conditions: Conditions, choices: VerificationChoices
) -> Part:
    """Measure a part by its plan, up to the features probed so far.

    Runs are named after features, or in the order of the plan. Raises
    `CalibrationError` if the touches of a feature are too few, show no side or do not
    determine it.
    """
    if choices.plan is None:
        raise CalibrationError("part.no-plan")
    found = _owned(runs, choices)
    names = {name for name, _ in found}
    plan = choices.plan.limited_to(names)
    if not plan.features:
        raise CalibrationError("part.nothing-probed")
    touches = touches_of_part(found, conditions)
    part = measure_part(plan, touches, conditions.limits)
    missing = tuple(e.name for e in choices.features if e.name not in names)
    assessment = _assessment(part, missing)
    return Part(assessment, part, tuple(found), missing)


def check_feature(
    runs: Runs, conditions: Conditions, choices: VerificationChoices
) -> None:
    """Refuse the last of some runs if it does not determine its feature.

    The normal of a point or line may come from a feature that is probed later.
    """
    if choices.plan is None:
        return
    found = _owned(runs, choices)
    name = found[-1][0]
    own = [(owner, point) for owner, point in found if owner == name]
    planned = choices.plan.feature(name)
    if planned.kind in {FeatureKind.POINT, FeatureKind.LINE}:
        planned = structs.replace(planned, side=Side.CENTRE, surface="", normal=None)
    touches = touches_of_part(own, conditions)
    measure_part(Plan(choices.plan.name, (planned,)), touches)


def _owned(runs: Runs, choices: VerificationChoices) -> list[tuple[str, ProbedPoint]]:
    """Return the touches with their features."""
    names = [each.name for each in choices.features]
    found = []
    for i, (run, points) in enumerate(runs):
        if run not in names and i >= len(names):
            raise CalibrationError(
                "measuring.unknown-feature", name=run, names=", ".join(names)
            )
        found += [(run if run in names else names[i], point) for point in points]
    return found


def sizes_of(part: MeasuredPart) -> list[CharacteristicResult]:
    """Return the certified sizes of artefacts."""
    return [
        each
        for each in part.results
        if each.planned.certified is not None and each.planned.quantity in CERTIFIED
    ]


def _assessment(part: MeasuredPart, missing: tuple[str, ...]) -> VerificationAssessment:
    def named(decision: Decision) -> list[Message]:
        return [each.planned.words for each in judged if each.decision is decision]

    judged = [e for e in part.results if e.decision and not _is_noise(e)]
    certified = [each for each in judged if each.planned.certified is not None]
    out, unclear = named(Decision.REJECTED), named(Decision.OPEN)
    n_judged, name = len(judged), part.plan.words
    if out and len(certified) == n_judged:
        return _judged_size(certified)
    if out:
        reason = message(
            "part.out", n_out=len(out), names=_listed(out), part=name, n_judged=n_judged
        )
        return refused(reason, message("part.rework"))
    if missing and n_judged:
        reason = message(
            "part.incomplete",
            part=name,
            names=_listed([message("measuring.named", name=each) for each in missing]),
        )
        return check(reason, message("part.complete"))
    if unclear:
        reason = message(
            "part.unclear",
            n_open=len(unclear),
            names=_listed(unclear),
            part=name,
            n_judged=n_judged,
        )
        return check(reason, message("part.more-points"))
    if not n_judged:
        n_features = len(part.features)
        reason = message("part.measured", part=name, n_features=n_features)
        return accepted(reason, message("part.done"))
    if certified:
        return _judged_size(certified)
    good = message("part.good", part=name, n_judged=n_judged)
    return accepted(good, message("part.done"))


def _is_noise(each: CharacteristicResult) -> bool:
    """Return whether a form beside a size is open, which says nothing against it."""
    planned, is_open = each.planned, each.decision is Decision.OPEN
    return (
        is_open and planned.certified is not None and planned.quantity not in CERTIFIED
    )


def _judged_size(results: Sequence[CharacteristicResult]) -> VerificationAssessment:
    """Judge certified values by the one with the largest error for its limit."""
    worst = max(results, key=lambda each: abs(each.deviation or 0.0) / each.margin)
    words, error = worst.planned.words, worst.deviation or 0.0
    u, limit = worst.value.uncertainty, worst.margin
    if worst.decision is Decision.REJECTED:
        off = message(
            "artefact.off", name=words, error=error, uncertainty=u, limit=limit
        )
        return refused(off, CHECK_FILES)
    # Form by noisy points is an upper bound: it says nothing against a size.
    sizes = [e for e in results if e.planned.quantity in CERTIFIED] or results
    least = max(sizes, key=lambda each: each.value.uncertainty / each.margin)
    if least.value.uncertainty > least.margin:
        reason = message(
            "artefact.uncertain",
            name=least.planned.words,
            uncertainty=least.value.uncertainty,
            limit=least.margin,
        )
        return check(reason, message("part.more-points"))
    good = message("artefact.good", name=words, error=error, uncertainty=u, limit=limit)
    return accepted(good, BETTER_POSTURES, Grade.SCALE)


def _listed(names: Sequence[Message]) -> tuple[Message, ...]:
    more = [message("measuring.named", name="...")] if len(names) > MOST_NAMED else []
    return (*names[:MOST_NAMED], *more)


def _entries(found: Part, instrument: Instrument) -> dict[str, Any]:
    points = [point for _, point in found.points]
    return {
        **part_entries(found.part),
        "missing": list(found.missing),
        "touches": [
            {
                "feature": name,
                "approach_cam": point.approach_cam,
                "deviation_cam_mm": off,
                **entry,
            }
            for (name, point), off, entry in zip(
                found.points,
                found.deviations(),
                point_entries(points, instrument),
                strict=True,
            )
        ],
    }


def _bands(found: Part, conditions: Conditions) -> tuple[Band, ...]:
    return tuple(
        Band(
            each.planned.words,
            each.value.value,
            each.value.uncertainty,
            each.lower,
            each.upper,
            each.planned.nominal or 0.0,
            each.decision,
            each.planned.features,
            each.planned.quantity in IS_ANGLE,
        )
        for each in found.part.results
    )


def _n_points(choices: VerificationChoices, run: int) -> int:
    planned = planned_at(choices, run)
    return 0 if planned is None else planned.n_touches


def _instruction(choices: VerificationChoices, progress: TaskProgress) -> Message:
    planned = planned_at(choices, len(progress.runs))
    if planned is None:
        return message("part.no-plan")
    what: Message = message("measuring.named", name=planned.name)
    if planned.kind is not None and planned.kind.value not in planned.name.casefold():
        what = message("part.of-kind", kind=NAMES[planned.kind], name=planned.name)
    n_points, needed = len(progress.points), planned.n_touches
    return message("part.instruction", what=what, n_points=n_points, needed=needed)


def _missing(
    choices: VerificationChoices, ball_diameter: float | None
) -> Message | None:
    if choices.plan is None:
        return message("part.no-plan")
    return missing_normal(choices.plan) if ball_diameter else None


PART = VerificationTask(
    kind=MEASURED_PART,
    title=message("part.title"),
    purpose=message("part.title"),
    first=message("part.first"),
    another=message("task.next-point"),
    other_run=message("part.other-feature"),
    known=message("session.same-place"),
    limits=(),
    measure=measure_by_plan,
    check=check_feature,
    entries=_entries,
    tables=lambda found, conditions: part_tables(found.part),
    bands=_bands,
    is_of_tip=False,
    hand=hand_goal,
    n_points=_n_points,
    n_runs=lambda choices: max(len(choices.features), 1),
    instruction=_instruction,
    newness=(ANY, NEW_PLACE),
    missing=_missing,
)
