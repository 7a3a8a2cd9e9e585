"""The verdict of each task by its figures, just within and just beyond its limits.

Across, radius, drift: 0.01, 0.02, 0.02 mm; along and length 0.03; tip 0.04; form 0.1.
"""

from dataclasses import replace
from math import inf

import numpy as np
import pytest

from lightpen.arrays import FloatArray
from lightpen.estimation.reports.verdict import Grade
from lightpen.messages import message
from lightpen.model.coverage import DecisionRule
from lightpen.model.limits import VerificationLimits
from lightpen.model.rigid import rotation_from_vector
from lightpen_extensions.comparisons.assessment import (
    Scatter,
    VerificationAssessment,
    accepted,
)
from lightpen_extensions.measure.tasks import drift, fixed_point
from lightpen_extensions.measure.tasks.fixed_point import TipEvidence, judged_tip
from lightpen_extensions.measure.tasks.probed_point import ProbedPoint

LIMITS = VerificationLimits()
GUARD = VerificationLimits(rule=DecisionRule.GUARD_BAND)
GOOD = TipEvidence(np.zeros(3), 1e-6 * np.eye(3), False, 0.0399)
WEAK, BLIND = replace(GOOD, detectable=0.0401), replace(GOOD, detectable=inf)
OTHER = replace(GOOD, change=np.array([0.03, 0.0, -0.03]), is_significant=True)
DOUBTED = replace(OTHER, change=np.array([0.02, 0.0, 0.0]))
REASON = message("drift.too-few")
LIFTED = ProbedPoint(
    *(np.zeros(3), np.eye(3), np.zeros((3, 0)), np.eye(3)), ("lifted",), 0.0
)

PASSED = "tip.with-power verification.use-tip pass"
ANOTHER_TIP = "tip.another verification.calibrate-again repeat"
DIFFERS = "tip.another verification.calibrate-again check"
WEAK_POWER = "tip.weak-power verification.more-points check"


def said(found: VerificationAssessment | None) -> str:
    """Return reason, next step and grade in few words."""
    if found is None:
        return ""
    return f"{found.reason.code} {found.next_step.code} {found.grade.name.lower()}"


def whole(verdict: str, task: str) -> str:
    """Return a verdict with the names of its messages."""
    reason, step, grade = verdict.split()
    reason = reason if "." in reason else f"{task}.{reason}"
    step = step if "." in step else f"verification.{step}"
    return f"{reason} {step} {grade}"


@pytest.mark.parametrize(
    ("deviation", "expected", "turn", "tip", "verdict"),
    [
        ([0.0099, 0.0099, 0.0299], 0.0, 20.0, GOOD, PASSED),
        ([0.0, 0.0, 0.0], 0.0, 20.0, WEAK, WEAK_POWER),
        ([1.0, 0.0, 0.0], 0.0, 20.0, DOUBTED, DIFFERS),
        ([0.0101, 0.0, 0.029], 0.0, 20.0, GOOD, "scatters verify-again repeat"),
        ([0.0, 0.0101, 0.029], 0.0, 20.0, GOOD, "scatters verify-again repeat"),
        ([0.0, 0.0, 0.0301], 0.0, 20.0, GOOD, "scatters verify-again repeat"),
        # chi-square of 5 degrees of freedom exceeds 20.5 once in a thousand times.
        ([0.0202, 0.0, 0.0], 0.01, 20.0, GOOD, PASSED),
        ([0.0203, 0.0, 0.0], 0.01, 20.0, GOOD, "scatters verify-again repeat"),
        ([0.0, 0.0, 0.0], 0.0, 3.01, GOOD, PASSED),
        ([0.0, 0.0, 0.0], 0.0, 2.99, WEAK, "same-posture verify-again check"),
    ],
)
def test_a_fixed_point(
    deviation: list[float], expected: float, turn: float, tip: TipEvidence, verdict: str
) -> None:
    found = cone(np.array(deviation), expected, turn, tip)

    judged = fixed_point._assessment(found, LIMITS)

    assert said(judged) == whole(verdict, "fixed-point")
    if judged.reason.code == "fixed-point.scatters":
        worst = int(np.argmax(deviation / np.array([1.0, 1.0, 3.0])))
        assert judged.reason.values["axis"] == "uvw"[worst]
    lifted = fixed_point._assessment(replace(found, left_out=(LIFTED,)), LIMITS)
    assert lifted.grade is not Grade.PASS
    if judged.reason.code == "tip.weak-power":
        assert lifted.reason == message(
            "fixed-point.lifted", n_left_out=1, n_touches=7, first="lifted"
        )


