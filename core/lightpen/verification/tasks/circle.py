"""A circle through touches, against its certified radius: the paper's Table 3.

The points are projected on their best plane, and the circle there is that of least
squares of the distances from it. The error of the radius is then, to first order,

    dr = sum_i g_i . dX_i

where ``g_i`` lies in the plane along the radius to point i. So the covariance of the
points, with what they share, gives that of the radius.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from math import pi
from typing import Annotated, Any

import numpy as np
from msgspec import Meta

from lightpen.arrays import BoolArray, FloatArray
from lightpen.errors import CalibrationError
from lightpen.estimation.uncertainty.budget import COVERAGE_FACTOR
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.messages import Message, message
from lightpen.model.limits import VerificationLimits
from lightpen.verification.tasks.assessment import (
    CALIBRATE_AGAIN,
    CHECK_FILES,
    VERIFY_AGAIN,
    VerificationAssessment,
    accepted,
    check,
    refused,
)
from lightpen.verification.tasks.probed_point import ProbedPoint, point_entries
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
    without_last,
)

MIN_TOUCHES = 6
LEAST_POINTS = 3  # that determine a circle
EDGE_ON = 0.9  # of the normal along u
MIN_ANGLE = 270.0  # degrees
SMALLEST = 0.5  # mm, of what can be a circle at all
THIN = 0.02  # of the points' extent: less across is a line
MAX_FORM = 0.05  # of the radius: what is further off is no circle
MAX_LEFT_OUT = 0.25  # of the touches
ASTRAY = 8.0  # times the median distance from the circle
LIFTED = 0.1  # mm; nearer points count, farther ones may be of a lifted pen
N_SAMPLES = 500  # of three points each
ROUNDING = 1e-14  # relative, of centre and radius
ANOTHER = 0.1  # of the certified radius: then it is another circle
ENOUGH_POINTS = 10  # for a session
NEW_PLACE = 3.0  # mm
IN_CONE = 5.0  # mm from the bottom of a cone that was probed before
LATEST = 6  # points whose residuals are shown beside the ring

# The ring of the simulated operator, from the bottom of its cone, mm
SIMULATED_RADIUS = 31.751
SIMULATED_CENTER = np.array([0.0, -40.0, 0.0])
SIMULATED_AXES = np.array([[1.0, 0.0, 0.0], [0.0, 0.9, -(0.19**0.5)]])
SIMULATED_STEPS = 12


@dataclass(frozen=True, eq=False)
class CircleFit:
    """A circle of least squares in its own plane.

    Attributes
    ----------
    center_cam, normal_cam : (3,) array
        mm; the normal points to the camera.
    radius : float
        mm.
    radial, axial : (N,) array
        Distances of the points from the circle in its plane, outwards, and from its
        plane, mm.
    angles : (N,) array
        Where the points lie on it, rad: from the right of the camera against the
        clock, as the camera sees them.
    weights : (N, 3) array
        Derivative of the radius by each point.
    """

    center_cam: FloatArray
    normal_cam: FloatArray
    radius: float
    radial: FloatArray
    axial: FloatArray
    angles: FloatArray
    weights: FloatArray

    @property
    def roundness(self) -> float:
        """Range of the radial distances, mm."""
        return float(np.ptp(self.radial))

    @property
    def flatness(self) -> float:
        """Range of the distances from the plane, mm."""
        return float(np.ptp(self.axial))

    @property
    def covered(self) -> float:
        """All of the ring but its largest gap between touches, degrees."""
        return 360.0 - float(np.degrees(_gaps(self.angles).max()))


@dataclass(frozen=True, eq=False)
class CircleRun:
    """One run round a ring.

    Attributes
    ----------
    left_out : tuple of ProbedPoint
        Off the ring: the pen was lifted.
    radius : float
        Of the ring, the ball compensated, mm.
    uncertainty : float
        U (k = 2) of it, mm.
    """

    name: str
    touches: tuple[ProbedPoint, ...]
    left_out: tuple[ProbedPoint, ...]
    fit: CircleFit
    radius: float
    uncertainty: float


@dataclass(frozen=True, eq=False)
class Circle(Found):
    """Runs round a ring of certified radius.

    Attributes
    ----------
    certified : float
        mm.
    uncertainty : float
        U (k = 2) of the mean radius and the certified one together, mm.
    """

    runs: tuple[CircleRun, ...]
    certified: float
    uncertainty: float

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
    n_runs: Annotated[int, Meta(ge=1, le=MOST_RUNS)] = 1


def measure_circle(
    runs: Runs, conditions: Conditions, options: CircleOptions
) -> Circle:
    """Measure a ring in one or several runs.

    The radius within a bore is larger than that of the tip centres by that of the ball,
    and round a boss smaller. It is off by as much as the camera moves halfway round.

    Raises
    ------
    CalibrationError
        Points are too few, no circle, or cover too little of it.
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
        np.hypot(COVERAGE_FACTOR * np.sqrt(variance), options.radius_uncertainty)
    )
    return Circle(
        runs=tuple(measured),
        certified=certified,
        uncertainty=uncertainty,
        assessment=_assessment(measured, certified, uncertainty, conditions.limits),
    )


