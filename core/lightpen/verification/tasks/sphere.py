"""A reference sphere of certified diameter: probing size and form, as ISO 10360-12.

25 points on a hemisphere, as that standard spreads them, give the Gaussian sphere of
least squares. Size is its diameter, the ball compensated, less the certified one; form
is the range of the distances from it. The joint covariance of the points gives U of the
size, and the form that noise alone gives an ideal sphere.

References
----------
.. [1] ISO 10360-12:2016, probing size and form error P_Size.Sph.1x25 and
   P_Form.Sph.1x25 of articulated arm CMMs.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi
from typing import Annotated, Any, NamedTuple

import numpy as np
from msgspec import Meta

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.measuring.features import fit_feature
from lightpen.measuring.surfaces import FeatureKind
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
from lightpen.verification.tasks.probed_point import (
    ProbedPoint,
    joint_covariance,
    point_entries,
)
from lightpen.verification.tasks.surface_points import (
    MAX_LEFT_OUT,
    away_from_cones,
    form_by_noise,
    lie_near,
    missing_certificate,
    residuals_so_far,
    residuals_table,
    split_points,
)
from lightpen.verification.tasks.task import (
    ANY,
    BALL_OPTION,
    BALL_UNCERTAINTY,
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

MIN_POINTS, USUAL_POINTS, MAX_POINTS = 9, 25, 50
LEAST_POINTS = 5  # the least number with residuals
SPREAD = 0.15  # smallest extent of the points over their radius, or none is determined
MAX_FORM = 0.05  # of the radius; beyond, it is no sphere
ANOTHER = 0.1  # of the certified radius: then it is another sphere
NEW_PLACE = 3.0  # mm

# Points of the standard: their number at each angle from the pole, degrees.
RINGS = (1, 0.0), (4, 22.5), (8, 45.0), (4, 67.5), (8, 90.0)
# The sphere of the simulated operator, from the bottom of its cone, mm
SIMULATED_RADIUS = 15.0
SIMULATED_CENTER = np.array([0.0, -40.0, 0.0])
SIMULATED_AXES = np.array(
    [[1.0, 0.0, 0.0], [0.0, 0.9, -(0.19**0.5)], [0.0, -(0.19**0.5), -0.9]]
)  # right, towards the camera, up


class SphereFit(NamedTuple):
    """A sphere of least squares."""

    center_cam: FloatArray
    radius: float
    residuals: FloatArray  # (N,), distances from it, outwards, mm
    spokes: FloatArray  # (N, 3), unit vectors from the centre to the points

    @property
    def form(self) -> float:
        """Range of the residuals, mm."""
        return float(np.ptp(self.residuals))

    @property
    def by_sphere(self) -> FloatArray:
        """Derivative of the residuals by centre and radius, (N, 4)."""
        return np.column_stack([-self.spokes, -np.ones(len(self.spokes))])


class Size(NamedTuple):
    """A diameter, the ball compensated, and U (k = 2) with the certified one, mm."""

    measured: float
    certified: float
    uncertainty: float

    @property
    def error(self) -> float:
        """Measured less certified diameter, mm."""
        return self.measured - self.certified


@dataclass(frozen=True, eq=False)
class Sphere(Found):
    """A sphere."""

    points: tuple[ProbedPoint, ...]
    left_out: tuple[ProbedPoint, ...]  # off the sphere: the pen was lifted
    fit: SphereFit
    size: Size
    form_by_noise: float  # largest form that an ideal sphere shows, mm
    tip: TipEvidence


class SphereOptions(TaskOptions, frozen=True, tag="sphere"):
    """A sphere; a diameter of 0 is not known."""

    diameter: Annotated[float, Meta(ge=0)] = 0.0
    diameter_uncertainty: Annotated[float, Meta(ge=0)] = 0.0
    surface: Surface = Surface.GROOVE
    ball_uncertainty: Annotated[float, Meta(ge=0)] = BALL_UNCERTAINTY
    n_points: Annotated[int, Meta(ge=MIN_POINTS, le=MAX_POINTS)] = USUAL_POINTS


def measure_sphere(
    runs: Runs, conditions: Conditions, options: SphereOptions
) -> Sphere:
    """Measure size and form of a sphere by the points of all runs.

    Raises `CalibrationError` if they are too few, cover too little, or lie on no
    sphere.
    """
    points = [point for _, own in runs for point in own]
    places = np.array([point.point_cam for point in points]).reshape(-1, 3)
    if len(points) < MIN_POINTS:
        raise CalibrationError("sphere.too-few", n=len(points), needed=MIN_POINTS)
    fit = fit_sphere(places)
    near = lie_near(fit.residuals)
    fit = fit_sphere(places[near])
    if np.mean(~near) > MAX_LEFT_OUT or fit.form > MAX_FORM * fit.radius:
        n_off = int(np.sum(~near))
        raise CalibrationError("sphere.none", n_off=n_off, n=len(points), off=fit.form)
    kept, left_out = split_points(points, near)
    diameter = 2 * (fit.radius + ball_offset(options.surface, conditions.ball_diameter))
    known = options.diameter_uncertainty
    if options.surface is not Surface.GROOVE:
        known = float(np.hypot(known, options.ball_uncertainty))
    n = len(kept)
    covariance = joint_covariance(kept, conditions.instrument)
    covariance += np.diag(np.tile(conditions.drift**2, n))
    by_points = block_diagonal(list(fit.spokes[:, None]))
    spread = by_points @ covariance @ by_points.T
    row = np.linalg.pinv(-fit.by_sphere)[3]
    own = 2 * COVERAGE_FACTOR * float(np.sqrt(row @ spread @ row))
    tip = tip_evidence(
        kept,
        conditions.instrument,
        fit.residuals + (diameter - options.diameter) / 2,
        by_points,
        fit.by_sphere[:, :3],
        np.full((n, n), (known / 2 / COVERAGE_FACTOR) ** 2)  # of the diameter by U
        + by_points @ np.diag(np.tile(conditions.drift**2, n)) @ by_points.T,
    )
    size = Size(diameter, options.diameter, float(np.hypot(own, known)))
    unknowns, _ = np.linalg.qr(fit.by_sphere)
    keeps = np.eye(n) - unknowns @ unknowns.T
    by_noise = form_by_noise(keeps @ spread @ keeps)
    return Sphere(
        points=kept,
        left_out=left_out,
        fit=fit,
        size=size,
        form_by_noise=by_noise,
        tip=tip,
        assessment=_assessment(
            size, (fit.form, by_noise), left_out, tip, conditions.limits
        ),
    )


def fit_sphere(points_cam: FloatArray) -> SphereFit:
    """Fit a sphere to points (N, 3), mm, not in a plane."""
    try:
        found = fit_feature(FeatureKind.SPHERE, points_cam)
    except CalibrationError as error:
        raise CalibrationError("sphere.flat") from error
    radius, ways = found.size("radius"), points_cam - found.origin
    extents = np.linalg.svd(ways - ways.mean(axis=0), compute_uv=False)
    if extents[2] < SPREAD * radius:
        raise CalibrationError("sphere.flat")
    spokes = ways / np.linalg.norm(ways, axis=1)[:, None]
    return SphereFit(found.origin, radius, found.distances[:, 0], spokes)


def _assessment(
    size: Size,
    form: tuple[float, float],
    left_out: Sequence[ProbedPoint],
    tip: TipEvidence,
    limits: VerificationLimits,
) -> VerificationAssessment:
    """Judge size, tip and form; a diameter has twice the limit of a radius."""
    error, uncertainty, limit = size.error, size.uncertainty, 2 * limits.radius
    if abs(error) > ANOTHER * size.certified:
        another = message(
            "sphere.another", measured=size.measured, certified=size.certified
        )
        return refused(another, VERIFY_AGAIN)
    reason = message(
        "sphere.size-off", error=error, uncertainty=uncertainty, limit=limit
    )
    blamed = refused(reason, CALIBRATE_AGAIN)
    off = judged_error(error, uncertainty, limit, limits, blamed)
    against = judged_tip(tip, limits)
    finding = worse_finding(against, off)
    if finding is not None:
        return finding
    found, by_noise = form
    form_limit = max(limits.form, by_noise)
    if found > form_limit:
        return refused(
            message("sphere.form", form=found, limit=form_limit), VERIFY_AGAIN
        )
    if left_out:
        first = left_out[0].label
        lifted = message("sphere.lifted", n_left_out=len(left_out), first=first)
        return check(lifted, VERIFY_AGAIN)
    if uncertainty > limit:
        uncertain = message("sphere.uncertain", uncertainty=uncertainty, limit=limit)
        return check(uncertain, CHECK_FILES)
    good = message(
        "sphere.good", error=error, uncertainty=uncertainty, limit=limit, form=found
    )
    return with_power(good, tip, limits)


def _missing(options: SphereOptions, ball_diameter: float | None) -> Message | None:
    if not options.diameter:
        return message("sphere.no-diameter")
    return missing_certificate(
        options.diameter_uncertainty, options.surface, ball_diameter
    )


def _entries(found: Sphere, instrument: Instrument) -> dict[str, Any]:
    return {
        "certified_diameter_mm": found.size.certified,
        "diameter_mm": found.size.measured,
        "size_error_mm": found.size.error,
        "expanded_uncertainty_mm": found.size.uncertainty,
        "form_error_mm": found.fit.form,
        **tip_entries(found.tip),
        "center_cam_mm": found.fit.center_cam,
        "residuals_mm": found.fit.residuals,
        "touches": point_entries(found.points, instrument),
        "left_out": point_entries(found.left_out, instrument),
    }


def _tables(found: Sphere, conditions: Conditions) -> tuple[ResultTable, ...]:
    columns = (
        message("sphere.diameter"),
        message("table.error"),
        message("table.uncertainty"),
        message("sphere.form-error"),
        message("option.points"),
    )
    size = found.size
    values = [size.measured, size.error, size.uncertainty, found.fit.form]
    row = ResultRow(message("sphere.title"), [*values, float(len(found.points))])
    title = message("sphere.table", certified=size.certified)
    residuals = residuals_table(
        message("sphere.residuals"),
        message("circle.radial"),
        found.points,
        found.fit.residuals,
    )
    return ResultTable(title, columns, (row,)), residuals


def _figures_so_far(
    options: SphereOptions, progress: TaskProgress, conditions: Conditions
) -> tuple[ResultTable, ...]:
    return residuals_so_far(
        message("sphere.residuals"),
        message("circle.radial"),
        progress.points,
        lambda places: fit_sphere(places).residuals,
        LEAST_POINTS,
    )


def sphere_directions(n_points: int = USUAL_POINTS) -> FloatArray:
    """Return unit vectors of the points of the standard, pole first, repeated, (N, 3).

    Each ring is rotated against the previous one.
    """
    directions = []
    for k, (n, degrees) in enumerate(RINGS):
        tilt = np.radians(degrees)
        for i in range(n):
            turn = 2 * pi * (i + 0.5 * (k % 2)) / n
            flat = np.sin(tilt) * np.array([np.cos(turn), np.sin(turn)])
            directions.append([*flat, np.cos(tilt)])
    return np.array([directions[i % len(directions)] for i in range(n_points)])


def _hand(options: SphereOptions, run: int, step: int) -> HandGoal:
    spoke = sphere_directions(step + 1)[-1] @ SIMULATED_AXES
    return HandGoal(SIMULATED_CENTER + SIMULATED_RADIUS * spoke)


SPHERE = VerificationTask(
    kind="sphere",
    summary="a reference sphere: size and form by 25 points (ISO 10360-12)",
    run_help="points all over a hemisphere; several runs count as one",
    title=message("sphere.title"),
    purpose=message("sphere.purpose"),
    first=message("sphere.first"),
    another=message("task.next-point"),
    known=message("sphere.known"),
    limits=("radius", "form", "tip"),
    options=SphereOptions,
    fields=(
        NumberOption(
            "diameter",
            message("sphere.certified"),
            unknown=message("option.unknown"),
            argument="--diameter",
            help="certified diameter",
        ),
        certificate_option("diameter_uncertainty"),
        SurfaceOption(
            "surface",
            message("option.surface"),
            (
                message("sphere.centre"),
                message("sphere.inside"),
                message("circle.boss"),
            ),
            argument="--surface",
            words={"outside": Surface.BOSS, "inside": Surface.BORE},
            ball_help="ball diameter; without it, --diameter is that of the sphere of "
            "the ball centres",
        ),
        BALL_OPTION,
        count_option("n_points", message("option.points"), MIN_POINTS, MAX_POINTS),
    ),
    measure=measure_sphere,
    entries=_entries,
    tables=_tables,
    figures_so_far=_figures_so_far,
    hand=_hand,
    n_points=lambda options: options.n_points,
    instruction=lambda options, progress: message("sphere.instruction"),
    screen=away_from_cones,
    newness=lambda options: (ANY, NEW_PLACE),
    missing=_missing,
)
