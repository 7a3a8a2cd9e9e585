"""A circle through touches, against its certified radius: the paper's Table 3.

The joint covariance of the points gives the uncertainty of the radius. A form error is
compared with the form that noise alone gives an ideal ring.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import floor, pi
from typing import Annotated, Any

import numpy as np
from msgspec import Meta

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.messages import Message, message
from lightpen.model.expanded_uncertainty import COVERAGE_FACTOR
from lightpen.model.limits import VerificationLimits
from lightpen.verification.tasks.assessment import (
    CALIBRATE_AGAIN,
    CHECK_FILES,
    VERIFY_AGAIN,
    VerificationAssessment,
    check,
    judged_error,
    refused,
)
from lightpen.verification.tasks.circle_fit import (
    CircleFit,
    fit_circle,
    gaps_of,
    on_ring_of,
    residuals_of,
    ring_residuals,
    ring_so_far,
)
from lightpen.verification.tasks.probed_point import (
    ProbedPoint,
    joint_covariance,
    point_entries,
)
from lightpen.verification.tasks.surface_points import (
    MAX_LEFT_OUT,
    away_from_cones,
    form_by_noise,
    missing_certificate,
    split_points,
)
from lightpen.verification.tasks.task import (
    ANY,
    BALL_OPTION,
    BALL_UNCERTAINTY,
    MOST_RUNS,
    Conditions,
    Found,
    HandGoal,
    NumberOption,
    ResultRow,
    ResultTable,
    Runs,
    Surface,
    SurfaceOption,
    TaskOptions,
    TaskProgress,
    VerificationTask,
    ball_offset,
    certificate_option,
    count_option,
)
from lightpen.verification.tasks.tip_evidence import (
    TipEvidence,
    block_diagonal,
    judged_tip,
    tip_entries,
    tip_evidence,
    with_power,
    worse_finding,
)

MIN_TOUCHES = 6
MIN_ANGLE = 270.0  # degrees
MAX_FORM = 0.05  # of the radius; beyond, it is no circle
ANOTHER = 0.1  # of the certified radius: then it is another circle
ENOUGH_POINTS = 10  # for a session
NEW_PLACE = 3.0  # mm

# The ring of the simulated operator, from the bottom of its cone, mm
SIMULATED_RADIUS = 31.751
SIMULATED_CENTER = np.array([0.0, -40.0, 0.0])
SIMULATED_AXES = np.array([[1.0, 0.0, 0.0], [0.0, 0.9, -(0.19**0.5)]])
SIMULATED_STEPS = 12


@dataclass(frozen=True, eq=False)
class CircleRun:
    """One run round a ring."""

    name: str
    touches: tuple[ProbedPoint, ...]
    left_out: tuple[ProbedPoint, ...]  # off the ring: the pen was lifted
    fit: CircleFit
    radius: float  # of the ring, the ball compensated, mm
    uncertainty: float
    form_by_noise: float  # largest that an ideal ring shows, mm

    @property
    def form(self) -> float:
        """Roundness or out-of-plane deviation, the larger one, mm."""
        return max(self.fit.roundness, self.fit.flatness)


@dataclass(frozen=True, eq=False)
class Circle(Found):
    """Runs round a ring of certified radius."""

    runs: tuple[CircleRun, ...]
    certified: float  # mm
    uncertainty: float  # U (k = 2) of mean and certified radius together, mm
    tip: TipEvidence

    @property
    def radii(self) -> FloatArray:
        """Of the runs, mm."""
        return np.array([run.radius for run in self.runs])

    @property
    def errors(self) -> FloatArray:
        """Measured less certified radius of the runs, mm."""
        return self.radii - self.certified

    @property
    def deviation(self) -> float | None:
        """Standard deviation of the radii, mm; None of a single run."""
        return float(self.radii.std(ddof=1)) if len(self.runs) > 1 else None


class CircleOptions(TaskOptions, frozen=True, tag="circle"):
    """A ring; a radius of 0 is not known."""

    radius: Annotated[float, Meta(ge=0)] = 0.0
    radius_uncertainty: Annotated[float, Meta(ge=0)] = 0.0
    surface: Surface = Surface.GROOVE
    ball_uncertainty: Annotated[float, Meta(ge=0)] = BALL_UNCERTAINTY
    n_runs: Annotated[int, Meta(ge=1, le=MOST_RUNS)] = 1


def measure_circle(
    runs: Runs, conditions: Conditions, options: CircleOptions
) -> Circle:
    """Measure a ring in one or several runs.

    The radius of a bore is the radius of the tip centres plus the ball radius, of a
    boss minus it. A motion of the camera halfway round is an error of it. Raises
    `CalibrationError` if points are too few, no circle, or cover too little of it.
    """
    instrument, drift = conditions.instrument, conditions.drift
    certified = options.radius
    offset = ball_offset(options.surface, conditions.ball_diameter)
    measured, rows, noise = [], [], 0.0
    for name, touches in runs:
        run, row = _measure_run(name, touches, instrument, offset, drift)
        measured.append(run)
        rows.append(row)
        noise += sum(
            float(g @ touch.noise @ g)
            for g, touch in zip(run.fit.weights, run.touches, strict=True)
        )
    row = np.mean(rows, axis=0)
    variance = float(row @ instrument.covariance @ row) + noise / len(runs) ** 2
    variance += float(drift.max()) ** 2
    uncertainty = float(
        np.hypot(COVERAGE_FACTOR * np.sqrt(variance), _known_uncertainty(options))
    )
    tip = _tip_evidence(measured, conditions, options)
    return Circle(
        runs=tuple(measured),
        certified=certified,
        uncertainty=uncertainty,
        tip=tip,
        assessment=_assessment(
            measured, certified, uncertainty, tip, conditions.limits
        ),
    )


def _known_uncertainty(options: CircleOptions) -> float:
    """Return U (k = 2) of the radius by certificate and ball, mm."""
    is_groove = options.surface is Surface.GROOVE
    ball = 0.0 if is_groove else options.ball_uncertainty / 2
    return float(np.hypot(options.radius_uncertainty, ball))


def _tip_evidence(
    runs: Sequence[CircleRun], conditions: Conditions, options: CircleOptions
) -> TipEvidence:
    """Return the evidence of the points on the tip; each run has its own ring."""
    points = [touch for run in runs for touch in run.touches]
    rings = [ring_residuals(run.fit, len(run.touches)) for run in runs]
    off = [
        np.concatenate([run.fit.radial + run.radius - options.radius, run.fit.axial])
        for run in runs
    ]
    is_radial = [np.repeat([1.0, 0.0], len(run.touches)) for run in runs]
    known = _known_uncertainty(options)
    by_radius = np.concatenate(is_radial) * known / COVERAGE_FACTOR
    by_points = block_diagonal([ring.by_points for ring in rings])
    drift = np.diag(np.tile(conditions.drift**2, len(points)))
    return tip_evidence(
        points,
        conditions.instrument,
        np.concatenate(off),
        by_points,
        block_diagonal([ring.by_ring for ring in rings]),
        np.outer(by_radius, by_radius) + by_points @ drift @ by_points.T,
    )


def _measure_run(
    name: str,
    touches: Sequence[ProbedPoint],
    instrument: Instrument,
    ball_offset: float,
    drift: FloatArray,
) -> tuple[CircleRun, FloatArray]:
    """Return a run, and the derivative of its radius by the instrument."""
    if len(touches) < MIN_TOUCHES:
        raise CalibrationError(
            "circle.too-few", run=name, n_touches=len(touches), needed=MIN_TOUCHES
        )
    points = np.array([touch.point_cam for touch in touches])
    fit_circle(points)  # raises if they determine none
    on_ring = on_ring_of(points)
    fit = fit_circle(points[on_ring])
    off = max(fit.roundness, fit.flatness)
    if np.mean(~on_ring) > MAX_LEFT_OUT or off > MAX_FORM * fit.radius:
        raise CalibrationError(
            "circle.none",
            run=name,
            n_off=int(np.sum(~on_ring)),
            n_touches=len(touches),
            off=off,
        )
    kept, left_out = split_points(touches, on_ring)
    _require_closed(name, kept, fit)
    row = np.einsum(
        "ni,niq->q", fit.weights, np.array([touch.sensitivity for touch in kept])
    )
    variance = float(row @ instrument.covariance @ row) + sum(
        float(g @ touch.noise @ g) for g, touch in zip(fit.weights, kept, strict=True)
    )
    run = CircleRun(
        name=name,
        touches=kept,
        left_out=left_out,
        fit=fit,
        radius=fit.radius + ball_offset,
        uncertainty=COVERAGE_FACTOR * float(np.hypot(np.sqrt(variance), drift.max())),
        form_by_noise=_form_by_noise(fit, kept, instrument, drift),
    )
    return run, row


def _form_by_noise(
    fit: CircleFit,
    touches: Sequence[ProbedPoint],
    instrument: Instrument,
    drift: FloatArray,
) -> float:
    """Return the quantile of the form that errors of the points make, mm."""
    n = len(touches)
    ring = ring_residuals(fit, n)
    covariance = joint_covariance(touches, instrument) + np.diag(np.tile(drift**2, n))
    by_radius = np.repeat([[1.0], [0.0]], n, axis=0)
    unknowns, _ = np.linalg.qr(np.column_stack([ring.by_ring, by_radius]))
    keeps = ring.by_points - unknowns @ (unknowns.T @ ring.by_points)
    return form_by_noise(keeps @ covariance @ keeps.T, n_rows=2)


def _require_closed(name: str, touches: Sequence[ProbedPoint], fit: CircleFit) -> None:
    if fit.covered >= MIN_ANGLE:
        return
    order = np.argsort(fit.angles)
    widest = int(np.argmax(gaps_of(fit.angles)))
    raise CalibrationError(
        "circle.open",
        run=name,
        covered=fit.covered,
        needed=MIN_ANGLE,
        first=touches[order[widest]].label,
        second=touches[order[(widest + 1) % len(order)]].label,
    )


def _assessment(
    runs: Sequence[CircleRun],
    certified: float,
    uncertainty: float,
    tip: TipEvidence,
    limits: VerificationLimits,
) -> VerificationAssessment:
    mean = float(np.mean([run.radius for run in runs]))
    error = mean - certified
    if abs(error) > ANOTHER * certified:
        return refused(
            message("circle.another", measured=mean, certified=certified), VERIFY_AGAIN
        )
    reason = message(
        "circle.radius-off", error=error, uncertainty=uncertainty, limit=limits.radius
    )
    blamed = refused(reason, CALIBRATE_AGAIN)
    off = judged_error(error, uncertainty, limits.radius, limits, blamed)
    against = judged_tip(tip, limits)
    finding = worse_finding(against, off)
    if finding is not None:
        return finding
    worst = max(runs, key=lambda run: run.form / max(limits.form, run.form_by_noise))
    form_limit = max(limits.form, worst.form_by_noise)
    if worst.form > form_limit:
        return refused(
            message("circle.form", run=worst.name, form=worst.form, limit=form_limit),
            VERIFY_AGAIN,
        )
    lifted = [touch for run in runs for touch in run.left_out]
    if lifted:
        return check(
            message("circle.lifted", n_left_out=len(lifted), first=lifted[0].label),
            VERIFY_AGAIN,
        )
    if uncertainty > limits.radius:
        return check(
            message("circle.uncertain", uncertainty=uncertainty, limit=limits.radius),
            CHECK_FILES,
        )
    return with_power(
        message(
            "circle.good", error=error, uncertainty=uncertainty, limit=limits.radius
        ),
        tip,
        limits,
    )


def ring_fit(points: Sequence[ProbedPoint]) -> CircleFit | None:
    """Return the circle that points lie on so far; None before they determine one."""
    return ring_so_far(np.array([point.point_cam for point in points]).reshape(-1, 3))


def covered(points: Sequence[ProbedPoint]) -> float:
    """Return the covered angle of a ring, degrees; 0 at first."""
    fit = ring_fit(points)
    return 0.0 if fit is None else fit.covered


def _missing(options: CircleOptions, ball_diameter: float | None) -> Message | None:
    if not options.radius:
        return message("verification.no-radius")
    return missing_certificate(
        options.radius_uncertainty, options.surface, ball_diameter
    )


def _entries(found: Circle, instrument: Instrument) -> dict[str, Any]:
    errors = found.errors
    return {
        "certified_radius_mm": found.certified,
        "mean_radius_mm": found.radii.mean(),
        "mean_error_mm": errors.mean(),
        "mean_relative_error": errors.mean() / found.certified,
        "std_mm": found.deviation,
        "expanded_uncertainty_mm": found.uncertainty,
        **tip_entries(found.tip),
        "runs": [
            {
                "name": run.name,
                "radius_mm": run.radius,
                "expanded_uncertainty_mm": run.uncertainty,
                "center_cam_mm": run.fit.center_cam,
                "normal_cam": run.fit.normal_cam,
                "roundness_mm": run.fit.roundness,
                "flatness_mm": run.fit.flatness,
                "covered_deg": run.fit.covered,
                "touches": point_entries(run.touches, instrument),
                "left_out": point_entries(run.left_out, instrument),
                "error_mm": error,
                "relative_error": error / found.certified,
            }
            for run, error in zip(found.runs, errors.tolist(), strict=True)
        ],
    }


def _tables(found: Circle, conditions: Conditions) -> tuple[ResultTable, ...]:
    """Return the paper's Table 3."""
    runs, errors = found.runs, found.errors
    n_runs = len(runs)
    columns: list[Message | str] = [str(i + 1) for i in range(n_runs)]

    def row(name: Message, values: Sequence[float], decimals: int = 4) -> ResultRow:
        average = [float(np.mean(values))] if n_runs > 1 else []
        return ResultRow(name, [*values, *average], decimals)

    rows = [
        row(message("circle.radius"), found.radii.tolist()),
        row(message("circle.error"), errors.tolist()),
        row(message("circle.relative"), (1e4 * errors / found.certified).tolist(), 2),
        row(message("table.uncertainty"), [run.uncertainty for run in runs]),
        row(message("circle.roundness"), [run.fit.roundness for run in runs]),
        row(message("circle.out-of-plane"), [run.fit.flatness for run in runs]),
        row(message("circle.covered"), [run.fit.covered for run in runs], 0),
        row(message("option.points"), [float(len(run.touches)) for run in runs], 0),
    ]
    if found.deviation is not None:
        columns.append(message("table.average"))
        blanks = [None] * n_runs
        rows += [
            ResultRow(message("table.deviation"), [*blanks, found.deviation]),
            ResultRow(message("table.mean-uncertainty"), [*blanks, found.uncertainty]),
        ]
    title = message("circle.table", certified=found.certified)
    return (ResultTable(title, tuple(columns), tuple(rows)),)


