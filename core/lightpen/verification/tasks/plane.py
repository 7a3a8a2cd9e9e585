"""A plate of known flatness: the range of probed points about their best plane.

The plane minimises the squared distances along its normal. The distances ``d`` follow
errors ``e`` of the points along the normal by ``(I - H) e``, where ``H`` projects on
the planes over the places of the points, and flatness is the range of ``d``. A range
obeys the triangle inequality, so that for a plate of any form

    | range(d + r) - range(d) | <= range(r),    r = (I - H) e

and U is the quantile of ``range(r)`` that the covariance of all points gives, what they
share included. It is exact for an ideal plate, where the noise alone makes a range, and
on the safe side for one that is not flat. The ball moves all points alike and needs no
compensation.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi
from typing import Annotated, Any

import numpy as np
from msgspec import Meta

from lightpen.arrays import BoolArray, FloatArray
from lightpen.errors import CalibrationError
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.messages import message
from lightpen.model.decision_rules import Decision
from lightpen.model.expanded_uncertainty import COVERAGE
from lightpen.model.information import symmetric_root
from lightpen.model.limits import VerificationLimits
from lightpen.verification.tasks.assessment import (
    CALIBRATE_AGAIN,
    MORE_POINTS,
    VERIFY_AGAIN,
    VerificationAssessment,
    check,
    refused,
)
from lightpen.verification.tasks.probed_point import (
    ProbedPoint,
    joint_covariance,
    point_entries,
)
from lightpen.verification.tasks.surface_points import (
    MAX_LEFT_OUT,
    UNUSUAL,
    away_from_cones,
    lie_near,
    residuals_so_far,
    residuals_table,
    simulated_ranges,
    split_points,
)
from lightpen.verification.tasks.task import (
    ANY,
    LARGEST_U,
    Conditions,
    Found,
    HandGoal,
    NumberOption,
    ResultRow,
    ResultTable,
    Runs,
    TaskOptions,
    TaskProgress,
    VerificationTask,
    count_option,
)
from lightpen.verification.tasks.tip_evidence import (
    TipEvidence,
    block_diagonal,
    judged_tip,
    tip_entries,
    tip_evidence,
    with_power,
)

MIN_POINTS, USUAL_POINTS, MAX_POINTS = 9, 12, 50
LEAST_POINTS = 4  # the least number with residuals
SMALLEST = 5.0  # mm, root mean square distance of the points from their middle
THIN = 0.2  # of the extent along: less across is a line
NEW_PLACE = 5.0  # mm
MAX_FORM = 0.1  # of the extent; beyond, it is no plate
N_SAMPLES = 500  # of three points each

# The plate of the simulated operator, from the bottom of its cone, mm
SIMULATED_CENTER = np.array([0.0, -40.0, 0.0])
SIMULATED_AXES = np.array([[1.0, 0.0, 0.0], [0.0, 0.9, -(0.19**0.5)]])
SIMULATED_RADII = 15.0, 30.0


@dataclass(frozen=True, eq=False)
class PlaneFit:
    """A plane of least squares."""

    center_cam: FloatArray  # (3,), middle of the points, mm
    normal_cam: FloatArray  # (3,), unit normal, towards the camera
    extent: float  # root mean square distance of the points from their middle, mm
    residuals: FloatArray  # (N,), distances of the points along the normal, mm
    weights: FloatArray  # (N, N), derivative of residuals by moves of the points

    @property
    def flatness(self) -> float:
        """Range of the residuals, mm."""
        return float(np.ptp(self.residuals))


@dataclass(frozen=True, eq=False)
class Flatness(Found):
    """A plate."""

    points: tuple[ProbedPoint, ...]
    left_out: tuple[ProbedPoint, ...]  # off the plane: the pen was lifted
    fit: PlaneFit
    certified: float  # mm
    uncertainty: float  # U (k = 2) of the measured flatness, mm
    tip: TipEvidence

    @property
    def error(self) -> float:
        """Measured less certified flatness, mm."""
        return self.fit.flatness - self.certified


class PlaneOptions(TaskOptions, frozen=True, tag="plane"):
    """A plate; a flatness of 0 is an ideal one."""

    flatness: Annotated[float, Meta(ge=0)] = 0.0
    n_points: Annotated[int, Meta(ge=MIN_POINTS, le=MAX_POINTS)] = USUAL_POINTS


def measure_plane(
    runs: Runs, conditions: Conditions, options: PlaneOptions
) -> Flatness:
    """Measure the flatness of a plate by the points of all runs.

    Raises `CalibrationError` if they are too few, lie on a line, or on no plane.
    """
    points = [point for _, own in runs for point in own]
    places = np.array([point.point_cam for point in points]).reshape(-1, 3)
    if len(points) < MIN_POINTS:
        raise CalibrationError("plane.too-few", n_points=len(points), needed=MIN_POINTS)
    fit_plane(places)  # raises if they determine none
    near = _on_plane(places)
    fit = fit_plane(places[near])
    is_rough = fit.flatness > MAX_FORM * fit.extent
    if np.mean(~near) > MAX_LEFT_OUT or near.sum() < MIN_POINTS or is_rough:
        raise CalibrationError(
            "plane.none",
            n_off=int(np.sum(~near)),
            n_points=len(points),
            off=fit.flatness,
        )
    kept, left_out = split_points(points, near)
    uncertainty, largest = _flatness_by_noise(fit, kept, conditions)
    tip = _tip_evidence(fit, kept, conditions)
    return Flatness(
        points=kept,
        left_out=left_out,
        fit=fit,
        certified=options.flatness,
        uncertainty=uncertainty,
        tip=tip,
        assessment=_assessment(
            fit,
            left_out,
            options.flatness,
            (uncertainty, largest),
            tip,
            conditions.limits,
        ),
    )


def fit_plane(points_cam: FloatArray) -> PlaneFit:
    """Fit a plane to points (N, 3), mm, not in one place nor on a line."""
    center = points_cam.mean(axis=0)
    _, extents, axes = np.linalg.svd(points_cam - center, full_matrices=False)
    if extents[0] / np.sqrt(len(points_cam)) < SMALLEST or (
        extents[1] < THIN * extents[0]
    ):
        raise CalibrationError("plane.line")
    normal = axes[2] if axes[2][2] < 0 else -axes[2]
    across = (points_cam - center) @ axes[:2].T / extents[:2]
    hat = across @ across.T + 1 / len(points_cam)
    return PlaneFit(
        center_cam=center,
        normal_cam=normal,
        extent=float(np.linalg.norm(extents)) / np.sqrt(len(points_cam)),
        residuals=(points_cam - center) @ normal,
        weights=np.eye(len(points_cam)) - hat,
    )


def _on_plane(places: FloatArray) -> BoolArray:
    """Return the mask of the points (N, 3) on the plane through most of them."""
    rng = np.random.default_rng(0)  # the same points give the same plane
    members = np.argsort(rng.random((N_SAMPLES, len(places))), axis=1)[:, :3]
    a, b, c = (places[members[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    lengths = np.linalg.norm(normals, axis=1)
    spans = np.linalg.norm(places - places.mean(axis=0), axis=1).max()
    wide = lengths > THIN * spans**2  # others turn by the noise of their points
    normals = normals[wide] / lengths[wide, None]
    distances = np.abs(np.einsum("sni,si->sn", places - a[wide, None], normals))
    best = distances[int(np.argmin(np.median(distances, axis=1)))]
    fit = fit_plane(places[lie_near(best)])
    return lie_near((places - fit.center_cam) @ fit.normal_cam)


def _tip_evidence(
    fit: PlaneFit, points: Sequence[ProbedPoint], conditions: Conditions
) -> TipEvidence:
    along = np.array([point.point_cam for point in points]) - fit.center_cam
    across = along - np.outer(along @ fit.normal_cam, fit.normal_cam)
    axes = np.linalg.svd(across, full_matrices=False)[2][:2]
    drift = float(fit.normal_cam**2 @ conditions.drift**2)
    return tip_evidence(
        points,
        conditions.instrument,
        fit.residuals,
        block_diagonal([fit.normal_cam[None]] * len(points)),
        np.column_stack([np.ones(len(points)), across @ axes.T]),
        drift * np.eye(len(points)),
    )


def _flatness_by_noise(
    fit: PlaneFit, points: Sequence[ProbedPoint], conditions: Conditions
) -> tuple[float, float]:
    """Return U and the largest usual range that errors of the points make, mm."""
    n = len(points)
    blocks = joint_covariance(points, conditions.instrument).reshape(n, 3, n, 3)
    along = np.einsum("i,minj,j->mn", fit.normal_cam, blocks, fit.normal_cam)
    along += float(fit.normal_cam**2 @ conditions.drift**2) * np.eye(n)
    root = symmetric_root(fit.weights @ along @ fit.weights)
    usual, largest = np.quantile(
        simulated_ranges(root), [COVERAGE, 1 - UNUSUAL]
    ).tolist()
    return usual, largest


def _assessment(
    fit: PlaneFit,
    left_out: Sequence[ProbedPoint],
    certified: float,
    by_noise: tuple[float, float],
    tip: TipEvidence,
    limits: VerificationLimits,
) -> VerificationAssessment:
    flatness, limit = fit.flatness, limits.form
    error, (uncertainty, largest) = flatness - certified, by_noise
    against = judged_tip(tip, limits)
    if against is not None:
        return against
    off = message(
        "plane.off",
        flatness=flatness,
        uncertainty=uncertainty,
        certified=certified,
        limit=limit,
    )
    if error > max(limit, largest):
        return refused(off, CALIBRATE_AGAIN)
    if left_out:
        first = left_out[0].label
        lifted = message("plane.lifted", n_left_out=len(left_out), first=first)
        return check(lifted, VERIFY_AGAIN)
    if uncertainty > limit:
        uncertain = message("plane.uncertain", uncertainty=uncertainty, limit=limit)
        return check(uncertain, MORE_POINTS)
    if limits.decision(error, uncertainty, limit) is not Decision.ACCEPTED:
        return check(off, MORE_POINTS)
    good = message(
        "plane.good",
        flatness=flatness,
        uncertainty=uncertainty,
        certified=certified,
        limit=limit,
    )
    return with_power(good, tip, limits)


def _entries(found: Flatness, instrument: Instrument) -> dict[str, Any]:
    return {
        "flatness_mm": found.fit.flatness,
        "expanded_uncertainty_mm": found.uncertainty,
        "certified_flatness_mm": found.certified,
        "error_mm": found.error,
        **tip_entries(found.tip),
        "center_cam_mm": found.fit.center_cam,
        "normal_cam": found.fit.normal_cam,
        "residuals_mm": found.fit.residuals,
        "touches": point_entries(found.points, instrument),
        "left_out": point_entries(found.left_out, instrument),
    }


def _tables(found: Flatness, conditions: Conditions) -> tuple[ResultTable, ...]:
    columns = (
        message("plane.flatness"),
        message("table.uncertainty"),
        message("plane.certified"),
        message("table.error"),
        message("table.limit"),
    )
    values = [
        found.fit.flatness,
        found.uncertainty,
        found.certified,
        found.error,
        conditions.limits.form,
    ]
    summary = ResultTable(
        message("plane.table"), columns, (ResultRow(message("plane.title"), values),)
    )
    residuals = residuals_table(
        message("plane.residuals"),
        message("plane.residual"),
        found.points,
        found.fit.residuals,
    )
    return summary, residuals


def _figures_so_far(
    options: PlaneOptions, progress: TaskProgress, conditions: Conditions
) -> tuple[ResultTable, ...]:
    return residuals_so_far(
        message("plane.residuals"),
        message("plane.residual"),
        progress.points,
        lambda places: fit_plane(places).residuals,
        LEAST_POINTS,
    )


def _hand(options: PlaneOptions, run: int, step: int) -> HandGoal:
    angle = 2 * pi * step / options.n_points
    spoke = np.array([np.cos(angle), np.sin(angle)]) @ SIMULATED_AXES
    return HandGoal(SIMULATED_CENTER + SIMULATED_RADII[step % 2] * spoke)


PLANE = VerificationTask(
    kind="plane",
    summary="a flat plate",
    run_help="points all over the plate; several runs count as one",
    title=message("plane.title"),
    purpose=message("plane.purpose"),
    first=message("plane.first"),
    another=message("task.next-point"),
    known=message("plane.known"),
    limits=("form", "tip"),
    options=PlaneOptions,
    fields=(
        NumberOption(
            "flatness",
            message("plane.certified-flatness"),
            most=LARGEST_U,
            argument="--certified-flatness",
            help="certified flatness of the plate (0)",
        ),
        count_option("n_points", message("option.points"), MIN_POINTS, MAX_POINTS),
    ),
    measure=measure_plane,
    entries=_entries,
    tables=_tables,
    figures_so_far=_figures_so_far,
    hand=_hand,
    n_points=lambda options: options.n_points,
    instruction=lambda options, progress: message("plane.instruction"),
    screen=away_from_cones,
    newness=lambda options: (ANY, NEW_PLACE),
)
