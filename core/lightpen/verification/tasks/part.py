"""A part measured by a plan, one run for each of its features.

`lightpen.measuring` does the geometry; here are the touches, their order, and the shown
and recorded results. A plan that is ended early gives the results of the probed
features.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from msgspec import structs

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.measuring.known_forms import Refinement, refine
from lightpen.measuring.part import MeasuredPart, measure_part
from lightpen.measuring.report import (
    PartRow,
    characteristic_rows,
    feature_rows,
    part_entries,
)
from lightpen.measuring.surfaces import NAMES
from lightpen.messages import Message, message
from lightpen.model.decision_rules import Decision
from lightpen.model.expanded_uncertainty import COVERAGE_FACTOR
from lightpen.model.limits import VerificationLimits, rule_in_words
from lightpen.verification.tasks.assessment import (
    VerificationAssessment,
    accepted,
    check,
    refused,
    worst,
)
from lightpen.verification.tasks.part_course import (
    PartOptions,
    base_name,
    course,
    feature_so_far,
    hand_goal,
    planned_at,
    touches_of_part,
)
from lightpen.verification.tasks.probed_point import ProbedPoint, point_entries
from lightpen.verification.tasks.task import (
    ANY,
    Conditions,
    Found,
    ResultRow,
    ResultTable,
    Runs,
    TaskProgress,
    VerificationTask,
)

NEW_PLACE = 0.5  # mm
MOST_NAMED = 5  # characteristics in a sentence


@dataclass(frozen=True, eq=False)
class Part(Found):
    """A measured part."""

    part: MeasuredPart
    points: tuple[tuple[str, ProbedPoint], ...]  # feature and ball centre
    missing: tuple[str, ...]  # features that were not probed
    refinement: Refinement | None = None  # by features of known form

    def deviations(self) -> list[FloatArray | None]:
        """Return the way from its feature to each point, (3,), mm; None if unknown."""
        found: list[FloatArray | None] = [None] * len(self.points)
        for name, one in self.part.features.items():
            if one.feature is not None:
                at = self.part.touches.first_of(name).tolist()
                for i, offset in zip(at, one.feature.offsets, strict=True):
                    found[i] = offset
        return found

    def budgets(self, instrument: Instrument) -> list[dict[str, float] | None]:
        """Return U (k = 2) of each characteristic by its sources, mm or degrees.

        The sources are taken one by one, without their correlations; None for
        geometrical deviations.
        """
        points = [point for _, point in self.points]
        by_parameters = np.concatenate([point.sensitivity for point in points])
        covariance = instrument.covariance
        if self.refinement is not None and self.refinement.is_used:
            covariance = self.refinement.after
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
            covariances[name] = rows @ covariance[np.ix_(of, of)] @ rows.T
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


def measure_by_plan(runs: Runs, conditions: Conditions, options: PartOptions) -> Part:
    """Measure a part by its plan, up to the features probed so far.

    Runs are named after features, or in the order of the plan. Raises
    `CalibrationError` if the touches of a feature are too few, show no side or do not
    determine it.
    """
    if options.plan is None:
        raise CalibrationError("part.no-plan")
    found = _owned(runs, options)
    names = {base_name(name) for name, _ in found}
    plan = options.plan.limited_to(names)
    if not plan.features:
        raise CalibrationError("part.nothing-probed")
    sensitivity = np.concatenate([point.sensitivity for _, point in found])
    touches, refinement = refine(
        plan,
        touches_of_part(found, conditions, options),
        sensitivity,
        conditions.instrument.covariance,
    )
    part = measure_part(plan, touches)
    missing = tuple(
        each.name for each in options.plan.features if each.name not in names
    )
    assessment = _assessment(part, missing)
    for position, motion in part.ties.items():
        if not motion.is_consistent:
            residual = float(motion.residuals.max())
            reason = message("part.datums-moved", position=position, residual=residual)
            doubt = refused(reason, message("part.probe-again"))
            assessment = worst((doubt, assessment))
    if refinement is not None and not refinement.is_used:
        reason = _refined(refinement, conditions.instrument)
        assessment = worst((assessment, check(reason, message("part.check-known"))))
    return Part(assessment, part, tuple(found), missing, refinement)


def check_feature(runs: Runs, conditions: Conditions, options: PartOptions) -> None:
    """Refuse the last of some runs if it does not determine its feature."""
    if options.plan is None:
        return
    found = _owned(runs, options)
    last = found[-1][0]
    name = base_name(last)
    own = [(name, point) for owner, point in found if owner == last]
    plan = structs.replace(
        options.plan.limited_to({name}), constructions=(), characteristics=()
    )
    measure_part(
        structs.replace(plan, alignment=None), touches_of_part(own, conditions, options)
    )


def _owned(runs: Runs, options: PartOptions) -> list[tuple[str, ProbedPoint]]:
    """Return the touches with their features."""
    planned = [each.name for each in course(options)]
    names = dict.fromkeys(map(base_name, planned))
    found = []
    for i, (run, points) in enumerate(runs):
        is_named = base_name(run) in names
        if not is_named and i >= len(planned):
            raise CalibrationError(
                "measuring.unknown-feature", name=run, names=", ".join(names)
            )
        found += [(run if is_named else planned[i], point) for point in points]
    return found


def _assessment(part: MeasuredPart, missing: tuple[str, ...]) -> VerificationAssessment:
    def named(decision: Decision) -> list[Message]:
        results = part.results
        return [each.planned.words for each in results if each.decision is decision]

    out, unclear = named(Decision.REJECTED), named(Decision.OPEN)
    n_judged = len(out) + len(unclear) + len(named(Decision.ACCEPTED))
    name = part.plan.words
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
    return accepted(
        message("part.good", part=name, n_judged=n_judged), message("part.done")
    )


def _listed(names: Sequence[Message]) -> tuple[Message, ...]:
    more = [message("measuring.named", name="...")] if len(names) > MOST_NAMED else []
    return (*names[:MOST_NAMED], *more)


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
        "refinement": _refinement_entries(found.refinement, instrument),
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


def _refinement_entries(
    refinement: Refinement | None, instrument: Instrument
) -> dict[str, Any] | None:
    if refinement is None:
        return None
    tip = instrument.parameters.tip
    before, after = (
        COVERAGE_FACTOR * np.sqrt(np.diag(covariance)[tip])
        for covariance in (refinement.before, refinement.after)
    )
    return {
        "features": list(refinement.names),
        "is_used": refinement.is_used,
        "tip_shift_pen_mm": refinement.shift[tip],
        "tip_expanded_uncertainty_before_mm": before,
        "tip_expanded_uncertainty_after_mm": after,
        "chi_square": refinement.chi_square,
        "degrees_of_freedom": refinement.n_free,
    }


def _refined(refinement: Refinement, instrument: Instrument) -> Message:
    """Return the evidence on the tip by features of known form."""
    names = ", ".join(refinement.names)
    if not refinement.is_used:
        return message(
            "part.not-refined",
            names=names,
            chi_square=refinement.chi_square,
            n_free=refinement.n_free,
        )
    tip = instrument.parameters.tip
    before, after = (
        COVERAGE_FACTOR * float(np.sqrt(np.diag(covariance)[tip].max()))
        for covariance in (refinement.before, refinement.after)
    )
    shift = float(np.linalg.norm(refinement.shift[tip]))
    return message("part.refined", names=names, shift=shift, before=before, after=after)


def _tables(found: Part, conditions: Conditions) -> tuple[ResultTable, ...]:
    part = found.part
    in_part = message("part.features-in-part")
    in_camera = message("part.features-in-camera")
    features = ResultTable(
        in_camera if part.alignment is None else in_part,
        (
            *("x", "y", "z", message("part.position-uncertainty")),
            *(message("part.size"), message("part.size-uncertainty")),
            message("part.form"),
            message("part.kind"),
        ),
        _rows(feature_rows(part)),
        tuple(_notes(found, conditions)),
    )
    characteristics = ResultTable(
        message("part.characteristics"),
        (
            message("part.nominal"),
            message("part.tolerance"),
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
    return tuple(each for each in (characteristics, features) if each.rows)


def _notes(found: Part, conditions: Conditions) -> Iterator[Message]:
    """Yield notes on datum points of a moved part and on features of known form."""
    for position, motion in found.part.ties.items():
        residual = float(motion.residuals.max())
        yield message("part.moved", position=position, residual=residual)
    if found.refinement is not None:
        yield _refined(found.refinement, conditions.instrument)


def _rows(rows: Iterable[PartRow]) -> tuple[ResultRow, ...]:
    return tuple(ResultRow(each.name, each.values, 4, each.remark) for each in rows)


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
            message("table.point", number=i),
            [*point.point_cam.tolist(), off if np.isfinite(off) else None],
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
    name, n_points, needed = planned.name, len(progress.points), planned.n_touches
    if planned.scan and n_points:
        return message(
            "part.slide", kind=kind, name=name, n_points=n_points, needed=needed
        )
    return message(
        "part.instruction", kind=kind, name=name, n_points=n_points, needed=needed
    )


def _scans(options: PartOptions, run: int) -> bool:
    planned = planned_at(options, run)
    return planned is not None and planned.scan


def _missing(options: PartOptions, ball_diameter: float | None) -> Message | None:
    return message("part.no-plan") if options.plan is None else None


def _rule(options: PartOptions, limits: VerificationLimits) -> Message:
    if options.plan is None:
        return rule_in_words(limits)
    return rule_in_words(replace(limits, rule=options.plan.rule))


PART = VerificationTask(
    kind="part",
    summary="a part by a plan",
    run_help="probed points of a feature",
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
    hand=hand_goal,
    n_points=lambda options: 1,
    n_runs=lambda options: max(len(course(options)), 1),
    fraction=_fraction,
    count=_count,
    instruction=_instruction,
    newness=lambda options: (ANY, NEW_PLACE),
    scans=_scans,
    missing=_missing,
    rule_of=_rule,
)