def _figures_so_far(
    options: CircleOptions, progress: TaskProgress, conditions: Conditions
) -> tuple[ResultTable, ...]:
    """Return the residuals of the last points from the ring so far."""
    points, fit = progress.points, ring_fit(progress.points)
    title = message("circle.residuals")
    if fit is None:
        return (ResultTable(title),)
    rows = tuple(
        ResultRow(message("table.point", number=i), off.tolist())
        for i, off in enumerate(residuals_of(fit, [p.point_cam for p in points]), 1)
    )
    columns = message("circle.radial"), message("circle.axial")
    return (ResultTable(title, columns, rows),)


def _fraction(options: CircleOptions, progress: TaskProgress) -> float:
    points = progress.points
    return min(covered(points) / MIN_ANGLE, len(points) / ENOUGH_POINTS, 1.0)


def _count(options: CircleOptions, progress: TaskProgress) -> Message:
    angle = floor(covered(progress.points))  # 269.9 is not yet 270
    return message("circle.count", covered=angle, needed=MIN_ANGLE)


def _instruction(options: CircleOptions, progress: TaskProgress) -> Message:
    return message("session.touch-ring", n_touches=len(progress.points))


def _hand(options: CircleOptions, run: int, step: int) -> HandGoal:
    angle = 2 * pi * step / SIMULATED_STEPS
    spoke = np.array([np.cos(angle), np.sin(angle)]) @ SIMULATED_AXES
    return HandGoal(SIMULATED_CENTER + SIMULATED_RADIUS * spoke)


