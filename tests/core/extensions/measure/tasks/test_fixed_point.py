"""Tests of `lightpen_extensions.measure.tasks.fixed_point`."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from lightpen.errors import CalibrationError
from lightpen.estimation.reports.verdict import Grade
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.model.coverage import Decision
from lightpen.model.limits import VerificationLimits
from lightpen_extensions.measure.tasks.fixed_point import (
    FIXED_POINT,
    NEW_POSTURE,
    measure_fixed_point,
)
from lightpen_extensions.measure.tasks.probed_point import ProbedPoint
from lightpen_extensions.measure.tasks.task import Conditions, VerificationChoices
from lightpen_extensions.simulator.swings import PAPER_CONE, PAPER_TIP

Touching = Callable[..., tuple[ProbedPoint, ...]]
NOMINAL_TIP = np.array([0.0, -90.0, -25.0])
LIMITS = VerificationLimits()


def test_a_right_tip_is_accepted(instrument: Instrument, touching: Touching) -> None:
    touches = touching(np.tile(PAPER_CONE, (10, 1)))

    found = measure_fixed_point(
        [("", touches)], Conditions(instrument, LIMITS, nominal_tip=NOMINAL_TIP)
    )

    assert found.assessment.grade is Grade.PASS
    assert not found.tip.is_significant
    assert found.nominal is not None
    # The nominal tip lies 1.8 mm off, and moves about the cone by as much.
    assert found.nominal.deviation.max() > 0.3
    assert found.calibrated.deviation.max() < 0.03
    # Standard deviations of ten values scatter by a quarter.
    np.testing.assert_allclose(
        found.calibrated.deviation, found.expected_deviation, rtol=0.7
    )


def test_a_camera_that_moved_makes_a_fixed_point_less_certain(
    instrument: Instrument, touching: Touching
) -> None:
    touches = touching(np.tile(PAPER_CONE, (4, 1)))

    still, moved = (
        measure_fixed_point(
            [("", touches)], Conditions(instrument, LIMITS, drift=np.array(drift))
        )
        for drift in ([0.0, 0.0, 0.0], [0.01, 0.0, 0.02])
    )

    np.testing.assert_allclose(
        moved.uncertainty, np.hypot(still.uncertainty, [0.02, 0.0, 0.04])
    )


def test_an_exchanged_tip_is_reported_with_how_far_off_it_is(
    instrument: Instrument, touching: Touching
) -> None:
    moved = np.array([0.3, 0.0, -0.2])
    touches = touching(np.tile(PAPER_CONE, (10, 1)), tip_pen=PAPER_TIP + moved)

    found = measure_fixed_point([("", touches)], Conditions(instrument, LIMITS))

    assert found.assessment.grade is Grade.REPEAT
    assert found.assessment.reason.code == "tip.another"
    np.testing.assert_allclose(
        found.tip.change, moved, atol=1.5 * found.tip.uncertainty.max()
    )


def test_a_cone_that_moves_is_not_blamed_on_the_tip(
    instrument: Instrument, touching: Touching
) -> None:
    rng = np.random.default_rng(3)
    points = PAPER_CONE + 0.05 * rng.standard_normal((10, 3))

    found = measure_fixed_point(
        [("", touching(points))], Conditions(instrument, LIMITS)
    )

    assert found.assessment.reason.code == "fixed-point.scatters"


def test_a_pen_lifted_in_the_middle_is_left_out_and_named(
    instrument: Instrument, touching: Touching
) -> None:
    points = np.tile(PAPER_CONE, (10, 1))
    points[4] += [0.0, -12.0, 3.0]

    found = measure_fixed_point(
        [("", touching(points))], Conditions(instrument, LIMITS)
    )

    assert [touch.label for touch in found.left_out] == ["touch 5 image 1"]
    assert found.assessment.grade is Grade.CHECK
    assert "touch 5 image 1" in str(found.assessment.reason)


def test_touches_in_one_posture_prove_nothing(
    instrument: Instrument, touching: Touching
) -> None:
    touches = touching(np.tile(PAPER_CONE, (10, 1)))[:1] * 10

    found = measure_fixed_point([("", touches)], Conditions(instrument, LIMITS))

    assert found.assessment.reason.code == "fixed-point.same-posture"


def test_two_touches_are_refused(instrument: Instrument, touching: Touching) -> None:
    touches = touching(np.tile(PAPER_CONE, (2, 1)))

    with pytest.raises(CalibrationError, match=r"2 usable points, at least 3"):
        measure_fixed_point([("", touches)], Conditions(instrument, LIMITS))


def test_the_limit_decides_on_a_scatter_beyond_noise(
    instrument: Instrument, touching: Touching
) -> None:
    rng = np.random.default_rng(3)
    touches = touching(PAPER_CONE + 0.03 * rng.standard_normal((10, 3)))
    codes = [
        measure_fixed_point(
            [("", touches)], Conditions(instrument, limits)
        ).assessment.reason.code
        for limits in (
            VerificationLimits(across=0.01, along=0.01),
            VerificationLimits(across=0.1, along=0.1),
        )
    ]

    assert codes[0] == "fixed-point.scatters"
    assert codes[1] != "fixed-point.scatters"


def test_noise_is_never_blamed_for_a_scatter(
    instrument: Instrument, touching: Touching
) -> None:
    touches = touching(np.tile(PAPER_CONE, (10, 1)))
    strict = VerificationLimits(across=1e-5, along=1e-5)

    found = measure_fixed_point([("", touches)], Conditions(instrument, strict))

    assert found.assessment.grade is Grade.PASS


def test_fewer_postures_detect_only_larger_errors_and_do_not_verify_the_tip(
    instrument: Instrument, touching: Touching
) -> None:
    places = np.tile(PAPER_CONE, (10, 1))
    steep, upright = (
        measure_fixed_point(
            [("", touching(places, tilt=tilt, n_frames=5))], Conditions(instrument)
        )
        for tilt in (0.4, 0.1)
    )

    assert steep.tip.detectable < 0.5 * upright.tip.detectable
    assert steep.assessment.grade is Grade.PASS
    assert "this verification would show it" in str(steep.assessment.reason)
    assert upright.assessment.reason.code == "tip.weak-power"


def test_u_of_the_tip_change_is_what_its_errors_scatter_by(
    instrument: Instrument, touching: Touching
) -> None:
    places = np.tile(PAPER_CONE, (10, 1))
    found = [
        measure_fixed_point([("", touching(places, seed=i))], Conditions(instrument))
        for i in range(60)
    ]

    scatter = np.std([each.tip.change for each in found], axis=0)
    # The scatter lacks what the instrument has in common, and the seat.
    expected = np.mean([each.tip.uncertainty for each in found], axis=0) / 2
    assert (scatter < 1.2 * expected).all()
    assert (scatter > 0.5 * expected).all()


def test_touches_alike_are_expected_to_scatter_by_their_noise(
    instrument: Instrument, touching: Touching
) -> None:
    touches = touching(np.tile(PAPER_CONE, (3, 1)))[:1] * 3

    found = measure_fixed_point([("", touches)], Conditions(instrument, LIMITS))

    # What all of them share moves none against another.
    noise = np.sqrt(np.diag(touches[0].noise))
    np.testing.assert_allclose(found.expected_deviation, noise, rtol=1e-6)
    np.testing.assert_allclose(found.freedom, 2.0)
    noisy = replace(touches[0], noise=1e6 * touches[0].noise)
    of_one = measure_fixed_point([("", (*touches, noisy))], Conditions(instrument))
    np.testing.assert_allclose(of_one.freedom, 1.0, rtol=1e-3)


@pytest.mark.parametrize("n_touches", [6, 8, 20])
def test_the_simulated_operator_probes_in_postures_that_all_count(
    n_touches: int,
) -> None:
    choices = VerificationChoices(n_cone=n_touches)
    goals = [FIXED_POINT.hand(choices, 0, step) for step in range(n_touches)]
    axes = np.array(
        [
            [
                np.sin(goal.tilt) * np.cos(goal.direction),
                np.sin(goal.tilt) * np.sin(goal.direction),
                np.cos(goal.tilt),
            ]
            for goal in goals
        ]
    )

    between = np.arccos(np.clip(axes @ axes.T, -1.0, 1.0))
    np.fill_diagonal(between, np.inf)
    assert between.min() > NEW_POSTURE


def test_points_at_different_places_are_too_few(
    instrument: Instrument, touching: Touching
) -> None:
    points = PAPER_CONE + np.outer([0.0, 0.0, 9.0, -9.0], [1.0, 0.0, 0.0])

    with pytest.raises(CalibrationError) as refused:
        measure_fixed_point([("", touching(points))], Conditions(instrument, LIMITS))

    assert refused.value.message.values["n_touches"] == 2
    assert refused.value.message.values["needed"] == 3


@pytest.mark.parametrize(
    ("off", "decision"), [(0.0, Decision.ACCEPTED), (0.2, Decision.REJECTED)]
)
def test_the_error_of_the_tip_leads_the_values_with_its_limit(
    instrument: Instrument, touching: Touching, off: float, decision: Decision
) -> None:
    conditions = Conditions(instrument)
    wrong = PAPER_TIP + np.array([off, 0.0, 0.0])
    touches = touching(
        np.tile(PAPER_CONE, (6, 1)), tilt=0.6, n_frames=15, tip_pen=wrong
    )

    found = measure_fixed_point([("", touches)], conditions)
    tip, *deviations = FIXED_POINT.bands(found, conditions)

    assert tip.value == pytest.approx(off, abs=tip.uncertainty)
    assert (tip.upper, tip.decision) == (conditions.limits.tip, decision)
    assert [each.value for each in deviations] == found.calibrated.deviation.tolist()
