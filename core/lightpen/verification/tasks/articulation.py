"""One point in several postures, in the form of the articulated location error [1]_.

The point is touched five times in each of five postures. The mean of each posture is
one location; the location error is the diameter of the smallest sphere about them.

References
----------
.. [1] ISO 10360-12:2016, "Articulated arm coordinate measurement machines", articulated
   location error. The standard takes spheres measured by points; here a cone seats the
   tip, so that the error is one in its form only.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from math import pi
from typing import Any

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.messages import Message, message
from lightpen.model.coverage import posture_spread
from lightpen.model.limits import VerificationLimits
from lightpen.model.posture import angles_between
from lightpen.verification.tasks.assessment import (
    CALIBRATE_AGAIN,
    VerificationAssessment,
    accepted,
    refused,
)
from lightpen.verification.tasks.fixed_point import (
    LIFTED,
    MIN_SPREAD,
    NEW_POSTURE,
    scatter_of,
    without_others,
)
from lightpen.verification.tasks.probed_point import (
    ProbedPoint,
    joint_covariance,
    mean_point,
)
from lightpen.verification.tasks.task import (
    Conditions,
    Found,
    HandGoal,
    ResultRow,
    ResultTable,
    Runs,
    Screening,
    TaskOptions,
    TaskProgress,
    VerificationTask,
    keep_all,
    without_last,
)

N_POSTURES, N_TOUCHES = 5, 5
ASTRAY = 8.0  # times the median distance from the middle of all
SLACK = 1 + 1e-9  # of a sphere, for points that lie on it
SAME_POSTURE = float(np.radians(12.0))  # within which a pen is held alike
SIMULATED_TILT = 0.4  # rad
ALIKE = message("session.alike")
OTHER_POSTURE = message("session.other-posture")


@dataclass(frozen=True, eq=False)
class Articulation(Found):
    """The location error of one point in several postures.

    Attributes
    ----------
    locations : (N, 3) array
        Mean of each posture, camera frame, mm.
    spreads : (N,) array
        Largest distance of a touch from the mean of its posture, mm.
    location_error : float
        Diameter of the smallest sphere about the locations, mm.
    expected : float
        The same by what is known of the touches: mean of simulated ones, mm.
    """

    names: tuple[str, ...]
    locations: FloatArray
    spreads: FloatArray
    location_error: float
    expected: float


class ArticulationOptions(TaskOptions, frozen=True, tag="articulation"):
    """There is nothing to choose."""


def measure_articulation(
    runs: Runs, conditions: Conditions, options: ArticulationOptions | None = None
) -> Articulation:
    """Measure the location error of a point.

    A run is a posture; a single run holds five, one after the other.

    Raises
    ------
    CalibrationError
        There are fewer than five postures of five points, the postures are alike, or a
        point is of another place.
    """
    postures = by_posture(runs)
    _require_enough(postures)
    points = np.array([t.point_cam for _, touches in postures for t in touches])
    _require_one_point(points, [t for _, touches in postures for t in touches])
    rotations = np.array([touches[0].rotation for _, touches in postures])
    spread = float(posture_spread(rotations)[0][-1])
    if spread < MIN_SPREAD:
        raise CalibrationError(
            "articulation.alike",
            found=float(np.degrees(spread)),
            needed=float(np.degrees(MIN_SPREAD)),
        )
    own = [np.array([t.point_cam for t in touches]) for _, touches in postures]
    locations = np.array([each.mean(axis=0) for each in own])
    error = smallest_diameter(locations)
    return Articulation(
        names=tuple(name for name, _ in postures),
        locations=locations,
        spreads=np.array(
            [
                np.linalg.norm(each - middle, axis=1).max()
                for each, middle in zip(own, locations, strict=True)
            ]
        ),
        location_error=error,
        expected=_expected(postures, conditions.instrument),
        assessment=_assessment(error, conditions.limits),
    )


def by_posture(
    runs: Sequence[tuple[str, Sequence[ProbedPoint]]],
) -> list[tuple[str, Sequence[ProbedPoint]]]:
    """Return runs of a posture each; a single one holds five, one after the other."""
    if len(runs) != 1:
        return list(runs)
    (_, touches), n = runs[0], N_TOUCHES
    n_postures = max(len(touches) // n, N_POSTURES)
    return [(f"posture {i + 1}", touches[n * i : n * i + n]) for i in range(n_postures)]


def smallest_diameter(points: FloatArray) -> float:
    """Return the diameter of the smallest sphere about a few points (N, 3), mm."""
    best = np.inf
    for size in (2, 3, 4):
        for chosen in combinations(range(len(points)), size):
            center, radius = _sphere_through(points[list(chosen)])
            distances = np.linalg.norm(points - center, axis=1)
            if distances.max() <= radius * SLACK + 1e-12:
                best = min(best, radius)
        if np.isfinite(best):
            break
    return 2 * float(best)


def _sphere_through(points: FloatArray) -> tuple[FloatArray, float]:
    """Return the smallest sphere with two to four points (k, 3) on it."""
    base, others = points[0], points[1:] - points[0]
    half = 0.5 * np.sum(others**2, axis=1)
    # The centre lies in the span of the points.
    to_center = np.linalg.lstsq(others, half)[0]
    return base + to_center, float(np.linalg.norm(to_center))


def _require_enough(postures: Sequence[tuple[str, Sequence[ProbedPoint]]]) -> None:
    for name, touches in postures:
        if len(touches) < N_TOUCHES:
            raise CalibrationError(
                "articulation.few-touches",
                posture=name,
                n_touches=len(touches),
                needed=N_TOUCHES,
            )
    if len(postures) < N_POSTURES:
        raise CalibrationError(
            "articulation.few-postures", n_postures=len(postures), needed=N_POSTURES
        )


def _require_one_point(points: FloatArray, touches: Sequence[ProbedPoint]) -> None:
    distances = np.linalg.norm(points - np.median(points, axis=0), axis=1)
    worst = int(np.argmax(distances))
    if distances[worst] > max(ASTRAY * float(np.median(distances)), LIFTED):
        raise CalibrationError(
            "articulation.elsewhere",
            touch=touches[worst].label,
            distance=float(distances[worst]),
        )


def _expected(
    postures: Sequence[tuple[str, Sequence[ProbedPoint]]], instrument: Instrument
) -> float:
    """Return the mean location error of points that scatter as is known of them."""
    rng = np.random.default_rng(0)
    means = [mean_point(touches) for _, touches in postures]
    covariance = joint_covariance(means, instrument)
    values, vectors = np.linalg.eigh(covariance)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    draws = (rng.standard_normal((100, len(root))) @ root.T).reshape(100, -1, 3)
    return float(np.mean([smallest_diameter(each) for each in draws]))


def _assessment(error: float, limits: VerificationLimits) -> VerificationAssessment:
    if error > limits.location:
        return refused(
            message("articulation.off", error=error, limit=limits.location),
            CALIBRATE_AGAIN,
        )
    return accepted(message("articulation.good", error=error, limit=limits.location))


def _screen(
    options: ArticulationOptions, conditions: Conditions, progress: TaskProgress
) -> Screening:
    """Reject a point in another posture than its run, or in an earlier one."""
    points, runs = progress.points, progress.runs
    last = points[-1].rotation[None]
    if len(points) > 1:
        turned = angles_between(last, points[0].rotation[None])[0, 0]
        if turned > SAME_POSTURE:
            return without_last(len(points), OTHER_POSTURE)
        return without_others(points, LIFTED)
    before = [run[0].rotation for run in runs]
    if before and angles_between(last, np.array(before)).min() < NEW_POSTURE:
        return without_last(len(points), ALIKE)
    return keep_all(len(points))


def _entries(found: Articulation, instrument: Instrument) -> dict[str, Any]:
    return {
        "in_the_form_of": "ISO 10360-12, articulated location error",
        "location_error_mm": found.location_error,
        "expected_mm": found.expected,
        "postures": [
            {"name": name, "location_cam_mm": location, "spread_mm": spread}
            for name, location, spread in zip(
                found.names,
                found.locations.tolist(),
                found.spreads.tolist(),
                strict=True,
            )
        ],
    }


def _tables(found: Articulation, conditions: Conditions) -> tuple[ResultTable, ...]:
    note = message(
        "articulation.note", error=found.location_error, expected=found.expected
    )
    rows = zip(
        found.names, found.locations.tolist(), found.spreads.tolist(), strict=True
    )
    return (_table([ResultRow(name, [*uvw, s]) for name, uvw, s in rows], note),)


def _figures_so_far(
    progress: TaskProgress, conditions: Conditions
) -> tuple[ResultTable, ...]:
    rows = []
    for i, run in enumerate(progress.runs, start=1):
        place = scatter_of(run)
        off = np.linalg.norm(place.points - place.mean, axis=1)
        rows.append(ResultRow(str(i), [*place.mean.tolist(), float(off.max())]))
    return (_table(rows),)


def _table(rows: Sequence[ResultRow], *notes: Message) -> ResultTable:
    columns = (*"uvw", message("articulation.spread")) if rows else ()
    return ResultTable(message("articulation.table"), columns, tuple(rows), notes)


def _instruction(options: ArticulationOptions, progress: TaskProgress) -> Message:
    return message(
        "session.touch-postures",
        n_touches=len(progress.points),
        needed=N_TOUCHES,
        posture=progress.run,
        n_postures=N_POSTURES,
    )


ARTICULATION = VerificationTask(
    kind="articulation",
    summary="one point, in the form of ISO 10360-12",
    run_help="one posture; a single run holds five postures, one after the other",
    title=message("articulation.title"),
    purpose=message("articulation.purpose"),
    first=message("task.probe-cone"),
    another=message("task.lift"),
    other_run=message("articulation.other-run"),
    known=ALIKE,
    limits=("location",),
    options=ArticulationOptions,
    measure=measure_articulation,
    entries=_entries,
    tables=_tables,
    figures_so_far=_figures_so_far,
    hand=lambda options, run, step: HandGoal(
        tilt=SIMULATED_TILT if run else 0.0, direction=pi / 2 * run
    ),
    n_points=lambda options: N_TOUCHES,
    n_runs=lambda options: N_POSTURES,
    instruction=_instruction,
    screen=_screen,
    newness=lambda options: (0.0, 0.0),
    is_each_run_measured=False,
    counts_drift=False,
    shows_postures=True,
)
