"""Tests of `lightpen_extensions.comparisons.repeatability`."""

from dataclasses import replace

import numpy as np
import pytest

from lightpen.archive.trends import TipEstimate
from lightpen.errors import CalibrationError
from lightpen.estimation.reports.verdict import Grade
from lightpen.model.coverage import DecisionRule
from lightpen.model.limits import VerificationLimits
from lightpen_extensions.comparisons.repeatability import (
    measure_repeatability,
    repeatability_entries,
    repeatability_text,
)
from lightpen_extensions.simulator.swings import PAPER_TIP

LIMITS = VerificationLimits()
# Table 1 of the paper, mm.
TABLE_1 = np.array(
    [
        [-1.278, -90.429, -23.903],
        [-1.329, -90.388, -23.754],
        [-1.339, -90.401, -23.842],
        [-1.304, -90.456, -23.844],
        [-1.344, -90.397, -23.830],
        [-1.353, -90.450, -23.887],
        [-1.251, -90.431, -23.855],
        [-1.343, -90.388, -23.866],
        [-1.311, -90.383, -23.890],
        [-1.330, -90.372, -23.877],
    ]
)


def estimates(values: np.ndarray) -> list[TipEstimate]:
    return [
        TipEstimate(f"test {i + 1}", value, np.array([0.004, 0.006, 0.008]))
        for i, value in enumerate(values)
    ]


def test_the_table_of_the_paper_is_reproduced() -> None:
    found = measure_repeatability(estimates(TABLE_1), LIMITS)

    np.testing.assert_allclose(
        found.scatter.mean, [-1.3182, -90.4095, -23.8548], atol=5e-5
    )
    np.testing.assert_allclose(
        found.scatter.deviation, [0.033, 0.030, 0.043], atol=1e-3
    )
    text = repeatability_text(found)
    assert "  1 test 1                 -1.2780  -90.4290  -23.9030" in text
    assert "Ave                        -1.3182  -90.4095  -23.8548" in text


def test_a_tip_beyond_its_limit_is_not_called_steady() -> None:
    found = measure_repeatability(estimates(TABLE_1), LIMITS)

    assert found.assessment.reason.code == "repeatability.scatters"


def scattered(deviations: np.ndarray, n: int = 10, seed: int = 5) -> np.ndarray:
    """Tips with these standard deviations."""
    draws = np.random.default_rng(seed).standard_normal((n, 3))
    draws -= draws.mean(axis=0)
    return np.asarray(PAPER_TIP + deviations * draws / draws.std(axis=0, ddof=1))


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize(
    ("rule", "least"),
    [
        (DecisionRule.SIMPLE, 0.01),
        (DecisionRule.GUARD_BAND, 0.01 / (1 + 1.65 / np.sqrt(18))),
    ],
)
@pytest.mark.parametrize("by", [0.999, 1.001])
def test_a_tip_repeats_within_its_limit_by_the_coordinate_that_scatters_most(
    axis: int, rule: DecisionRule, least: float, by: float
) -> None:
    """U of a standard deviation is its share by the root of twice its freedom."""
    deviations = np.full(3, 0.001)
    deviations[axis] = by * least
    found = measure_repeatability(
        estimates(scattered(deviations)), replace(LIMITS, rule=rule)
    )

    grade = Grade.REPEAT if rule is DecisionRule.SIMPLE else Grade.CHECK
    assert found.assessment.grade is (grade if by > 1 else Grade.PASS)
    assert found.assessment.reason.values == {
        "deviation": pytest.approx(by * least),
        "axis": "xyz"[axis],
        "limit": 0.01,
        "stated": pytest.approx([0.002, 0.003, 0.004][axis]),
    }


def test_by_a_guard_band_few_calibrations_near_the_limit_prove_nothing() -> None:
    rng = np.random.default_rng(3)
    draws = rng.standard_normal((10, 3))
    values = PAPER_TIP + 0.008 * draws / draws.std(axis=0, ddof=1)
    rules = (
        (DecisionRule.SIMPLE, Grade.PASS),
        (DecisionRule.GUARD_BAND, Grade.CHECK),
        (DecisionRule.RISK, Grade.CHECK),
    )

    for rule, grade in rules:
        found = measure_repeatability(estimates(values), replace(LIMITS, rule=rule))
        assert found.assessment.grade is grade


def test_one_calibration_is_refused() -> None:
    with pytest.raises(CalibrationError, match="does not show repeatability"):
        measure_repeatability(estimates(TABLE_1[:1]), LIMITS)


def test_fewer_than_five_calibrations_give_no_verdict_and_nine_no_control_limits() -> (
    None
):
    steady = PAPER_TIP + 0.02 * (TABLE_1 - TABLE_1.mean(axis=0))
    four, five, nine, ten = (
        measure_repeatability(estimates(steady[:n]), LIMITS) for n in (4, 5, 9, 10)
    )

    assert four.assessment.grade is Grade.CHECK
    assert four.assessment.reason.code == "repeatability.few"
    assert five.assessment.grade is Grade.PASS
    assert nine.control is None
    assert ten.control is not None
    assert "Control limit" not in repeatability_text(nine)
    assert repeatability_entries(nine)["control"] is None


def test_a_tip_beyond_its_control_limits_is_named() -> None:
    values = (
        PAPER_TIP + 1e-4 * np.arange(20)[:, None] % 2e-4 + 1e-9 * np.arange(20)[:, None]
    )
    values[12] += 0.01

    found = measure_repeatability(estimates(values), LIMITS)

    assert [tip.name for tip in found.out_of_control] == ["test 13"]