def fit_circle(points_cam: FloatArray) -> CircleFit:
    """Fit a circle to points (N, 3), mm, that lie on one.

    Raises
    ------
    CalibrationError
        They lie in one place or on a line.
    """
    from scipy.optimize import least_squares  # takes 0.3 s

    middle = points_cam.mean(axis=0)
    _, extents, axes = np.linalg.svd(points_cam - middle, full_matrices=False)
    if extents[0] / np.sqrt(len(points_cam)) < SMALLEST or (
        extents[1] < THIN * extents[0]
    ):
        raise CalibrationError("circle.line")
    normal = axes[2] if axes[2][2] < 0 else -axes[2]
    across = _across(normal)
    up = np.cross(normal, across)
    plane = np.stack([across, up])
    flat = (points_cam - middle) @ plane.T
    # Kasa's algebraic circle starts the iteration.
    A = np.column_stack([2 * flat, np.ones(len(flat))])
    x, y, rest = np.linalg.lstsq(A, np.sum(flat**2, axis=1))[0].tolist()
    start = [x, y, np.sqrt(rest + x * x + y * y)]
    found = least_squares(partial(_off_circle, flat), start, method="lm", xtol=ROUNDING)
    center, radius = found.x[:2], float(found.x[2])
    spokes = flat - center
    outwards = spokes / np.linalg.norm(spokes, axis=1)[:, None]
    J = np.column_stack([outwards, np.ones(len(flat))])
    return CircleFit(
        center_cam=middle + center @ plane,
        normal_cam=normal,
        radius=radius,
        radial=np.linalg.norm(spokes, axis=1) - radius,
        axial=(points_cam - middle) @ normal,
        angles=np.arctan2(spokes[:, 1], spokes[:, 0]),
        weights=np.linalg.pinv(J)[2][:, None] * (outwards @ plane),
    )


def _off_circle(points: FloatArray, circle: FloatArray) -> FloatArray:
    """Return the distances of points (N, 2) from a circle (x, y, radius), (N,)."""
    return np.asarray(np.linalg.norm(points - circle[:2], axis=1) - circle[2])


def ring_so_far(points_cam: FloatArray) -> CircleFit | None:
    """Return the circle that most of the points (N, 3), mm, lie on, by these alone.

    None before they determine one.
    """
    if len(points_cam) < LEAST_POINTS:
        return None
    try:
        return fit_circle(points_cam[_on_ring(points_cam)])
    except CalibrationError:
        return None


def residuals_of(
    fit: CircleFit, points_cam: FloatArray | Sequence[FloatArray]
) -> FloatArray:
    """Return radial and out-of-plane deviations of points, (N, 2), mm."""
    ways = np.reshape(points_cam, (-1, 3)) - fit.center_cam
    axial = ways @ fit.normal_cam
    spokes = ways - axial[:, None] * fit.normal_cam
    return np.column_stack([np.linalg.norm(spokes, axis=1) - fit.radius, axial])


def _across(normal: FloatArray) -> FloatArray:
    """Return the unit vector in a plane nearest to u, or to v where u sticks out."""
    axis = np.array([0.0, 1.0, 0.0] if abs(normal[0]) > EDGE_ON else [1.0, 0.0, 0.0])
    across = axis - (axis @ normal) * normal
    return np.asarray(across / np.linalg.norm(across))


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
    fit_circle(points)  # refuses what can be none
    on_ring = _on_ring(points)
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
    kept = tuple(t for t, on in zip(touches, on_ring, strict=True) if on)
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
        left_out=tuple(t for t, on in zip(touches, on_ring, strict=True) if not on),
        fit=fit,
        radius=fit.radius + ball_offset,
        uncertainty=COVERAGE_FACTOR * float(np.hypot(np.sqrt(variance), drift.max())),
    )
    return run, row