def cone(
    deviation: FloatArray, expected: float, turn: float, tip: TipEvidence
) -> fixed_point.FixedPoint:
    """Six points in postures that turn to and fro by an angle, degrees."""
    turns = np.radians(turn) * np.array([1, -1, 1, -1, 1, -1])[:, None] * np.eye(3)[1]
    touches = tuple(
        replace(LIFTED, rotation=R) for R in rotation_from_vector(np.array(turns))
    )
    scatter = Scatter(np.outer([0.0, np.sqrt(2)], deviation))
    return fixed_point.FixedPoint(
        *(accepted(REASON), touches, (), scatter, None, np.zeros(3)),
        *(np.full(3, expected), np.full(3, 5.0), np.zeros(3), tip),
    )


@pytest.mark.parametrize(
    ("move", "sigma", "verdict"),
    [
        ([0.0, 0.0, 0.0], 0.001, "good drift.use-touches steady"),
        # A move that is certain but does not matter.
        ([0.0049, 0.0, 0.0], 0.001, "good drift.use-touches steady"),
        ([0.0051, 0.0, 0.0], 0.001, "moved verify-again check"),
        ([0.0, 0.0201, 0.0], 0.001, "moved verify-again repeat"),
        # Along the view it may be three times as much.
        ([0.0, 0.0, 0.0147], 0.001, "good drift.use-touches steady"),
        ([0.0, 0.0, 0.0153], 0.001, "moved verify-again check"),
        # 12.84 of chi-square is more than chance.
        ([0.019, 0.0, 0.0], 0.019 / 12.7**0.5, "good drift.use-touches steady"),
        ([0.019, 0.0, 0.0], 0.019 / 13.0**0.5, "moved verify-again check"),
        ([0.0, 0.0, 0.0], 0.0099, "good drift.use-touches steady"),
        ([0.0, 0.0, 0.0], 0.0101, "uncertain drift.touch-longer check"),
        ([0.03, 0.0, 0.0], 0.0098, "open drift.touch-longer check"),
    ],
)
def test_a_drift_reference(move: list[float], sigma: float, verdict: str) -> None:
    moves = np.array([[0.0] * 3, move, np.multiply(move, -0.9)])
    covariances = sigma**2 * np.array([np.zeros((3, 3)), np.eye(3), np.eye(3)])

    found = drift._assessment(("a", "b", "c"), moves, covariances, LIMITS)

    assert said(found) == whole(verdict, "drift")
    if found.reason.code == "drift.moved":
        along = 3.0 if move[2] else 1.0
        assert found.reason.values == {
            "first": "a",
            "visit": "b",
            "distance": pytest.approx(np.linalg.norm(move)),
            "uncertainty": pytest.approx(2 * sigma),
            "limit": pytest.approx(0.02 * along),
        }


@pytest.mark.parametrize(
    ("x", "sigma", "is_significant", "limits", "verdict"),
    [
        (0.5, 0.001, False, LIMITS, ""),
        (0.0099, 0.001, True, LIMITS, ""),  # hardly a quarter of the limit
        (0.0101, 0.001, True, LIMITS, DIFFERS),
        (0.0399, 0.001, True, LIMITS, DIFFERS),
        (0.0401, 0.001, True, LIMITS, ANOTHER_TIP),
        # By a guard band 1.65 standard uncertainties more are needed.
        (0.0564, 0.01, True, GUARD, DIFFERS),
        (0.0566, 0.01, True, GUARD, ANOTHER_TIP),
    ],
)
def test_a_tip(
    x: float,
    sigma: float,
    is_significant: bool,
    limits: VerificationLimits,
    verdict: str,
) -> None:
    change = np.array([-0.6 * x, 0.0, 0.8 * x])
    found = TipEvidence(change, sigma**2 * np.eye(3), is_significant, 0.01)

    judged = judged_tip(found, limits)

    assert said(judged) == verdict
    if judged is not None:
        assert judged.reason.values == {
            "x": pytest.approx(-0.6 * x),
            "y": 0.0,
            "z": pytest.approx(0.8 * x),
            "distance": pytest.approx(x),
            "uncertainty": pytest.approx(2 * sigma),
            "limit": 0.04,
        }
