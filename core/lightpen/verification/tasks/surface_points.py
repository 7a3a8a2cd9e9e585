"""Common parts of the tasks that probe a ring or a length."""

from collections.abc import Sequence

import numpy as np

from lightpen.arrays import BoolArray, FloatArray
from lightpen.messages import Message, message
from lightpen.model.information import symmetric_root
from lightpen.verification.tasks.probed_point import ProbedPoint
from lightpen.verification.tasks.task import (
    Conditions,
    Points,
    Screening,
    Surface,
    TaskProgress,
    keep_all,
    without_last,
)

ASTRAY = 8.0  # times the median distance from the surface
LIFTED = 0.1  # mm; nearer points count, farther ones may be of a lifted pen
MAX_LEFT_OUT = 0.25  # of the points
IN_CONE = 5.0  # mm from the bottom of a cone that was probed before
N_TRIALS = 4000
UNUSUAL = 0.001  # chance that an ideal surface shows more form


def lie_near(distances: FloatArray) -> BoolArray:
    """Return which points lie on a surface, by their distances (N,), mm."""
    off = np.abs(distances)
    return np.asarray(off <= max(ASTRAY * float(np.median(off)), LIFTED))


def split_points(
    points: Sequence[ProbedPoint], are_near: BoolArray
) -> tuple[Points, Points]:
    """Part the points into those on a surface and those off it."""
    pairs = list(zip(points, are_near, strict=True))
    near = tuple(point for point, is_near in pairs if is_near)
    return near, tuple(point for point, is_near in pairs if not is_near)


def simulated_ranges(root: FloatArray, n_rows: int = 1) -> FloatArray:
    """Return ranges of normal residuals, the largest of some rows, (N_TRIALS,), mm.

    ``root`` (k, k) is the symmetric root of their covariance; the rows follow each
    other.
    """
    rng = np.random.default_rng(0)  # the same points give the same ranges
    off = rng.standard_normal((N_TRIALS, len(root))) @ root
    rows = off.reshape(N_TRIALS, n_rows, -1)
    return np.asarray(np.ptp(rows, axis=2).max(axis=1))


def form_by_noise(covariance: FloatArray, n_rows: int = 1) -> float:
    """Return the quantile of the form that noise gives an ideal surface, mm.

    ``covariance`` is the covariance of its residuals, mm^2; see `simulated_ranges`.
    """
    ranges = simulated_ranges(symmetric_root(covariance), n_rows)
    return float(np.quantile(ranges, 1 - UNUSUAL))


def away_from_cones(
    options: object, conditions: Conditions, progress: TaskProgress
) -> Screening:
    """Accept the last point unless it is in a cone that was probed before."""
    last, count = progress.points[-1].point_cam, len(progress.points)
    distances = (float(np.linalg.norm(last - cone)) for cone in progress.cones)
    if any(distance <= IN_CONE for distance in distances):
        return without_last(count, message("session.still-in-cone"))
    return keep_all(count)


def missing_certificate(
    uncertainty: float, surface: Surface, ball_diameter: float | None
) -> Message | None:
    """Return whether U of the certified value or the ball diameter is missing."""
    if not uncertainty:
        return message("verification.no-certificate-u")
    if surface is not Surface.GROOVE and not ball_diameter:
        return message("verification.no-ball")
    return None