def _on_ring(points: FloatArray) -> BoolArray:
    """Return which points (N, 3) lie on the circle that most of them lie on."""
    rng = np.random.default_rng(0)  # the same points give the same circle
    members = np.argsort(rng.random((N_SAMPLES, len(points))), axis=1)[:, :3]
    a, b, c = (points[members[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    doubled = np.sum(normals**2, axis=1)
    with np.errstate(all="ignore"):  # three points on a line make no circle
        to_center = (
            np.cross(normals, b - a) * np.sum((c - a) ** 2, axis=1)[:, None]
            + np.cross(c - a, normals) * np.sum((b - a) ** 2, axis=1)[:, None]
        ) / (2 * doubled[:, None])
        radii = np.linalg.norm(to_center, axis=1)
        normals = normals / np.sqrt(doubled)[:, None]
        spokes = points[None] - (a + to_center)[:, None]
        axial = np.einsum("sni,si->sn", spokes, normals)
        in_plane = np.sqrt(np.maximum(np.sum(spokes**2, axis=2) - axial**2, 0))
        distances = np.hypot(in_plane - radii[:, None], axial)
    medians = np.nan_to_num(np.median(distances, axis=1), nan=np.inf)
    best = distances[int(np.argmin(medians))]
    near = best <= max(ASTRAY * float(np.median(best)), LIFTED)
    again = np.linalg.norm(residuals_of(fit_circle(points[near]), points), axis=1)
    return np.asarray(again <= max(ASTRAY * float(np.median(again)), LIFTED))


def _gaps(angles: FloatArray) -> FloatArray:
    """Return the angle from each point to the next round the ring, in order, rad."""
    ordered = np.sort(angles)
    return np.diff(ordered, append=ordered[0] + 2 * np.pi)


def _require_closed(name: str, touches: Sequence[ProbedPoint], fit: CircleFit) -> None:
    if fit.covered >= MIN_ANGLE:
        return
    order = np.argsort(fit.angles)
    widest = int(np.argmax(_gaps(fit.angles)))
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
    limits: VerificationLimits,
) -> VerificationAssessment:
    mean = float(np.mean([run.radius for run in runs]))
    error = mean - certified
    if abs(error) > ANOTHER * certified:
        return refused(
            message("circle.another", measured=mean, certified=certified), VERIFY_AGAIN
        )
    if abs(error) > limits.radius:
        return refused(
            message(
                "circle.radius-off",
                error=error,
                uncertainty=uncertainty,
                limit=limits.radius,
            ),
            CALIBRATE_AGAIN,
        )
    worst = max(runs, key=lambda run: max(run.fit.roundness, run.fit.flatness))
    form = max(worst.fit.roundness, worst.fit.flatness)
    if form > limits.form:
        return refused(
            message("circle.form", run=worst.name, form=form, limit=limits.form),
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
    return accepted(
        message(
            "circle.good", error=error, uncertainty=uncertainty, limit=limits.radius
        )
    )


def ring_fit(points: Sequence[ProbedPoint]) -> CircleFit | None:
    """Return the circle that points lie on so far; None before they determine one."""
    return ring_so_far(np.array([point.point_cam for point in points]).reshape(-1, 3))


def covered(points: Sequence[ProbedPoint]) -> float:
    """Return the covered angle of a ring, degrees; 0 at first."""
    fit = ring_fit(points)
    return 0.0 if fit is None else fit.covered


def away_from_cones(progress: TaskProgress) -> Screening:
    """Return that the last point counts unless it is in a cone that is done."""
    last, count = progress.points[-1].point_cam, len(progress.points)
    distances = (float(np.linalg.norm(last - cone)) for cone in progress.cones)
    if any(distance <= IN_CONE for distance in distances):
        return without_last(count, message("session.still-in-cone"))
    return keep_all(count)


def _screen(
    options: CircleOptions, conditions: Conditions, progress: TaskProgress
) -> Screening:
    return away_from_cones(progress)


def _missing(options: CircleOptions, ball_diameter: float | None) -> Message | None:
    if not options.radius:
        return message("verification.no-radius")
    if not options.radius_uncertainty:
        return message("verification.no-certificate-u")
    if options.surface is not Surface.GROOVE and not ball_diameter:
        return message("verification.no-ball")
    return None


def _entries(found: Circle, instrument: Instrument) -> dict[str, Any]:
    errors = found.errors
    return {
        "certified_radius_mm": found.certified,
        "mean_radius_mm": found.radii.mean(),
        "mean_error_mm": errors.mean(),
        "mean_relative_error": errors.mean() / found.certified,
        "std_mm": found.deviation,
        "expanded_uncertainty_mm": found.uncertainty,
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
    progress: TaskProgress, conditions: Conditions
) -> tuple[ResultTable, ...]:
    """Return the residuals of the last points from the ring so far."""
    points, fit = progress.points, ring_fit(progress.points)
    title = message("circle.residuals")
    if fit is None:
        return (ResultTable(title),)
    rows = tuple(
        ResultRow(str(i), off.tolist())
        for i, off in enumerate(residuals_of(fit, [p.point_cam for p in points]), 1)
    )
    columns = message("circle.radial"), message("circle.axial")
    return (ResultTable(title, columns, rows[-LATEST:]),)


def _fraction(options: CircleOptions, progress: TaskProgress) -> float:
    points = progress.points
    return min(covered(points) / MIN_ANGLE, len(points) / ENOUGH_POINTS, 1.0)


def _count(options: CircleOptions, progress: TaskProgress) -> Message:
    return message("circle.count", covered=covered(progress.points), needed=MIN_ANGLE)


def _instruction(options: CircleOptions, progress: TaskProgress) -> Message:
    return message(
        "session.touch-ring",
        covered=covered(progress.points),
        needed=MIN_ANGLE,
        n_touches=len(progress.points),
    )


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
    limits=("radius", "form"),
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
            ball_help="of the probe, where it touched a bore or a boss and not a "
            "groove",
        ),
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
    screen=_screen,
    newness=lambda options: (ANY, NEW_PLACE),
    missing=_missing,
)
