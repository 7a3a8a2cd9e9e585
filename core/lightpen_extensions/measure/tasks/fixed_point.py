"""The tip check: a fixed point in new postures, the paper's Table 2.

A tip that is right stays where it is, however the pen is held; one that is off by d in
the pen's frame moves by ``R_i d``. So where the points scatter, the postures
determine the tip by which they would not.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from math import inf, pi
from typing import Any

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.messages import Message, message
from lightpen.model.coverage import (
    COVERAGE,
    COVERAGE_FACTOR,
    Decision,
    chi_square_quantile,
    posture_spread,
    symmetric_root,
)
from lightpen.model.limits import VerificationLimits
from lightpen_extensions.comparisons.assessment import (
    CALIBRATE_AGAIN,
    MORE_POINTS,
    RELEVANT,
    VERIFY_AGAIN,
    Scatter,
    VerificationAssessment,
    accepted,
    check,
    refused,
)
from lightpen_extensions.measure.measuring.report import (
    ResultRow,
    ResultTable,
    points_table,
)
from lightpen_extensions.measure.tasks.probed_point import (
    ProbedPoint,
    joint_covariance,
    point_entries,
    with_tip,
)
from lightpen_extensions.measure.tasks.task import (
    ANY,
    Band,
    Conditions,
    Found,
    HandGoal,
    Runs,
    Screening,
    VerificationChoices,
    VerificationTask,
)

BY_CHANCE = 0.01  # probability that a correct tip looks wrong
MISSED = 0.05  # probability that an error of the stated size is missed
TIP_SIGMA = 3.0  # mm, by which another tip may differ
LARGEST = 1.0  # mm; least detectable error above which there is no evidence


@dataclass(frozen=True, eq=False)
class TipEvidence:
    """The evidence of points on the tip."""

    change: FloatArray  # (3,), required less given tip, pen frame, mm
    covariance: FloatArray  # (3, 3), of the change of a correct tip, mm^2
    is_significant: bool  # whether it is more than chance
    detectable: float  # found with 95 % probability, mm; inf if never

    @property
    def uncertainty(self) -> FloatArray:
        """U (k = 2) of the change, (3,), mm."""
        return np.asarray(COVERAGE_FACTOR * np.sqrt(np.diag(self.covariance)))

    @property
    def known_change(self) -> FloatArray:
        """The component of the change that is known best for its size, (3,), mm.

        It lies along ``C^-1 d``, the direction in which the change is most standard
        deviations long; what the points do not determine is left out.
        """
        along = np.linalg.solve(self.covariance, self.change)
        squared = max(float(along @ along), np.finfo(float).tiny)
        return np.asarray(along * (float(along @ self.change) / squared))

    @property
    def known_uncertainty(self) -> float:
        """U (k = 2) of the length of that component, mm."""
        along = np.linalg.solve(self.covariance, self.change)
        along /= max(float(np.linalg.norm(along)), np.finfo(float).tiny)
        return COVERAGE_FACTOR * float(np.sqrt(along @ self.covariance @ along))

    def verifies_tip(self, limits: VerificationLimits) -> bool:
        """Return whether an error as large as the limit would be found."""
        return self.detectable <= limits.tip


def points_evidence(
    points: Sequence[ProbedPoint], instrument: Instrument, drift: FloatArray
) -> TipEvidence:
    """Return the evidence of points in one cone on the tip.

    ``drift`` (3,) is the standard uncertainty of a point by a camera that moved, mm.
    """
    n = len(points)
    places = np.array([point.point_cam for point in points])
    residuals = (places - places.mean(axis=0)).ravel()
    A = -np.concatenate([point.rotation for point in points])
    spread = joint_covariance(points, instrument) + np.diag(np.tile(drift**2, n))
    by_cone = np.tile(np.eye(3), (n, 1))
    W = np.linalg.inv(spread)
    WB = W @ by_cone
    W = W - WB @ np.linalg.solve(by_cone.T @ WB, WB.T)
    covariance = np.linalg.inv(A.T @ W @ A + np.eye(3) / TIP_SIGMA**2)
    change = covariance @ (A.T @ W @ residuals)
    left = residuals - A @ change
    n_free = max(len(residuals) - 6, 1)
    excess = float(left @ W @ left) / n_free
    if excess > chi_square_quantile(n_free, BY_CHANCE) / n_free:
        covariance = covariance * excess
    distance = float(change @ np.linalg.solve(covariance, change))
    return TipEvidence(
        change=change,
        covariance=covariance,
        is_significant=distance > chi_square_quantile(3, BY_CHANCE),
        detectable=_detectable(covariance),
    )


def _detectable(covariance: FloatArray) -> float:
    worst = float(np.sqrt(np.linalg.eigvalsh(covariance)[-1]))
    found = worst * _detected_deviations()
    return found if found < LARGEST else inf


@cache
def _detected_deviations() -> float:
    """Return the smallest detectable tip error in standard deviations."""
    from scipy.special import chndtrinc

    gate = chi_square_quantile(3, BY_CHANCE)
    return float(np.sqrt(chndtrinc(gate, 3, MISSED)))


def judged_tip(
    found: TipEvidence, limits: VerificationLimits
) -> VerificationAssessment | None:
    """Return the finding against the tip; None without one."""
    change, uncertainty = found.known_change, found.known_uncertainty
    distance = float(np.linalg.norm(change))
    if not found.is_significant or distance <= RELEVANT * limits.tip:
        return None
    x, y, z = change.tolist()
    another = message(
        "tip.another",
        x=x,
        y=y,
        z=z,
        distance=distance,
        uncertainty=uncertainty,
        limit=limits.tip,
    )
    decision = limits.decision(distance, uncertainty, limits.tip)
    judged = refused if decision is Decision.REJECTED else check
    return judged(another, CALIBRATE_AGAIN)


def not_the_tip(found: TipEvidence, limits: VerificationLimits) -> Message:
    """Return the message that points cannot detect a tip error within the limit."""
    if found.detectable < inf:
        return message("tip.weak-power", detectable=found.detectable, limit=limits.tip)
    return message("tip.no-power", limit=limits.tip)


def tip_entries(found: TipEvidence) -> dict[str, Any]:
    """Return the entries of the evidence of points on the tip in a record."""
    return {
        "tip_change_mm": found.change,
        "tip_change_expanded_uncertainty_mm": found.uncertainty,
        "wants_other_tip": found.is_significant,
        "detectable_tip_error_mm": (
            found.detectable if found.detectable < inf else None
        ),
    }


MIN_TOUCHES = 3
NEW_POSTURE = float(np.radians(8.0))
ELSEWHERE = 5.0  # mm from the other points: the tip was not in the cone at all
TILT = 0.6  # rad, to lean the pen by, once round the cone
N_DRAWS = 2000
MIN_SPREAD = np.radians(3.0)  # rms turn of the best direction; less verifies nothing
LIFTED = 0.2  # mm; nearer points scatter, farther ones may be of a lifted pen
UNUSUAL = 0.001  # probability of such a scatter by chance


@dataclass(frozen=True, eq=False)
class FixedPoint(Found):
    """A fixed point by N probed points."""

    touches: tuple[ProbedPoint, ...]
    left_out: tuple[ProbedPoint, ...]  # elsewhere: the pen was lifted
    calibrated: Scatter
    nominal: Scatter | None  # with the nominal tip, if known
    uncertainty: FloatArray  # (3,), U (k = 2) of the mean, mm
    expected_deviation: FloatArray  # (3,), of a touch by its covariance, mm
    freedom: FloatArray  # (3,), degrees of freedom of that deviation
    half_range_uncertainty: FloatArray  # (3,): 95 % of the half ranges by noise, mm
    tip: TipEvidence


def measure_fixed_point(
    runs: Runs, conditions: Conditions, choices: VerificationChoices | None = None
) -> FixedPoint:
    """Measure a fixed point by all runs, and judge the tip by its scatter.

    Raises `CalibrationError` if there are too few points at one place.
    """
    instrument, nominal_tip = conditions.instrument.seated, conditions.nominal_tip
    points = [point.seated for _, own in runs for point in own]
    kept = without_others(points).kept if points else ()
    touches = tuple(points[i] for i in kept)
    n = len(touches)
    if n < MIN_TOUCHES:
        raise CalibrationError(
            "fixed-point.too-few",
            n_touches=n,
            needed=MIN_TOUCHES,
            usual=VerificationChoices.n_cone,
        )
    calibrated = scatter_of(touches)
    covariance = joint_covariance(touches, instrument)
    blocks = covariance.reshape(n, 3, n, 3)
    of_mean = blocks.sum(axis=(0, 2)) / n**2
    # Points unlike in noise scatter as fewer alike ones do (Welch, Satterthwaite).
    about_mean = np.eye(n) - 1 / n
    spreads = about_mean @ np.einsum("niMi->inM", blocks) @ about_mean
    variances = np.einsum("inn->i", spreads)
    freedom = variances**2 / np.sum(spreads**2, axis=(1, 2))
    found = FixedPoint(
        touches=touches,
        left_out=tuple(e for i, e in enumerate(points) if i not in kept),
        calibrated=calibrated,
        nominal=None
        if nominal_tip is None
        else scatter_of([with_tip(each, instrument, nominal_tip) for each in touches]),
        uncertainty=COVERAGE_FACTOR * np.sqrt(np.diag(of_mean) + conditions.drift**2),
        expected_deviation=np.sqrt(variances / (n - 1)),
        freedom=freedom,
        half_range_uncertainty=_half_range_by_noise(covariance),
        tip=points_evidence(touches, instrument, conditions.drift),
        assessment=accepted(_steady(calibrated)),
    )
    return replace(found, assessment=_assessment(found, conditions.limits))


def _half_range_by_noise(covariance: FloatArray) -> FloatArray:
    """Return the half range that a point at rest shows with 95 % probability, mm."""
    rng = np.random.default_rng(0)
    drawn = rng.standard_normal((N_DRAWS, len(covariance)))
    drawn = (drawn @ symmetric_root(covariance)).reshape(N_DRAWS, -1, 3)
    half = np.ptp(drawn, axis=1) / 2
    return np.asarray(np.quantile(half, COVERAGE, axis=0))


def _steady(scatter: Scatter) -> Message:
    u, v, w = scatter.half_range.tolist()
    return message("fixed-point.steady", u=u, v=v, w=w)


def scatter_of(touches: Sequence[ProbedPoint]) -> Scatter:
    """Return the coordinates of touches."""
    return Scatter(np.array([touch.point_cam for touch in touches]))


def _assessment(
    found: FixedPoint, limits: VerificationLimits
) -> VerificationAssessment:
    """Judge the tip first, as it explains a scatter; tolerate the expected noise."""
    against = judged_tip(found.tip, limits)
    if against is not None:
        return against
    deviation, limit = found.calibrated.deviation, _limit(found, limits)
    axis = int(np.argmax(deviation / limit))
    if deviation[axis] > limit[axis]:
        return refused(
            message(
                "fixed-point.scatters",
                deviation=float(deviation[axis]),
                axis="uvw"[axis],
                limit=float(limit[axis]),
            ),
            VERIFY_AGAIN,
        )
    rotations = np.array([touch.rotation for touch in found.touches])
    spread = float(posture_spread(rotations)[0][-1])
    if spread < MIN_SPREAD:
        return check(
            message(
                "fixed-point.same-posture",
                found=float(np.degrees(spread)),
                needed=float(np.degrees(MIN_SPREAD)),
            ),
            VERIFY_AGAIN,
        )
    if found.left_out:
        return check(
            message(
                "fixed-point.lifted",
                n_left_out=len(found.left_out),
                n_touches=len(found.left_out) + len(found.touches),
                first=found.left_out[0].label,
            ),
            VERIFY_AGAIN,
        )
    if not found.tip.verifies_tip(limits):
        return check(not_the_tip(found.tip, limits), MORE_POINTS)
    power = message("tip.verified", detectable=found.tip.detectable)
    reason = _steady(found.calibrated)
    return accepted(message("tip.with-power", reason=reason, power=power))


def _limit(found: FixedPoint, limits: VerificationLimits) -> FloatArray:
    """Return the limit of the standard deviation, (3,), mm, or what noise may show."""
    quantiles = [chi_square_quantile(each, UNUSUAL) for each in found.freedom.tolist()]
    by_chance = np.sqrt(np.array(quantiles) / found.freedom)
    limit = np.array([limits.across, limits.across, limits.along])
    return np.asarray(np.maximum(limit, by_chance * found.expected_deviation))


def without_others(
    points: Sequence[ProbedPoint], limit: float = ELSEWHERE
) -> Screening:
    """Accept the points within a limit, mm, of most of them."""
    places = scatter_of(points).points
    distances = np.linalg.norm(places - np.median(places, axis=0), axis=1)
    kept = np.flatnonzero(distances <= limit).tolist()
    if len(points) < 3 or len(kept) == len(points):  # of two, either may be wrong
        return Screening(range(len(points)))
    return Screening(
        kept, message("session.elsewhere", distance=float(distances.max()))
    )


def _entries(found: FixedPoint, instrument: Instrument) -> dict[str, Any]:
    return {
        "calibrated": _scatter_entries(found.calibrated),
        "nominal": None if found.nominal is None else _scatter_entries(found.nominal),
        "expanded_uncertainty_mm": found.uncertainty,
        "expected_std_mm": found.expected_deviation,
        "half_range_mm": found.calibrated.half_range,
        "half_range_expanded_uncertainty_mm": found.half_range_uncertainty,
        **tip_entries(found.tip),
        "touches": point_entries(found.touches, instrument.seated),
        "left_out": point_entries(found.left_out, instrument.seated),
    }


def _scatter_entries(scatter: Scatter) -> dict[str, Any]:
    return {
        "points_cam_mm": scatter.points,
        "mean_mm": scatter.mean,
        "std_mm": scatter.deviation,
        "range_mm": scatter.range,
    }


def _tables(found: FixedPoint, conditions: Conditions) -> tuple[ResultTable, ...]:
    own, nominal = found.calibrated, found.nominal
    change = [
        ResultRow(message("fixed-point.tip-change"), found.tip.change.tolist()),
        ResultRow(
            message("fixed-point.tip-change-uncertainty"),
            found.tip.uncertainty.tolist(),
        ),
    ]
    rows = [
        *_spread(message("fixed-point.current-tip"), own),
        ResultRow(message("fixed-point.half-range"), own.half_range.tolist()),
        ResultRow(message("table.uncertainty"), found.half_range_uncertainty.tolist()),
        ResultRow(message("table.mean-uncertainty"), found.uncertainty.tolist()),
    ]
    title, columns = message("fixed-point.comparison"), tuple("uvw")
    points = points_table(own.points, message("fixed-point.table"))
    if nominal is None:
        notes = (message("fixed-point.no-nominal-tip"),)
        return points, ResultTable(title, columns, (*rows, *change), notes)
    rows += _spread(message("fixed-point.nominal-tip"), nominal)
    by_nominal = points_table(nominal.points, message("fixed-point.nominal-table"))
    return points, ResultTable(title, columns, (*rows, *change)), by_nominal


def _bands(found: FixedPoint, conditions: Conditions) -> tuple[Band, ...]:
    """Return the error of the tip, and the standard deviation along each axis."""
    limits, tip = conditions.limits, found.tip
    error, known = float(np.linalg.norm(tip.known_change)), tip.known_uncertainty
    decision = limits.decision(error, known, limits.tip)
    name = message("fixed-point.tip-error")
    bands = [Band(name, error, known, upper=limits.tip, decision=decision)]
    share = COVERAGE_FACTOR / np.sqrt(2 * (len(found.touches) - 1))
    for axis, value, u, limit in zip(
        "uvw",
        found.calibrated.deviation.tolist(),
        (share * found.expected_deviation).tolist(),
        _limit(found, limits).tolist(),
        strict=True,
    ):
        name = message("fixed-point.deviation-along", axis=axis)
        kept = Decision.ACCEPTED if value <= limit else Decision.REJECTED
        bands.append(Band(name, value, u, upper=limit, decision=kept))
    return tuple(bands)


def _spread(name: Message, scatter: Scatter) -> list[ResultRow]:
    return [
        ResultRow(name, scatter.mean.tolist()),
        ResultRow(message("table.deviation"), scatter.deviation.tolist()),
        ResultRow(message("table.range"), scatter.range.tolist()),
    ]


FIXED_POINT = VerificationTask(
    kind="fixed point",
    title=message("fixed-point.title"),
    purpose=message("fixed-point.purpose"),
    first=message("task.probe-cone"),
    another=message("fixed-point.another"),
    known=message("session.same-posture"),
    limits=("across", "along", "tip"),
    measure=measure_fixed_point,
    entries=_entries,
    tables=_tables,
    bands=_bands,
    hand=lambda choices, run, step: HandGoal(
        tilt=TILT, direction=2 * pi * step / choices.n_cone
    ),
    n_points=lambda choices, run: choices.n_cone,
    n_frames=lambda choices: choices.n_cone_frames,
    instruction=lambda choices, progress: message("session.touch-cone"),
    screen=lambda progress: without_others(progress.points),
    newness=(NEW_POSTURE, ANY),
)
