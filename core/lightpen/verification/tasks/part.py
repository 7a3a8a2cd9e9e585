"""A part measured by a plan, one run for each of its features.

The geometry is that of `lightpen.measuring`; here are its touches, its course and what
is shown and recorded of it. A plan that is ended early gives what was probed of it.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Annotated, Any

import numpy as np
from msgspec import Meta, structs

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.estimation.uncertainty.budget import COVERAGE_FACTOR
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.measuring.features import fit_feature
from lightpen.measuring.next_touch import Place, area_of, best_places, nominal_area
from lightpen.measuring.part import MeasuredPart, kind_of, measure_part
from lightpen.measuring.plan import Plan, PlannedFeature, Side
from lightpen.measuring.report import (
    PartRow,
    characteristic_rows,
    feature_rows,
    part_entries,
)
from lightpen.measuring.surfaces import NAMES, FeatureKind
from lightpen.measuring.touches import PartTouches
from lightpen.messages import Message, message
from lightpen.model.decision_rules import Decision
from lightpen.model.limits import VerificationLimits, rule_in_words
from lightpen.model.posture import UPRIGHT_AXIS
from lightpen.verification.tasks.assessment import (
    VerificationAssessment,
    accepted,
    check,
    refused,
)
from lightpen.verification.tasks.probed_point import (
    ProbedPoint,
    joint_covariance,
    point_entries,
)
from lightpen.verification.tasks.task import (
    ANY,
    Conditions,
    Found,
    HandGoal,
    ResultRow,
    ResultTable,
    Runs,
    TaskOptions,
    TaskProgress,
    VerificationTask,
)

NEW_PLACE = 0.5  # mm
BALL_UNCERTAINTY = 0.001  # mm, U (k = 2)
MOST_NAMED = 5  # characteristics in a sentence

# The simulated part: its origin from the bottom of the cone, and its axes x to the
# right, y away from the camera, z up, as columns in the camera frame.
SIMULATED_ORIGIN = np.array([0.0, -30.0, 0.0])
SIMULATED_AXES = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])


@dataclass(frozen=True, eq=False)
class Part(Found):
    """A measured part.

    Attributes
    ----------
    points : tuple of (str, ProbedPoint)
        Feature and ball centre of each touch.
    missing : tuple of str
        Features of the plan that were not probed.
    """

    part: MeasuredPart
    points: tuple[tuple[str, ProbedPoint], ...]
    missing: tuple[str, ...]

    def deviations(self) -> list[FloatArray | None]:
        """Return the way from its feature to each point, (3,), mm; None if unknown."""
        found: list[FloatArray | None] = [None] * len(self.points)
        for name, one in self.part.features.items():
            at = self.part.touches.of(name)
            if one.feature is not None and len(at) == len(one.feature.offsets):
                for i, offset in zip(at.tolist(), one.feature.offsets, strict=True):
                    found[i] = offset
        return found

    def budgets(self, instrument: Instrument) -> list[dict[str, float] | None]:
        """Return U (k = 2) of each characteristic by its sources, mm or degrees.

        The sources are taken one by one, without their correlations; None for
        geometrical deviations.
        """
        points = [point for _, point in self.points]
        by_parameters = np.concatenate([point.sensitivity for point in points])
        own = np.zeros((len(by_parameters), len(by_parameters)))
        for i, point in enumerate(points):
            own[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] = point.noise
        at = instrument.parameters
        leds = np.r_[at.leds, at.diameter]
        known = {*np.r_[at.tip].tolist(), *leds.tolist()}
        cameras = np.array([i for i in range(at.number) if i not in known])
        covariances = {"points": own}
        for name, of in (("tip", np.r_[at.tip]), ("LEDs", leds), ("cameras", cameras)):
            rows = by_parameters[:, of]
            covariances[name] = rows @ instrument.covariance[np.ix_(of, of)] @ rows.T
        ball = self.part.touches.ball_uncertainty
        budgets: list[dict[str, float] | None] = []
        for result in self.part.results:
            if result.quantity is None:
                budgets.append(None)
                continue
            row = result.quantity.by_inputs[0]
            budget = {
                name: COVERAGE_FACTOR * float(np.sqrt(row[:-1] @ C @ row[:-1]))
                for name, C in covariances.items()
            }
            budget["ball"] = abs(float(row[-1])) * ball
            budgets.append(budget)
        return budgets


class PartOptions(TaskOptions, frozen=True, tag="part"):
    """A plan, and U (k = 2) of the ball diameter, mm."""

    plan: Plan | None = None
    ball_uncertainty: Annotated[float, Meta(ge=0)] = BALL_UNCERTAINTY


def measure_by_plan(runs: Runs, conditions: Conditions, options: PartOptions) -> Part:
    """Measure a part by its plan, as far as it was probed.

    Parameters
    ----------
    runs : sequence of (str, touches)
        Named after features, or in the order of the plan.

    Raises
    ------
    CalibrationError
        The touches of a feature are too few, show no side or do not determine it.
    """
    if options.plan is None:
        raise CalibrationError("part.no-plan")
    found = _owned(runs, options.plan)
    names = {name.partition("@")[0] for name, _ in found}
    plan = options.plan.limited_to(names)
    if not plan.features:
        raise CalibrationError("part.nothing-probed")
    part = measure_part(plan, touches_of_part(found, conditions, options))
    missing = tuple(
        each.name for each in options.plan.features if each.name not in names
    )
    return Part(_assessment(part, missing), part, tuple(found), missing)


def check_feature(runs: Runs, conditions: Conditions, options: PartOptions) -> None:
    """Refuse the last of some runs if it does not determine its feature.

    Raises
    ------
    CalibrationError
        As of `measure_by_plan`.
    """
    if options.plan is None:
        return
    found = _owned(runs, options.plan)
    last = found[-1][0]  # of a session, which has one position
    own = [each for each in found if each[0] == last]
    plan = structs.replace(
        options.plan.limited_to({last}), constructions=(), characteristics=()
    )
    measure_part(
        structs.replace(plan, alignment=None), touches_of_part(own, conditions, options)
    )


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


def _owned(runs: Runs, plan: Plan) -> list[tuple[str, ProbedPoint]]:
    """Return the touches with their features."""
    names = [each.name for each in plan.features]
    found = []
    for i, (run, points) in enumerate(runs):
        is_named = run.partition("@")[0] in names
        if not is_named and i >= len(names):
            raise CalibrationError(
                "measuring.unknown-feature", name=run, names=", ".join(names)
            )
        found += [(run if is_named else names[i], point) for point in points]
    return found


def _assessment(part: MeasuredPart, missing: tuple[str, ...]) -> VerificationAssessment:
    def named(decision: Decision) -> list[str]:
        results = part.results
        return [each.planned.label for each in results if each.decision is decision]

    out, unclear = named(Decision.REJECTED), named(Decision.OPEN)
    n_judged = len(out) + len(unclear) + len(named(Decision.ACCEPTED))
    name = part.plan.name
    if out:
        said = message(
            "part.out", n_out=len(out), names=_listed(out), part=name, n_judged=n_judged
        )
        return refused(said, message("part.rework"))
    if missing and n_judged:
        said = message("part.incomplete", part=name, names=_listed(missing))
        return check(said, message("part.complete"))
    if unclear:
        said = message(
            "part.unclear",
            n_open=len(unclear),
            names=_listed(unclear),
            part=name,
            n_judged=n_judged,
        )
        return check(said, message("part.more-points"))
    if not n_judged:
        n_features = len(part.features)
        said = message("part.measured", part=part.plan.name, n_features=n_features)
        return accepted(said, message("part.done"))
    return accepted(
        message("part.good", part=name, n_judged=n_judged), message("part.done")
    )


def _listed(names: Sequence[str]) -> str:
    more = ", ..." if len(names) > MOST_NAMED else ""
    return ", ".join(names[:MOST_NAMED]) + more


def _entries(found: Part, instrument: Instrument) -> dict[str, Any]:
    points = [point for _, point in found.points]
    entries = part_entries(found.part)
    for each, budget in zip(
        entries["characteristics"], found.budgets(instrument), strict=True
    ):
        each["budget"] = budget
    return {
        **entries,
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


def _tables(found: Part, conditions: Conditions) -> tuple[ResultTable, ...]:
    part = found.part
    in_part, in_camera = message("part.in-part"), message("part.in-camera")
    features = ResultTable(
        message("part.features"),
        (
            *("x", "y", "z", "U"),
            *(message("part.size"), "U", message("part.form")),
            message("part.kind"),
        ),
        _rows(feature_rows(part)),
        (in_camera if part.alignment is None else in_part,),
    )
    characteristics = ResultTable(
        message("part.characteristics"),
        (
            message("part.nominal"),
            message("part.actual"),
            message("part.deviation"),
            message("table.uncertainty"),
            message("part.u-alone"),
            message("part.probability"),
            message("part.decision"),
        ),
        _rows(characteristic_rows(part)),
        (message("part.u-alone-note"),) if part.results else (),
    )
    return characteristics, features


def _rows(rows: Iterable[PartRow]) -> tuple[ResultRow, ...]:
    return tuple(ResultRow(each.name, each.values, 4, each.remark) for each in rows)


def planned_at(options: PartOptions, run: int) -> PlannedFeature | None:
    """Return the feature of a run from 0; None after the last, or without a plan."""
    features = () if options.plan is None else options.plan.features
    return features[run] if run < len(features) else None


@dataclass(frozen=True, eq=False)
class FeatureSoFar:
    """The feature at hand.

    Attributes
    ----------
    kind : FeatureKind or None
        As planned, or as recognised so far.
    deviations : (N,) array
        Distances of the touches from it, mm; NaN before it is determined.
    next_touch : Place or None
        The most informative one, frame of the camera.
    """

    planned: PlannedFeature
    kind: FeatureKind | None
    deviations: FloatArray
    next_touch: Place | None = None


def feature_so_far(
    options: PartOptions, progress: TaskProgress, conditions: Conditions
) -> FeatureSoFar | None:
    """Return the feature that is being probed; None if there is none."""
    planned = planned_at(options, len(progress.runs))
    if planned is None:
        return None
    points = progress.points
    unknown = FeatureSoFar(planned, planned.kind, np.full(len(points), np.nan))
    if not points:
        return unknown
    found = [(planned.name, point) for point in points]
    touches = touches_of_part(found, conditions, options)
    kind = planned.kind or kind_of(planned.name, touches)
    if kind is None:
        return unknown
    try:
        fit = fit_feature(kind, touches.points_cam)
    except CalibrationError:
        return replace(unknown, kind=kind)
    area = area_of(fit, touches.points_cam)
    place = best_places(area, 1, touches.points_cam)[0]
    off = np.linalg.norm(fit.distances, axis=1)
    if fit.distances.shape[1] == 1:
        off = fit.distances[:, 0]
    return FeatureSoFar(planned, kind, off, place)


def _figures_so_far(
    options: PartOptions, progress: TaskProgress, conditions: Conditions
) -> tuple[ResultTable, ...]:
    now = feature_so_far(options, progress, conditions)
    if now is None:
        return ()
    kind = message("part.unknown-kind") if now.kind is None else NAMES[now.kind]
    title = message("part.touches", name=now.planned.name, kind=kind)
    rows = tuple(
        ResultRow(
            str(i), [*point.point_cam.tolist(), off if np.isfinite(off) else None]
        )
        for i, (point, off) in enumerate(
            zip(progress.points, now.deviations.tolist(), strict=True), start=1
        )
    )
    columns = (*"uvw", message("part.deviation")) if rows else ()
    return (ResultTable(title, columns, rows),)


def _fraction(options: PartOptions, progress: TaskProgress) -> float:
    planned = planned_at(options, len(progress.runs))
    if planned is None:
        return 0.0
    return min(len(progress.points) / planned.n_touches, 1.0)


def _count(options: PartOptions, progress: TaskProgress) -> Message:
    planned = planned_at(options, len(progress.runs))
    needed = 0 if planned is None else planned.n_touches
    return message("task.points", n_points=len(progress.points), needed=needed)


def _instruction(options: PartOptions, progress: TaskProgress) -> Message:
    planned = planned_at(options, len(progress.runs))
    if planned is None:
        return message("part.no-plan")
    kind = message("part.feature") if planned.kind is None else NAMES[planned.kind]
    return message(
        "part.instruction",
        kind=kind,
        name=planned.name,
        n_points=len(progress.points),
        needed=planned.n_touches,
    )


def _missing(options: PartOptions, ball_diameter: float | None) -> Message | None:
    return message("part.no-plan") if options.plan is None else None


def _rule(options: PartOptions, limits: VerificationLimits) -> Message:
    if options.plan is None:
        return rule_in_words(limits)
    return rule_in_words(replace(limits, rule=options.plan.rule))


@cache
def planned_places(planned: PlannedFeature) -> tuple[Place, ...]:
    """Return where to probe a feature by its nominals, frame of the part.

    The normals point out of the material. Empty if the nominals do not tell.
    """
    area = None
    if planned.kind is not None and planned.nominal is not None:
        area = nominal_area(planned.kind, planned.nominal)
    if area is None:
        return ()
    places = best_places(area, planned.n_touches)
    if planned.side is Side.INSIDE:
        places = [replace(each, normal=-each.normal) for each in places]
    if planned.kind is FeatureKind.LINE:  # at the front of the part
        normal = np.array([0.0, -1.0, 0.0])
        places = sorted(
            (replace(each, normal=normal) for each in places),
            key=lambda each: float(each.point[0]),
        )
    return tuple(places)


def _hand(options: PartOptions, run: int, step: int) -> HandGoal:
    planned = planned_at(options, run)
    places = () if planned is None else planned_places(planned)
    if not places:
        return HandGoal()
    place = places[step % len(places)]
    point = SIMULATED_ORIGIN + SIMULATED_AXES @ place.point
    return HandGoal(point, outwards=SIMULATED_AXES @ place.normal)


PART = VerificationTask(
    kind="part",
    summary="a part by a plan",
    run_help="touches of a feature",
    title=message("part.title"),
    purpose=message("part.title"),
    first=message("part.first"),
    another=message("task.next-point"),
    other_run=message("part.other-feature"),
    known=message("session.same-place"),
    limits=(),
    options=PartOptions,
    measure=measure_by_plan,
    check=check_feature,
    entries=_entries,
    tables=_tables,
    figures_so_far=_figures_so_far,
    hand=_hand,
    n_points=lambda options: 1,
    n_runs=lambda options: 1 if options.plan is None else len(options.plan.features),
    fraction=_fraction,
    count=_count,
    instruction=_instruction,
    newness=lambda options: (ANY, NEW_PLACE),
    missing=_missing,
    rule_of=_rule,
)
