"""A circle through touches, against its certified radius: the paper's Table 3.

The points are projected on their best plane, and the circle there is that of least
squares of the distances from it. The error of the radius is then, to first order,

    dr = sum_i g_i . dX_i

where ``g_i`` lies in the plane along the radius to point i. So the covariance of the
points, with what they share, gives that of the radius.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lightpen.arrays import BoolArray, FloatArray
from lightpen.errors import CalibrationError
from lightpen.estimation.instrument import Instrument
from lightpen.estimation.uncertainty import COVERAGE_FACTOR
from lightpen.model.limits import VerificationLimits
from lightpen.sentences import sentence
from lightpen.verification.assessment import (
    CALIBRATE_AGAIN,
    CHECK_FILES,
    VERIFY_AGAIN,
    Conformity,
    accepted,
    check,
    refused,
)
from lightpen.verification.touch import NO_DRIFT, Touch

MIN_TOUCHES = 6
LEAST_POINTS = 3  # that tell a circle at all
EDGE_ON = 0.9  # of the normal along u
MIN_ANGLE = 270.0  # degrees
SMALLEST = 0.5  # mm, of what can be a circle at all
THIN = 0.02  # of the points' extent: less across is a line
MAX_FORM = 0.05  # of the radius: what is further off is no circle
MAX_LEFT_OUT = 0.25  # of the touches
ASTRAY = 8.0  # times the median distance from the circle
LIFTED = 0.1  # mm; nearer points count, farther ones may be of a lifted pen
N_SAMPLES = 500  # of three points each
CONVERGED = 1e-9  # mm
MAX_STEPS = 50
ANOTHER = 0.1  # of the certified radius: then it is another circle


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
    name : str
        Of the run.
    left_out : tuple of Touch
        Off the ring: the pen was lifted.
    radius : float
        Of the ring, the ball compensated, mm.
    uncertainty : float
        U (k = 2) of it, mm.
    """

    name: str
    touches: tuple[Touch, ...]
    left_out: tuple[Touch, ...]
    fit: CircleFit
    radius: float
    uncertainty: float


@dataclass(frozen=True, eq=False)
class Circle:
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
    assessment: Conformity

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


def measure_circle(
    runs: Sequence[tuple[str, Sequence[Touch]]],
    instrument: Instrument,
    certified: float,
    limits: VerificationLimits,
    *,
    certified_uncertainty: float = 0.0,
    ball_offset: float = 0.0,
    drift: FloatArray = NO_DRIFT,
) -> Circle:
    """Measure a ring in one or several runs.

    Parameters
    ----------
    runs : sequence of (str, sequence of Touch)
        Name and touches of each.
    certified : float
        Radius of the ring, mm.
    certified_uncertainty : float
        U (k = 2) of it, mm.
    ball_offset : float
        What is to be added to the radius of the circle of tip centres: the radius of
        the ball within a bore, minus that round a boss, mm.
    drift : (3,) array
        Standard uncertainty of a point by a camera that moved meanwhile, mm. A radius
        is off by as much where it moved halfway round.

    Raises
    ------
    CalibrationError
        Touches are too few, no circle, or cover too little of it.
    """
    measured, rows, noise = [], [], 0.0
    for name, touches in runs:
        run, row = _measure_run(name, touches, instrument, ball_offset, drift)
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
        np.hypot(COVERAGE_FACTOR * np.sqrt(variance), certified_uncertainty)
    )
    return Circle(
        runs=tuple(measured),
        certified=certified,
        uncertainty=uncertainty,
        assessment=_assessment(measured, certified, uncertainty, limits),
    )


def fit_circle(points_cam: FloatArray) -> CircleFit:
    """Fit a circle to points (N, 3), mm, that lie on one.

    Raises
    ------
    CalibrationError
        They lie in one place or on a line.
    """
    middle = points_cam.mean(axis=0)
    _, extents, axes = np.linalg.svd(points_cam - middle, full_matrices=False)
    if extents[0] / np.sqrt(len(points_cam)) < SMALLEST or (
        extents[1] < THIN * extents[0]
    ):
        raise CalibrationError(
            sentence(
                "circle.line",
                "The touches lie in one place or on a line, which is no circle. Touch "
                "the ring all round.",
            )
        )
    normal = axes[2] if axes[2][2] < 0 else -axes[2]
    across = _across(normal)
    up = np.cross(normal, across)
    plane = np.stack([across, up])
    flat = (points_cam - middle) @ plane.T
    # Kasa's algebraic circle starts the iteration.
    A = np.column_stack([2 * flat, np.ones(len(flat))])
    x, y, rest = np.linalg.lstsq(A, np.sum(flat**2, axis=1))[0].tolist()
    center, radius = np.array([x, y]), float(np.sqrt(rest + x * x + y * y))
    for _ in range(MAX_STEPS):
        spokes = flat - center
        lengths = np.maximum(np.linalg.norm(spokes, axis=1), SMALLEST)
        J = np.column_stack([spokes / lengths[:, None], np.ones(len(flat))])
        step = np.linalg.lstsq(J, lengths - radius)[0]
        center, radius = center + step[:2], radius + float(step[2])
        if np.abs(step).max() < CONVERGED:
            break
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


