"""A certified length between two cones, or of a bar, at several places.

ISO 10360-12 measures lengths in seven places and compares each error with its maximum
permissible error, a constant and what each metre adds [1]_. A length is certified for
20 degrees Celsius and grows with the temperature of its artefact.

An error of the pen's scale leaves no residual and moves nothing that stands still; a
length shows it. So the lengths, with their covariance, determine the scale.

References
----------
.. [1] ISO 10360-12:2016, length measurement error of articulated arm CMMs.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, TypeAlias

import numpy as np
from msgspec import Meta

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.messages import Message, message
from lightpen.model.expanded_uncertainty import COVERAGE_FACTOR
from lightpen.model.limits import VerificationLimits
from lightpen.verification.tasks.assessment import (
    CHECK_FILES,
    VERIFY_AGAIN,
    VerificationAssessment,
    accepted,
    check,
    judged_error,
    refused,
)
from lightpen.verification.tasks.probed_point import (
    ProbedPoint,
    on_surface,
    point_entries,
)
from lightpen.verification.tasks.surface_points import missing_certificate
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
    worse_finding,
)

Ends: TypeAlias = tuple[tuple[ProbedPoint, ...], tuple[ProbedPoint, ...]]

MIN_APART = 0.1  # of the certified length, between two ends
MAX_WIDE = 0.1  # of the distance of the ends, that touches of one end may scatter
ANOTHER = 0.1  # of the certified length: another length was probed
OTHER_END = 10.0  # mm from the first
REFERENCE = 20.0  # degrees Celsius, for which a length is certified
KNOWN_EXPANSION = 0.1  # U (k = 2) of an expansion coefficient, relative
STANDARD_PLACES = 7
# The bar of the simulated operator, from the bottom of its cone, mm
SIMULATED_ENDS = np.array([[-75.0, -20.0, 0.0], [75.0, -20.0, 0.0]])
SIMULATED_LENGTH = 150.0
SIMULATED_STEP = np.array([0.0, 15.0, 0.0])  # from one place to the next


@dataclass(frozen=True, eq=False)
class LengthRun:
    """A length measured at one place."""

    name: str
    ends: Ends
    measured: float  # mm
    certified: float  # at the temperature of the artefact, mm
    uncertainty: float  # U (k = 2) of the error, mm
    limit: float  # maximum permissible error, mm
    along_view: float  # cosine between length and line of sight: 1 measures depth

    @property
    def error(self) -> float:
        """Measured less certified, mm."""
        return self.measured - self.certified

    @property
    def share(self) -> float:
        """Size of the error in units of its limit."""
        return abs(self.error) / self.limit


@dataclass(frozen=True)
class Scale:
    """Factor for the coordinates of the pen file; U (k = 2) with it and before."""

    factor: float
    uncertainty: float
    uncertainty_before: float


@dataclass(frozen=True, eq=False)
class Length(Found):
    """A certified length measured at one or several places."""

    runs: tuple[LengthRun, ...]
    # (N,), U (k = 2) including temperature and ball, mm.
    certified_uncertainties: FloatArray
    scale: Scale
    tip: TipEvidence

    @property
    def errors(self) -> FloatArray:
        """Measured less certified, of each place, mm."""
        return np.array([run.error for run in self.runs])

    @property
    def uncertainties(self) -> FloatArray:
        """U (k = 2) of each error, mm."""
        return np.array([run.uncertainty for run in self.runs])

    @property
    def worst(self) -> LengthRun:
        """The place with the largest error for its limit."""
        return max(self.runs, key=lambda run: run.share)


class LengthOptions(TaskOptions, frozen=True, tag="length"):
    """A length and its artefact."""

    length: Annotated[float, Meta(ge=0)] = 0.0  # at 20 degrees, mm; 0 if unknown
    length_uncertainty: Annotated[float, Meta(ge=0)] = 0.0
    surface: Surface = Surface.GROOVE
    n_places: Annotated[int, Meta(ge=1, le=MOST_RUNS)] = 1
    lengths: tuple[Annotated[float, Meta(gt=0)], ...] = ()  # of each, if different
    temperature: float = REFERENCE  # of the artefact, degrees Celsius
    temperature_uncertainty: Annotated[float, Meta(ge=0)] = 1.0  # U (k = 2), K
    expansion: Annotated[float, Meta(ge=0)] = 0.0  # thermal, ppm/K; 0 for none
    ball_uncertainty: Annotated[float, Meta(ge=0)] = BALL_UNCERTAINTY

    def certified(self, n_places: int) -> tuple[FloatArray, FloatArray]:
        """Return the certified lengths at their temperature and U (k = 2), (N,), mm."""
        lengths = np.array(self.lengths or [self.length] * n_places)
        per_kelvin = 1e-6 * self.expansion * lengths
        warmer = self.temperature - REFERENCE
        # Inner and outer faces are off by the radius of the ball at both ends.
        ball = self.ball_uncertainty * (self.surface is not Surface.GROOVE)
        known = np.hypot(self.length_uncertainty, ball)
        by_heat = per_kelvin * np.hypot(
            self.temperature_uncertainty, warmer * KNOWN_EXPANSION
        )
        return lengths + per_kelvin * warmer, np.hypot(known, by_heat)


def measure_length(
    runs: Runs, conditions: Conditions, options: LengthOptions
) -> Length:
    """Measure a length at one or several places.

    A run holds the points of both ends at one place. Inner faces lie farther out than
    the centre of the ball by its radius, outer ones less. Raises `CalibrationError` if
    the points of a place are not of two ends.
    """
    instrument, drift = conditions.instrument, conditions.drift
    certified, known = options.certified(len(runs))
    offset = ball_offset(options.surface, conditions.ball_diameter)
    measured, rows, noises, ways, by_points = [], [], [], [], []
    for (name, touches), length, u in zip(runs, certified, known, strict=True):
        ends = _on_faces(_two_ends(name, touches, length), offset)
        middles = [np.mean([t.point_cam for t in end], axis=0) for end in ends]
        span = middles[1] - middles[0]
        apart = float(np.linalg.norm(span))
        along = span / apart
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
                measured=apart,
                certified=float(length),
                uncertainty=float(np.hypot(COVERAGE_FACTOR * np.sqrt(variance), u)),
                limit=conditions.limits.length_error(float(length)),
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
    errors = np.array([run.error for run in measured])
    certificate = np.outer(known, known) / COVERAGE_FACTOR**2
    own = np.diag([float(along**2 @ drift**2) for along in ways]) + certificate
    tip = tip_evidence(
        [touch for run in measured for end in run.ends for touch in end],
        instrument,
        errors,
        block_diagonal(by_points),
        np.zeros((len(errors), 0)),
        own,
    )
    found = Length(
        runs=tuple(measured),
        certified_uncertainties=known,
        scale=_scale(instrument, np.array(rows), np.diag(noises) + certificate, errors),
        tip=tip,
        assessment=accepted(_good(max(measured, key=lambda run: run.share))),
    )
    return replace(found, assessment=_assessment(found, conditions.limits))


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


def _good(worst: LengthRun) -> Message:
    return message(
        "length.good",
        error=worst.error,
        uncertainty=worst.uncertainty,
        limit=worst.limit,
    )


def _assessment(found: Length, limits: VerificationLimits) -> VerificationAssessment:
    worst, against = found.worst, judged_tip(found.tip, limits)
    n_places = len(found.runs)
    figures = worst.error, worst.uncertainty, worst.limit
    reason = message(
        "length.off",
        run=worst.name,
        error=worst.error,
        uncertainty=worst.uncertainty,
        limit=worst.limit,
    )
    off = judged_error(*figures, limits, refused(reason, CHECK_FILES), n_places)
    finding = worse_finding(against, off)
    if finding is not None:
        return finding
    least = max(found.runs, key=lambda run: run.uncertainty / run.limit)
    if least.uncertainty > least.limit:
        return check(
            message(
                "length.uncertain",
                run=least.name,
                uncertainty=least.uncertainty,
                limit=least.limit,
            ),
            VERIFY_AGAIN,
        )
    return with_power(_good(worst), found.tip, limits)


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
    fault = message("session.no-ends", distance=distance, certified=certified)
    return Screening((1,), fault)


def _missing(options: LengthOptions, ball_diameter: float | None) -> Message | None:
    if not options.length:
        return message("verification.no-length")
    return missing_certificate(
        options.length_uncertainty, options.surface, ball_diameter
    )


def _entries(found: Length, instrument: Instrument) -> dict[str, Any]:
    return {
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
                "certified_length_mm": run.certified,
                "certified_expanded_uncertainty_mm": known,
                "error_mm": run.error,
                "expanded_uncertainty_mm": run.uncertainty,
                "limit_mm": run.limit,
                "along_view": run.along_view,
                "ends": [point_entries(end, instrument) for end in run.ends],
            }
            for run, known in zip(
                found.runs, found.certified_uncertainties.tolist(), strict=True
            )
        ],
    }


def _tables(found: Length, conditions: Conditions) -> tuple[ResultTable, ...]:
    scale, worst = found.scale, found.worst
    columns = (
        message("length.measured"),
        message("table.certified"),
        message("table.error"),
        message("table.uncertainty"),
        message("table.limit"),
    )
    rows = (
        ResultRow(
            run.name,
            [run.measured, run.certified, run.error, run.uncertainty, run.limit],
        )
        for run in found.runs
    )
    places = message(
        "length.places",
        share=100 * worst.share,
        run=worst.name,
        n_places=len(found.runs),
        needed=STANDARD_PLACES,
    )
    note = message(
        "length.scale",
        factor=scale.factor,
        uncertainty=1e6 * scale.uncertainty,
        before=1e6 * scale.uncertainty_before,
    )
    title = message("length.table")
    return (ResultTable(title, columns, tuple(rows), (places, note)),)


LENGTH = VerificationTask(
    kind="length",
    summary="a certified length",
    run_help="both ends of the length at one place",
    title=message("length.title"),
    purpose=message("length.purpose"),
    first=message("length.first"),
    another=message("length.another"),
    known=message("session.same-end"),
    limits=("length", "length_per_m", "tip"),
    options=LengthOptions,
    fields=(
        NumberOption(
            "length",
            message("length.certified"),
            unknown=message("option.unknown"),
            argument="--length",
            help="certified length at 20 degrees Celsius, one for all runs or for each",
            of_each_run="lengths",
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
        NumberOption(
            "temperature",
            message("length.temperature"),
            most=60.0,
            unit="\xb0C",
            decimals=1,
            argument="--temperature",
            help=f"temperature of the artefact ({REFERENCE:g})",
        ),
        NumberOption(
            "temperature_uncertainty",
            None,
            unit="K",
            argument="--temperature-uncertainty",
            help="U (k = 2) of the temperature (1)",
        ),
        NumberOption(
            "expansion",
            message("length.expansion"),
            most=100.0,
            unit="ppm/K",
            decimals=1,
            argument="--expansion",
            help="coefficient of thermal expansion of the artefact, such as 11.5 for "
            "steel (0: none)",
        ),
        BALL_OPTION,
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
