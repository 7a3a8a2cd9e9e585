"""Whether the camera moved during a session: a drift reference probed before and after.

The drift reference is a fixed cone, probed at the start, at the end and as often
in between as one likes. What tip, LEDs and camera have wrong moves all visits alike
where the pen is held alike, so that it hardly counts in a difference. What the drift
reference moved by is counted into points that were measured in between as a rectangular
distribution of that half-width [1]_.

References
----------
.. [1] JCGM 100:2008, "Guide to the expression of uncertainty in measurement", 4.3.7.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.estimation.reports.verdict import Grade
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.messages import Message, message
from lightpen.model.coverage import COVERAGE_FACTOR, Decision, chi_square_quantile
from lightpen.model.limits import VerificationLimits
from lightpen.model.rigid import angles_between
from lightpen_extensions.comparisons.assessment import (
    VERIFY_AGAIN,
    VerificationAssessment,
    accepted,
    check,
    graded,
)
from lightpen_extensions.measure.measuring.report import ResultRow, ResultTable
from lightpen_extensions.measure.tasks.fixed_point import (
    ELSEWHERE,
    LIFTED,
    without_others,
)
from lightpen_extensions.measure.tasks.probed_point import joint_covariance
from lightpen_extensions.measure.tasks.task import (
    Band,
    Conditions,
    Found,
    HandGoal,
    Runs,
    Screening,
    TaskProgress,
    VerificationChoices,
    VerificationTask,
)

MIN_VISITS = 2
VISIT_POINTS = 3
SAME_POSTURE = float(np.radians(12.0))  # within which a pen is held alike
BY_CHANCE = 0.005  # probability that a fixed reference seems to move
# The limit along the view is three times as large, as of a fixed point.
SCALES = np.array([1.0, 1.0, 1.0 / 3.0])
TOUCH_LONGER = message("drift.touch-longer")
USE_TOUCHES = message("drift.use-touches")


@dataclass(frozen=True, eq=False)
class Drift(Found):
    """Moves (N, 3) of a drift reference since the first visit, and U (k = 2), mm."""

    names: tuple[str, ...]
    moves: FloatArray
    uncertainties: FloatArray

    @property
    def share(self) -> FloatArray:
        """Standard uncertainty by the drift for points probed meanwhile, (3,), mm."""
        return np.asarray(np.abs(self.moves).max(axis=0) / np.sqrt(3))


def measure_drift(
    visits: Runs, conditions: Conditions, choices: VerificationChoices | None = None
) -> Drift:
    """Measure how a drift reference moves over two visits or more, in order."""
    if len(visits) < MIN_VISITS:
        raise CalibrationError("drift.too-few")
    instrument = conditions.instrument.seated
    points = [point.seated for _, own in visits for point in own]
    owners = np.repeat(np.arange(len(visits)), [len(own) for _, own in visits])
    shares = np.equal.outer(np.arange(len(visits)), owners).astype(float)
    means = shares / shares.sum(axis=1, keepdims=True)
    differences = means - means[0]
    moves = differences @ np.array([point.point_cam for point in points])
    spread = joint_covariance(points, instrument).reshape(len(points), 3, -1, 3)
    covariances = np.einsum("vn,niMj,vM->vij", differences, spread, differences)
    variances = np.diagonal(covariances, axis1=1, axis2=2)
    names = tuple(name for name, _ in visits)
    return Drift(
        names=names,
        moves=moves,
        uncertainties=COVERAGE_FACTOR * np.sqrt(variances),
        assessment=_assessment(names, moves, covariances, conditions.limits),
    )


def _assessment(
    names: tuple[str, ...],
    moves: FloatArray,
    covariances: FloatArray,
    limits: VerificationLimits,
) -> VerificationAssessment:
    """Judge the farthest move; along the view three times the limit is allowed."""
    scaled = moves * SCALES
    spreads = covariances * np.outer(SCALES, SCALES)
    lengths = np.linalg.norm(scaled, axis=1)
    worst = int(np.argmax(lengths))
    distance, spread = float(lengths[worst]), spreads[worst]
    along = scaled[worst] / max(distance, np.finfo(float).tiny)
    uncertainty = COVERAGE_FACTOR * float(np.sqrt(along @ spread @ along))
    move = float(np.linalg.norm(moves[worst]))
    stretch = move / distance if distance else 1.0
    u, limit = stretch * uncertainty, stretch * limits.drift  # as it moved
    deviations = scaled[worst] @ np.linalg.pinv(spread) @ scaled[worst]
    is_significant = deviations > chi_square_quantile(3, BY_CHANCE)
    grade = graded(distance, uncertainty, limits.drift, limits)
    if is_significant and grade is not Grade.PASS:
        moved = message(
            "drift.moved",
            first=names[0],
            visit=names[worst],
            distance=move,
            uncertainty=u,
            limit=limit,
        )
        return VerificationAssessment(grade, moved, VERIFY_AGAIN)
    variances = np.diagonal(spreads, axis1=1, axis2=2).max(axis=0)
    axis = int(np.argmax(variances))
    largest, share = COVERAGE_FACTOR * float(np.sqrt(variances[axis])), SCALES[axis]
    if largest > limits.drift:
        doubt = message(
            "drift.uncertain",
            distance=move,
            uncertainty=largest / share,
            limit=limits.drift / share,
        )
        return check(doubt, TOUCH_LONGER)
    if limits.decision(distance, uncertainty, limits.drift) is not Decision.ACCEPTED:
        seems = message("drift.open", distance=move, uncertainty=u, limit=limit)
        return check(seems, TOUCH_LONGER)
    good = message("drift.good", distance=move, uncertainty=u, limit=limit)
    return accepted(good, USE_TOUCHES, Grade.STEADY)


def _screen(progress: TaskProgress) -> Screening:
    """Drop a point in another posture than the first, or away from its cone."""
    points, visits = progress.points, progress.runs
    first, last = (*visits, points)[0][0], points[-1]
    is_second = not visits and len(points) == 2  # either may be the wrong one
    kept = (1,) if is_second else tuple(range(len(points) - 1))
    turned = angles_between(last.rotation[None], first.rotation[None])[0, 0]
    if turned > SAME_POSTURE:
        return Screening(kept, message("session.other-than-first"))
    distance = float(np.linalg.norm(last.point_cam - first.point_cam))
    if distance > ELSEWHERE:
        return Screening(kept, message("session.elsewhere", distance=distance))
    return without_others(points, LIFTED)


def _entries(found: Drift, instrument: Instrument) -> dict[str, Any]:
    return {
        "visits": [
            {"name": name, "move_mm": move, "expanded_uncertainty_mm": uncertainty}
            for name, move, uncertainty in _visits(found)
        ],
        "standard_uncertainty_share_mm": found.share,
    }


def _visits(found: Drift) -> list[tuple[str, list[float], list[float]]]:
    """Return name, move and uncertainty of each visit."""
    figures = found.moves.tolist(), found.uncertainties.tolist()
    return list(zip(found.names, *figures, strict=True))


def _tables(found: Drift, conditions: Conditions) -> tuple[ResultTable, ...]:
    u, v, w = found.share.tolist()
    columns = (*"uvw", *(message("drift.axis", axis=axis) for axis in "uvw"))
    rows = (ResultRow(name, [*move, *within]) for name, move, within in _visits(found))
    note = message("drift.share", u=u, v=v, w=w)
    return (ResultTable(message("drift.table"), columns, tuple(rows), (note,)),)


def _bands(found: Drift, conditions: Conditions) -> tuple[Band, ...]:
    """Return the farthest move, along each axis."""
    worst = int(np.argmax(np.linalg.norm(found.moves * SCALES, axis=1)))
    limits, bands = conditions.limits, []
    for axis, move, u, scale in zip(
        "uvw",
        found.moves[worst].tolist(),
        found.uncertainties[worst].tolist(),
        SCALES.tolist(),
        strict=True,
    ):
        limit = limits.drift / scale
        name = message("drift.move-along", axis=axis)
        decision = limits.decision(move, u, limit)
        bands.append(Band(name, move, u, -limit, limit, decision=decision))
    return tuple(sorted(bands, key=lambda each: -abs(each.value) / each.upper))


def _instruction(choices: VerificationChoices, progress: TaskProgress) -> Message:
    return message(
        "session.touch-witness",
        needed=VISIT_POINTS,
        n_touches=len(progress.points),
        visit=progress.run,
        n_visits=progress.n_runs,
    )


DRIFT = VerificationTask(
    kind="drift",
    title=message("drift.title"),
    purpose=message("drift.purpose"),
    first=message("drift.first"),
    another=message("task.lift"),
    known=message("task.lift"),
    limits=("drift",),
    measure=measure_drift,
    entries=_entries,
    tables=_tables,
    bands=_bands,
    hand=lambda choices, run, step: HandGoal(),
    n_points=lambda choices, run: VISIT_POINTS,
    n_runs=lambda choices: MIN_VISITS,
    check=lambda visits, conditions, choices: None,
    instruction=_instruction,
    screen=_screen,
    newness=(0.0, 0.0),
)