def ring_so_far(points_cam: FloatArray) -> CircleFit | None:
    """Return the circle that most of the points (N, 3), mm, lie on, by these alone.

    None before they tell one.
    """
    if len(points_cam) < LEAST_POINTS:
        return None
    try:
        return fit_circle(points_cam[_on_ring(points_cam)])
    except CalibrationError:
        return None


def residuals_of(fit: CircleFit, points_cam: Sequence[FloatArray]) -> FloatArray:
    """Return how far points are off a circle outwards and off its plane, (N, 2), mm."""
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
    touches: Sequence[Touch],
    instrument: Instrument,
    ball_offset: float,
    drift: FloatArray,
) -> tuple[CircleRun, FloatArray]:
    """Return a run, and the derivative of its radius by the instrument."""
    if len(touches) < MIN_TOUCHES:
        raise CalibrationError(
            sentence(
                "circle.too-few",
                "{run} has {n_touches} touches that can be used; a circle needs at "
                "least {needed}, 20 are usual. Touch the ring all round.",
                run=name,
                n_touches=len(touches),
                needed=MIN_TOUCHES,
            )
        )
    points = np.array([touch.point_cam for touch in touches])
    fit_circle(points)  # refuses what can be none
    on_ring = _on_ring(points)
    fit = fit_circle(points[on_ring])
    off = max(fit.roundness, fit.flatness)
    if np.mean(~on_ring) > MAX_LEFT_OUT or off > MAX_FORM * fit.radius:
        raise CalibrationError(
            sentence(
                "circle.none",
                "The touches of {run} lie on no circle: {n_off} of {n_touches} are off "
                "it, and the others by up to {off:.2f} mm. Touch one ring, in one "
                "plane.",
                run=name,
                n_off=int(np.sum(~on_ring)),
                n_touches=len(touches),
                off=off,
            )
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
    fit = fit_circle(points[near])
    spokes = points - fit.center_cam
    axial = spokes @ fit.normal_cam
    in_plane = np.linalg.norm(spokes - axial[:, None] * fit.normal_cam, axis=1)
    again = np.hypot(in_plane - fit.radius, axial)
    return np.asarray(again <= max(ASTRAY * float(np.median(again)), LIFTED))


def _gaps(angles: FloatArray) -> FloatArray:
    """Return the angle from each point to the next round the ring, in order, rad."""
    ordered = np.sort(angles)
    return np.diff(ordered, append=ordered[0] + 2 * np.pi)


def _require_closed(name: str, touches: Sequence[Touch], fit: CircleFit) -> None:
    if fit.covered >= MIN_ANGLE:
        return
    order = np.argsort(fit.angles)
    widest = int(np.argmax(_gaps(fit.angles)))
    raise CalibrationError(
        sentence(
            "circle.open",
            "The touches of {run} cover {covered:.0f} degrees of the ring, at least "
            "{needed:.0f} are needed: a radius from less is hardly worth anything. "
            "Touch the ring also in the gap between {first} and {second}.",
            run=name,
            covered=fit.covered,
            needed=MIN_ANGLE,
            first=touches[order[widest]].label,
            second=touches[order[(widest + 1) % len(order)]].label,
        )
    )


def _assessment(
    runs: Sequence[CircleRun],
    certified: float,
    uncertainty: float,
    limits: VerificationLimits,
) -> Conformity:
    mean = float(np.mean([run.radius for run in runs]))
    error = mean - certified
    if abs(error) > ANOTHER * certified:
        return refused(
            sentence(
                "circle.another",
                "The touches lie on a circle of radius {measured:.3f} mm, {certified} "
                "mm is certified. Is it this ring, and its radius rather than its "
                "diameter?",
                measured=mean,
                certified=certified,
            ),
            VERIFY_AGAIN,
        )
    if abs(error) > limits.radius:
        return refused(
            sentence(
                "circle.radius-off",
                "The radius is off by {error:+.4f} mm (U {uncertainty:.4f} mm, limit "
                "{limit:.4f} mm). Tip, LED file or camera file may be wrong, or the "
                "ball is not compensated.",
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
            sentence(
                "circle.form",
                "The touches of {run} lie up to {form:.4f} mm off a circle in a plane "
                "(limit {limit:.4f} mm): the tip slipped, the ring is dirty, or the "
                "tip is off.",
                run=worst.name,
                form=form,
                limit=limits.form,
            ),
            VERIFY_AGAIN,
        )
    lifted = [touch for run in runs for touch in run.left_out]
    if lifted:
        return check(
            sentence(
                "circle.lifted",
                "{n_left_out} touches lie off the ring and were left out, the first "
                "{first}: the pen was lifted there, or slipped.",
                n_left_out=len(lifted),
                first=lifted[0].label,
            ),
            VERIFY_AGAIN,
        )
    if uncertainty > limits.radius:
        return check(
            sentence(
                "circle.uncertain",
                "U (k = 2) of the radius is {uncertainty:.4f} mm, more than the limit "
                "of {limit:.4f} mm: this does not prove the tip.",
                uncertainty=uncertainty,
                limit=limits.radius,
            ),
            CHECK_FILES,
        )
    return accepted(
        sentence(
            "circle.good",
            "The radius is off by {error:+.4f} mm (U {uncertainty:.4f} mm, limit "
            "{limit:.4f} mm).",
            error=error,
            uncertainty=uncertainty,
            limit=limits.radius,
        )
    )
