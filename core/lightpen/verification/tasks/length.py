"""A certified length between two cones, or of a bar, at several places.

An error of the pen's scale leaves no residual and moves nothing that stands still; a
length shows it. So the lengths, with their covariance, determine the scale.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, TypeAlias

import numpy as np
from msgspec import Meta

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.estimation.reports.verdict import Grade
from lightpen.estimation.uncertainty.budget import COVERAGE_FACTOR
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.messages import Message, message
from lightpen.model.limits import VerificationLimits
from lightpen.verification.tasks.assessment import (
    CHECK_FILES,
    VERIFY_AGAIN,
    VerificationAssessment,
    check,
    graded,
)
from lightpen.verification.tasks.probed_point import (
    ProbedPoint,
    on_surface,
    point_entries,
)
from lightpen.verification.tasks.task import (
    ANY,
    MOST_RUNS,
    Conditions,
    Found,
    HandGoal,
    NumberOption,
    ResultRow,
    ResultTable,
    Runs,
    Screening,
    Surface,
    SurfaceOption,
    TaskOptions,
    TaskProgress,
    VerificationTask,
    ball_offset,
    certificate_option,
    count_option,
    keep_all,
)
from lightpen.verification.tasks.tip_evidence import (
    TipEvidence,
    block_diagonal,
    judged_tip,
    tip_entries,
    tip_evidence,
    with_power,
)

Ends: TypeAlias = tuple[tuple[ProbedPoint, ...], tuple[ProbedPoint, ...]]

MIN_APART = 0.1  # of the certified length, between two ends
MAX_WIDE = 0.1  # of the distance of the ends, that touches of one end may scatter
ANOTHER = 0.1  # of the certified length: the ends are those of another one
OTHER_END = 10.0  # mm from the first
# The bar of the simulated operator, from the bottom of its cone, mm
SIMULATED_ENDS = np.array([[-75.0, -20.0, 0.0], [75.0, -20.0, 0.0]])
SIMULATED_LENGTH = 150.0
SIMULATED_STEP = np.array([0.0, 15.0, 0.0])  # from one place to the next


@dataclass(frozen=True, eq=False)
class LengthRun:
    """A length measured at one place.

    Attributes
    ----------
    measured : float
        mm.
    uncertainty : float
        U (k = 2) of it, mm.
    along_view : float
        Cosine between the length and the line of sight, 0 to 1: 1 measures depth.
    """

    name: str
    ends: Ends
    measured: float
    uncertainty: float
    along_view: float


@dataclass(frozen=True)
class Scale:
    """Factor for the coordinates of the pen file.

    Attributes
    ----------
    uncertainty : float
        U (k = 2) of it.
    uncertainty_before : float
        U (k = 2) without the length.
    """

    factor: float
    uncertainty: float
    uncertainty_before: float


@dataclass(frozen=True, eq=False)
class Length(Found):
    """A certified length measured at one or several places.

    Attributes
    ----------
    certified, certified_uncertainty : float
        The length and U (k = 2) of it, mm.
    uncertainties : (N,) array
        U (k = 2) of each error, mm.
    tip : TipEvidence
        The evidence of the lengths on the tip.
    """

    runs: tuple[LengthRun, ...]
    certified: float
    certified_uncertainty: float
    uncertainties: FloatArray
    scale: Scale
    tip: TipEvidence

    @property
    def errors(self) -> FloatArray:
        """Measured less certified, of each place, mm."""
        return np.array([run.measured for run in self.runs]) - self.certified


class LengthOptions(TaskOptions, frozen=True, tag="length"):
    """A length; one of 0 is not known."""

    length: Annotated[float, Meta(ge=0)] = 0.0
    length_uncertainty: Annotated[float, Meta(ge=0)] = 0.0
    surface: Surface = Surface.GROOVE
    n_places: Annotated[int, Meta(ge=1, le=MOST_RUNS)] = 1


def measure_length(
    runs: Runs, conditions: Conditions, options: LengthOptions
) -> Length:
    """Measure a length at one or several places.

    A run holds the points of both ends at one place. Inner faces lie farther out than
    the centre of the ball by its radius, outer ones less.

    Raises
    ------
    CalibrationError
        The points of a place are not of two ends.
    """
    instrument, drift = conditions.instrument, conditions.drift
    # Inner and outer faces are off by the radius of the ball at both ends.
    ball = conditions.ball_uncertainty * (options.surface is not Surface.GROOVE)
    certified = options.length
    certified_uncertainty = float(np.hypot(options.length_uncertainty, ball))
    offset = ball_offset(options.surface, conditions.ball_diameter)
    measured, rows, noises, ways, by_points = [], [], [], [], []
    for name, touches in runs:
        ends = _on_faces(_two_ends(name, touches, certified), offset)
        middles = [np.mean([t.point_cam for t in end], axis=0) for end in ends]
        span = middles[1] - middles[0]
        length = float(np.linalg.norm(span))
        along = span / length
        row, noise = np.zeros(len(instrument.covariance)), float(along**2 @ drift**2)
        signed = tuple(zip(ends, (-1.0, 1.0), strict=True))
        for end, sign in signed:
            for touch in end:
                row += sign / len(end) * along @ touch.sensitivity
                noise += float(along @ touch.noise @ along) / len(end) ** 2
        variance = float(row @ instrument.covariance @ row) + noise
        view = (middles[0] + middles[1]) / np.linalg.norm(middles[0] + middles[1])
        measured.append(
            LengthRun(
                name=name,
                ends=ends,
                measured=length,
                uncertainty=COVERAGE_FACTOR * float(np.sqrt(variance)),
                along_view=float(abs(along @ view)),
            )
        )
        rows.append(row)
        noises.append(noise)
        ways.append(along)
        by_points.append(
            np.concatenate([np.tile(s / len(e) * along, len(e)) for e, s in signed])[
                None
            ]
        )
    uncertainties = np.hypot(
        [run.uncertainty for run in measured], certified_uncertainty
    )
    errors = np.array([run.measured for run in measured]) - certified
    certificate = (certified_uncertainty / COVERAGE_FACTOR) ** 2
    own = np.diag([float(along**2 @ drift**2) for along in ways]) + certificate
    tip = tip_evidence(
        [touch for run in measured for end in run.ends for touch in end],
        instrument,
        errors,
        block_diagonal(by_points),
        np.zeros((len(errors), 0)),
        own,
    )
    return Length(
        runs=tuple(measured),
        certified=certified,
        certified_uncertainty=certified_uncertainty,
        uncertainties=uncertainties,
        scale=_scale(instrument, np.array(rows), np.diag(noises) + certificate, errors),
        tip=tip,
        assessment=_assessment(measured, errors, uncertainties, tip, conditions.limits),
    )


def _two_ends(name: str, touches: Sequence[ProbedPoint], certified: float) -> Ends:
    """Part the touches by the widest gap along the line that they lie on."""
    if len(touches) < 2:
        raise CalibrationError("length.too-few", run=name, n_touches=len(touches))
    points = np.array([touch.point_cam for touch in touches])
    along = np.linalg.svd(points - points.mean(axis=0))[2][0]
    places = points @ along
    order = np.argsort(places)
    widest = int(np.argmax(np.diff(places[order])))
    gap = float(np.diff(places[order])[widest])
    if gap < MIN_APART * certified:
        raise CalibrationError("length.one-end", run=name, extent=float(np.ptp(places)))
    ends = order[: widest + 1], order[widest + 1 :]
    widths = [
        np.linalg.norm(points[end] - points[end].mean(axis=0), axis=1) for end in ends
    ]
    for end, width in zip(ends, widths, strict=True):
        if width.max() > MAX_WIDE * gap:
            raise CalibrationError(
                "length.no-end",
                run=name,
                touch=touches[int(end[np.argmax(width)])].label,
                distance=float(width.max()),
            )
    first, second = (tuple(touches[int(i)] for i in sorted(end)) for end in ends)
    return first, second


def _on_faces(ends: Ends, ball_offset: float) -> Ends:
    """Return both ends, moved from the ball centres to the probed surfaces."""
    one, other = (np.mean([t.point_cam for t in end], axis=0) for end in ends)
    outwards = (other - one) / np.linalg.norm(other - one)
    first, second = ends
    return (
        tuple(on_surface(touch, ball_offset, -outwards) for touch in first),
        tuple(on_surface(touch, ball_offset, outwards) for touch in second),
    )


def _scale(
    instrument: Instrument, rows: FloatArray, noise: FloatArray, errors: FloatArray
) -> Scale:
    """Return the scale from prior and lengths (least squares)."""
    leds = instrument.pen.leds - instrument.pen.leds.mean(axis=0)
    of_scale = np.zeros(len(instrument.covariance))
    of_scale[instrument.parameters.leds] = (leds / np.sum(leds**2)).ravel()
    covariance = instrument.covariance
    spread = rows @ covariance @ rows.T + noise
    gain = np.linalg.solve(spread, rows @ covariance @ of_scale)
    before = float(of_scale @ covariance @ of_scale)
    after = before - float(gain @ rows @ covariance @ of_scale)
    return Scale(
        factor=1.0 - float(gain @ errors),
        uncertainty=COVERAGE_FACTOR * float(np.sqrt(max(after, 0.0))),
        uncertainty_before=COVERAGE_FACTOR * float(np.sqrt(before)),
    )


def _assessment(
    runs: Sequence[LengthRun],
    errors: FloatArray,
    uncertainties: FloatArray,
    tip: TipEvidence,
    limits: VerificationLimits,
) -> VerificationAssessment:
    worst = int(np.argmax(np.abs(errors)))
    error, uncertainty = float(errors[worst]), float(uncertainties[worst])
    grade = graded(error, uncertainty, limits.length, limits)
    against = judged_tip(tip, limits)
    if against is not None and against.grade is Grade.REPEAT:
        return against
    if grade is not Grade.PASS:
        return VerificationAssessment(
            grade,
            message(
                "length.off",
                run=runs[worst].name,
                error=error,
                uncertainty=uncertainty,
                limit=limits.length,
            ),
            CHECK_FILES,
        )
    if against is not None:
        return against
    if uncertainty > limits.length:
        return check(
            message(
                "length.uncertain",
                run=runs[worst].name,
                uncertainty=uncertainty,
                limit=limits.length,
            ),
            VERIFY_AGAIN,
        )
    return with_power(
        message(
            "length.good", error=error, uncertainty=uncertainty, limit=limits.length
        ),
        tip,
        limits,
    )


def _screen(
    options: LengthOptions, conditions: Conditions, progress: TaskProgress
) -> Screening:
    """Return the last point as a first end if the two do not form such a length."""
    points, certified = progress.points, options.length
    if len(points) != 2:
        return keep_all(len(points))
    one, other = (point.point_cam for point in points)
    beyond = 2 * ball_offset(options.surface, conditions.ball_diameter)
    distance = float(np.linalg.norm(one - other)) + beyond
    if abs(distance - certified) <= ANOTHER * certified:
        return keep_all(2)
    trouble = message("session.no-ends", distance=distance, certified=certified)
    return Screening((1,), trouble)


def _missing(options: LengthOptions, ball_diameter: float | None) -> Message | None:
    if not options.length:
        return message("verification.no-length")
    if not options.length_uncertainty:
        return message("verification.no-certificate-u")
    if options.surface is not Surface.GROOVE and not ball_diameter:
        return message("verification.no-ball")
    return None


def _entries(found: Length, instrument: Instrument) -> dict[str, Any]:
    return {
        "certified_length_mm": found.certified,
        "certified_expanded_uncertainty_mm": found.certified_uncertainty,
        "scale": {
            "factor": found.scale.factor,
            "expanded_uncertainty": found.scale.uncertainty,
            "expanded_uncertainty_before": found.scale.uncertainty_before,
        },
        **tip_entries(found.tip),
        "runs": [
            {
                "name": run.name,
                "length_mm": run.measured,
                "error_mm": error,
                "expanded_uncertainty_mm": uncertainty,
                "along_view": run.along_view,
                "ends": [point_entries(end, instrument) for end in run.ends],
            }
            for run, error, uncertainty in _places(found)
        ],
    }


def _places(found: Length) -> list[tuple[LengthRun, float, float]]:
    """Return each place with its error and the uncertainty of it."""
    figures = found.errors.tolist(), found.uncertainties.tolist()
    return list(zip(found.runs, *figures, strict=True))


def _tables(found: Length, conditions: Conditions) -> tuple[ResultTable, ...]:
    limit, scale = conditions.limits.length, found.scale
    title = message(
        "length.table",
        certified=found.certified,
        uncertainty=found.certified_uncertainty,
    )
    columns = (
        message("length.measured"),
        message("table.error"),
        message("table.uncertainty"),
        message("table.limit"),
    )
    rows = (
        ResultRow(run.name, [run.measured, error, uncertainty, limit])
        for run, error, uncertainty in _places(found)
    )
    note = message(
        "length.scale",
        factor=scale.factor,
        uncertainty=1e6 * scale.uncertainty,
        before=1e6 * scale.uncertainty_before,
    )
    return (ResultTable(title, columns, tuple(rows), (note,)),)


LENGTH = VerificationTask(
    kind="length",
    summary="a certified length",
    run_help="both ends of the length at one place",
    title=message("length.title"),
    purpose=message("length.purpose"),
    first=message("length.first"),
    another=message("length.another"),
    known=message("session.same-end"),
    limits=("length", "tip"),
    options=LengthOptions,
    fields=(
        NumberOption(
            "length",
            message("length.certified"),
            unknown=message("option.unknown"),
            argument="--length",
            help="certified length",
        ),
        certificate_option("length_uncertainty"),
        SurfaceOption(
            "surface",
            message("option.surface"),
            (
                message("length.cones"),
                message("length.inner-faces"),
                message("length.outer-faces"),
            ),
            argument="--faces",
            words={"outer": Surface.BOSS, "inner": Surface.BORE},
            ball_help="ball diameter, if faces were touched, not cones",
        ),
        count_option("n_places", message("option.places"), 1, MOST_RUNS),
    ),
    measure=measure_length,
    entries=_entries,
    tables=_tables,
    hand=lambda options, run, step: HandGoal(
        SIMULATED_ENDS[step % 2] + run * SIMULATED_STEP
    ),
    n_points=lambda options: 2,
    n_runs=lambda options: options.n_places,
    instruction=lambda options, progress: message(
        "session.touch-ends", n_touches=len(progress.points)
    ),
    screen=_screen,
    newness=lambda options: (ANY, min(OTHER_END, options.length / 2)),
    missing=_missing,
)
