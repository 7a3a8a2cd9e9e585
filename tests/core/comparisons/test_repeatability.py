"""Tests of `lightpen.comparisons.repeatability` and its control chart."""

from dataclasses import replace
from datetime import UTC, datetime

import numpy as np
import pytest

from lightpen.comparisons.records import repeatability_entries
from lightpen.comparisons.repeatability import (
    STUDY,
    RepeatedPoint,
    TipEstimate,
    measure_repeatability,
)
from lightpen.comparisons.summaries import repeatability_text
from lightpen.errors import CalibrationError
from lightpen.estimation.reports.verdict import Grade
from lightpen.model.decision_rules import DecisionRule
from lightpen.model.limits import VerificationLimits
from lightpen_extensions.simulator.swings import PAPER_CONE, PAPER_TIP

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
TABLE_2_STD = np.array([0.007, 0.007, 0.022])


def estimates(values: np.ndarray) -> list[TipEstimate]:
    return [
        TipEstimate(f"test {i + 1}", value, np.array([0.004, 0.006, 0.008]))
        for i, value in enumerate(values)
    ]


def touched(
    deviation: np.ndarray, expected: float = 0.004, n: int = 10
) -> RepeatedPoint:
    """A fixed point whose standard deviation is as given."""
    rng = np.random.default_rng(0)
    draws = rng.standard_normal((n, 3))
    draws -= draws.mean(axis=0)
    points = PAPER_CONE + deviation * draws / draws.std(axis=0, ddof=1)
    return RepeatedPoint(points, np.full(3, expected), datetime(2026, 1, 2, tzinfo=UTC))


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


def test_a_tip_that_scatters_more_than_a_fixed_point_rode_with_the_pen() -> None:
    found = measure_repeatability(
        estimates(TABLE_1), LIMITS, touched=touched(TABLE_2_STD)
    )

    assert found.points_to is not None
    assert found.points_to.code == "repeatability.rode-with-pen"
    assert found.assessment.grade is Grade.REPEAT
    loose = VerificationLimits(repeatability=0.1)
    found = measure_repeatability(
        estimates(TABLE_1), loose, touched=touched(TABLE_2_STD)
    )
    assert found.assessment.grade is Grade.CHECK
    assert found.assessment.next_step.code == "repeatability.tighten"


def test_a_fixed_point_that_scatters_more_than_the_tip_has_moved_itself() -> None:
    steady = PAPER_TIP + 0.02 * (TABLE_1 - TABLE_1.mean(axis=0))

    found = measure_repeatability(
        estimates(steady), LIMITS, touched=touched(TABLE_2_STD)
    )

    assert found.points_to is not None
    assert found.points_to.code == "repeatability.point-moved"
    assert found.assessment.grade is Grade.CHECK


def test_a_fixed_point_that_scatters_by_the_noise_of_its_touches_has_not_moved() -> (
    None
):
    steady = PAPER_TIP + 0.02 * (TABLE_1 - TABLE_1.mean(axis=0))

    found = measure_repeatability(
        estimates(steady), LIMITS, touched=touched(TABLE_2_STD, expected=0.012)
    )

    assert found.points_to is None
    assert found.assessment.grade is Grade.PASS


def test_a_tip_beyond_its_limit_is_not_called_steady() -> None:
    found = measure_repeatability(
        estimates(TABLE_1), LIMITS, touched=touched(10 * TABLE_2_STD)
    )

    assert found.points_to is not None
    assert found.points_to.code == "repeatability.point-moved"
    assert found.assessment.reason.code == "repeatability.scatters"


def test_scatters_that_agree_point_to_nothing() -> None:
    steady = PAPER_TIP + 0.1 * (TABLE_1 - TABLE_1.mean(axis=0))

    found = measure_repeatability(
        estimates(steady), LIMITS, touched=touched(np.full(3, 0.004))
    )

    assert found.points_to is None
    assert found.assessment.grade is Grade.PASS


def scattered(deviations: np.ndarray, n: int = 10, seed: int = 5) -> np.ndarray:
    """Tips with these standard deviations."""
    draws = np.random.default_rng(seed).standard_normal((n, 3))
    draws -= draws.mean(axis=0)
    return np.asarray(PAPER_TIP + deviations * draws / draws.std(axis=0, ddof=1))


