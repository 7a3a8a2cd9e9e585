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
from lightpen.model.decision_rules import Decision
from lightpen.model.expanded_uncertainty import COVERAGE
from lightpen.model.information import symmetric_root
from lightpen.model.limits import VerificationLimits
from lightpen.model.posture import angles_between
from lightpen.verification.tasks.assessment import (
    CALIBRATE_AGAIN,
    MORE_POINTS,
    RELEVANT,
    VerificationAssessment,
    check,
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
from lightpen.verification.tasks.tip_evidence import (
    TipEvidence,
    judged_tip,
    not_the_tip,
    points_evidence,
    tip_entries,
    with_power,
)

N_POSTURES, N_TOUCHES = 5, 5
ASTRAY = 8.0  # times the median distance from the middle of all
UNUSUAL = 0.001  # chance that a correct tip shows more
N_TRIALS = 1000
TINY = 1e-12  # mm
SLACK = 1 + 1e-9  # of a sphere, for points that lie on it
SAME_POSTURE = float(np.radians(12.0))  # within which a pen is held alike
SIMULATED_TILT = 0.4  # rad
ALIKE = message("session.alike")
OTHER_POSTURE = message("session.other-posture")


@dataclass(frozen=True, eq=False)
class Articulation(Found):
    """The location error of one point in several postures."""

    names: tuple[str, ...]
    locations: FloatArray  # (N, 3), mean of each posture, camera frame, mm
    spreads: FloatArray  # (N,), farthest touch from the mean of its posture, mm
    location_error: float  # diameter of the smallest sphere about the locations, mm
    uncertainty: float  # U (k = 2), mm: 95 % of the errors by noise are less
    expected: float  # mean of these location errors, mm
    tip: TipEvidence


class ArticulationOptions(TaskOptions, frozen=True, tag="articulation"):
    """No options."""


def measure_articulation(
    runs: Runs, conditions: Conditions, options: ArticulationOptions | None = None
) -> Articulation:
    """Measure the location error of a point.

    A run is a posture; a single run holds five, one after the other. Raises
    `CalibrationError` if there are fewer than five postures of five points, the
    postures are alike, or a point is of another place.
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
    error = float(smallest_diameters(locations[None])[0])
    by_noise = _by_noise(postures, conditions)
    touches = [touch for _, own in postures for touch in own]
    tip = points_evidence(touches, conditions.instrument, conditions.drift)
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
        uncertainty=float(np.quantile(by_noise, COVERAGE)),
        expected=float(by_noise.mean()),
        tip=tip,
        assessment=_assessment(error, by_noise, tip, conditions.limits),
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


def smallest_diameters(points: FloatArray) -> FloatArray:
    """Return the diameters (K,) of the smallest spheres about points (K, N, 3), mm.

    They are the smallest of those through two to four points that hold all others.
    """
    best = np.full(len(points), np.inf)
    for size in (2, 3, 4):
        left = np.isinf(best)
        own = points[left]
        radii_of_size = np.full(len(own), np.inf)
        for chosen in combinations(range(points.shape[1]), size):
            centers, radii = _spheres_through(own[:, list(chosen)])
            farthest = np.linalg.norm(own - centers[:, None], axis=2).max(axis=1)
            radii[farthest > radii * SLACK + TINY] = np.inf
            radii_of_size = np.minimum(radii_of_size, radii)
        best[left] = radii_of_size
    return np.asarray(2 * best)


def _spheres_through(points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the smallest spheres with two to four points (K, k, 3) on each."""
    base, others = points[:, 0], points[:, 1:] - points[:, :1]
    half = 0.5 * np.sum(others**2, axis=2)
    # The centre lies in the span of the points.
    inverses = np.linalg.pinv(others @ np.swapaxes(others, 1, 2), hermitian=True)
    to_center = np.einsum("kji,kjl,kl->ki", others, inverses, half)
    return base + to_center, np.linalg.norm(to_center, axis=1)


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


def _by_noise(
    postures: Sequence[tuple[str, Sequence[ProbedPoint]]], conditions: Conditions
) -> FloatArray:
    """Return location errors of points that scatter as is known of them, mm."""
    rng = np.random.default_rng(0)
    means = [mean_point(touches) for _, touches in postures]
    covariance = joint_covariance(means, conditions.instrument)
    covariance += np.diag(np.tile(conditions.drift**2, len(means)))
    draws = rng.standard_normal((N_TRIALS, len(covariance)))
    draws = draws @ symmetric_root(covariance)
    return smallest_diameters(draws.reshape(N_TRIALS, -1, 3))


def _assessment(
    error: float, by_noise: FloatArray, tip: TipEvidence, limits: VerificationLimits
) -> VerificationAssessment:
    usual, largest = np.quantile(by_noise, [COVERAGE, 1 - UNUSUAL]).tolist()
    limit = limits.location
    off = message("articulation.off", error=error, uncertainty=usual, limit=limit)
    good = message("articulation.good", error=error, uncertainty=usual, limit=limit)
    against = judged_tip(tip, limits)
    if against is not None:
        return against
    if error > max(limits.location, largest):
        return refused(off, CALIBRATE_AGAIN)
    if limits.decision(error, usual, limits.location) is not Decision.ACCEPTED:
        return check(off, MORE_POINTS)
    if error > max(largest, RELEVANT * limits.location):
        return check(off, CALIBRATE_AGAIN)
    if not tip.verifies_tip(limits):
        return check(not_the_tip(tip, limits), MORE_POINTS)
    return with_power(good, tip, limits)


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
        "expanded_uncertainty_mm": found.uncertainty,
        **tip_entries(found.tip),
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
        "articulation.note",
        error=found.location_error,
        uncertainty=found.uncertainty,
        expected=found.expected,
    )
    rows = zip(
        found.names, found.locations.tolist(), found.spreads.tolist(), strict=True
    )
    return (_table([ResultRow(name, [*uvw, s]) for name, uvw, s in rows], note),)


def _figures_so_far(
    options: ArticulationOptions, progress: TaskProgress, conditions: Conditions
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
    summary="one point in five postures (ISO 10360-12)",
    run_help="one posture; or a single run with all five, one after the other",
    title=message("articulation.title"),
    purpose=message("articulation.purpose"),
    first=message("task.probe-cone"),
    another=message("task.lift"),
    other_run=message("articulation.other-run"),
    known=ALIKE,
    limits=("location", "tip"),
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
    shows_postures=True,
)