CIRCLE = VerificationTask(
    kind="circle",
    summary="a ring of certified radius",
    run_help="once round the ring",
    title=message("circle.title"),
    purpose=message("circle.purpose"),
    first=message("circle.first"),
    another=message("task.next-point"),
    known=message("session.same-place"),
    limits=("radius", "form", "tip"),
    options=CircleOptions,
    fields=(
        NumberOption(
            "radius",
            message("circle.certified"),
            unknown=message("option.unknown"),
            argument="--radius",
            help="certified radius",
        ),
        certificate_option("radius_uncertainty"),
        SurfaceOption(
            "surface",
            message("option.surface"),
            (message("circle.groove"), message("circle.bore"), message("circle.boss")),
            argument="--surface",
            words={"bore": Surface.BORE, "boss": Surface.BOSS},
            ball_help="ball diameter, if a bore or a boss was touched, not a groove",
        ),
        BALL_OPTION,
        count_option("n_runs", message("option.runs"), 1, MOST_RUNS),
    ),
    measure=measure_circle,
    entries=_entries,
    tables=_tables,
    figures_so_far=_figures_so_far,
    hand=_hand,
    n_points=lambda options: ENOUGH_POINTS,
    n_runs=lambda options: options.n_runs,
    fraction=_fraction,
    count=_count,
    instruction=_instruction,
    screen=away_from_cones,
    newness=lambda options: (ANY, NEW_PLACE),
    missing=_missing,
)