@pytest.mark.parametrize(("n_tips", "n_touches"), [(5, 10), (10, 3), (12, 12)])
@pytest.mark.parametrize("by", [0.999, 1.001])
@pytest.mark.parametrize("is_tip", [True, False])
def test_scatters_differ_by_more_than_one_chance_in_a_hundred(
    n_tips: int, n_touches: int, by: float, is_tip: bool
) -> None:
    """The log of a variance has a variance of 2 over its degrees of freedom."""
    variance = 2 / (3 * (n_tips - 1)) + 2 / (3 * (n_touches - 1))
    ratio = by * np.exp(0.5 * 2.575829 * np.sqrt(variance))
    of_tip, of_point = (0.002 * ratio, 0.002) if is_tip else (0.002, 0.002 * ratio)
    found = measure_repeatability(
        estimates(scattered(np.full(3, of_tip), n_tips)),
        LIMITS,
        touched=touched(np.full(3, of_point), 1e-9, n_touches),
    )

    assert (found.points_to is not None) == (by > 1)
    if found.points_to is not None:
        code = "rode-with-pen" if is_tip else "point-moved"
        assert found.points_to.code == f"repeatability.{code}"
        said = found.points_to.values
        assert said["of_tip"] == pytest.approx(np.sqrt(3) * of_tip)
        assert said["of_point"] == pytest.approx(np.sqrt(3) * of_point)
        assert found.assessment.reason is found.points_to
        step = "repeatability.tighten" if is_tip else "verification.verify-again"
        assert found.assessment.next_step.code == step


@pytest.mark.parametrize(("by", "has_moved"), [(0.999, True), (1.001, False)])
def test_a_point_has_moved_that_scatters_more_than_its_touches_are_expected_to(
    by: float, has_moved: bool
) -> None:
    expected = by * 0.004 / np.exp(0.5 * 2.575829 * np.sqrt(2 / (3 * 9)))
    steady = estimates(scattered(np.full(3, 1e-4)))
    found = measure_repeatability(
        steady, LIMITS, touched=touched(np.full(3, 0.004), expected)
    )
    origin = estimates(np.zeros((10, 3)))
    nowhere = replace(touched(np.zeros(3), 0.0), points=np.zeros((10, 3)))
    none = measure_repeatability(steady, LIMITS, touched=nowhere)
    both = measure_repeatability(origin, LIMITS, touched=nowhere)

    assert (found.points_to is not None) == has_moved
    assert none.points_to is not None  # what scatters at all is more than nothing
    assert none.points_to.code == "repeatability.rode-with-pen"
    assert both.points_to is None


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


@pytest.mark.parametrize(("least", "is_capable"), [(1.329, False), (1.331, True)])
@pytest.mark.parametrize("bias", [None, 0.0005])
def test_a_tip_is_capable_from_four_thirds_on(
    least: float, is_capable: bool, bias: float | None
) -> None:
    values = scattered(np.array([0.001, 0.0005, 0.0008]), 30)
    # A fifth of the tolerance over six deviations; half of it less the bias over three.
    tolerance = 5 * (6 * least * 0.001 + 2 * (bias or 0.0))
    reference = (
        None if bias is None else values.mean(axis=0) + np.array([bias, 0.0, 0.0])
    )
    found = measure_repeatability(
        estimates(values), LIMITS, tolerance=tolerance, reference=reference
    )

    assert found.capability is not None
    assert found.capability.least == pytest.approx(least)
    assert found.capability.is_capable == is_capable
    if not is_capable:
        said = found.assessment.reason.values
        assert (said["needed"], said["tolerance"]) == (1.33, tolerance)
        assert said["least"] == pytest.approx(least)


def test_capability_is_that_of_a_type_1_study() -> None:
    rng = np.random.default_rng(1)
    values = PAPER_TIP + 0.001 * rng.standard_normal((50, 3))

    found = measure_repeatability(
        estimates(values),
        LIMITS,
        tolerance=0.1,
        reference=PAPER_TIP + np.array([0.004, 0, 0]),
    )

    study = found.capability
    assert study is not None
    assert study.cgk is not None
    s, bias = values[:, 0].std(ddof=1), abs(values[:, 0].mean() - PAPER_TIP[0] - 0.004)
    assert study.cg[0] == pytest.approx(0.2 * 0.1 / (6 * s))
    assert study.cgk[0] == pytest.approx((0.1 * 0.1 - bias) / (3 * s))
    assert study.is_capable


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


def test_what_is_not_capable_never_passes() -> None:
    rng = np.random.default_rng(1)
    values = PAPER_TIP + 0.001 * rng.standard_normal((50, 3))

    found = measure_repeatability(estimates(values), LIMITS, tolerance=0.02)

    assert found.capability is not None
    assert not found.capability.is_capable
    assert found.assessment.grade is Grade.CHECK
    assert found.assessment.reason.code == "repeatability.not-capable"


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


@pytest.mark.parametrize("n_tips", [STUDY - 1, STUDY])
def test_fewer_calibrations_than_a_study_takes_are_said_to_be_few(n_tips: int) -> None:
    found = measure_repeatability(
        estimates(np.resize(TABLE_1, (n_tips, 3))), LIMITS, tolerance=0.05
    )

    is_said = f"a study takes {STUDY}" in repeatability_text(found)
    assert is_said == (n_tips < STUDY)


def test_a_tip_beyond_its_control_limits_is_named() -> None:
    values = (
        PAPER_TIP + 1e-4 * np.arange(20)[:, None] % 2e-4 + 1e-9 * np.arange(20)[:, None]
    )
    values[12] += 0.01

    found = measure_repeatability(estimates(values), LIMITS)

    assert [tip.name for tip in found.out_of_control] == ["test 13"]
