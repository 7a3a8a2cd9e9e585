"""Tests of `lightpen_extensions.measure.tasks.drift`."""

from collections.abc import Callable

import numpy as np
import pytest

from lightpen.errors import CalibrationError
from lightpen.estimation.reports.verdict import Grade
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.model.coverage import Decision, DecisionRule
from lightpen.model.limits import VerificationLimits
from lightpen_extensions.comparisons.assessment import VerificationAssessment
from lightpen_extensions.measure.tasks.drift import DRIFT, measure_drift
from lightpen_extensions.measure.tasks.probed_point import ProbedPoint
from lightpen_extensions.measure.tasks.task import Conditions
from lightpen_extensions.simulator.swings import PAPER_CONE

Touching = Callable[..., tuple[ProbedPoint, ...]]
LIMITS = VerificationLimits()


def test_a_witness_that_stays_is_accepted(
    instrument: Instrument, touching: Touching
) -> None:
    places = np.tile(PAPER_CONE, (4, 1))
    visits = [
        ("before", touching(places, seed=1, n_frames=5)),
        ("after", touching(places, seed=2, n_frames=5)),
    ]

    found = measure_drift(visits, Conditions(instrument, LIMITS))

    assert found.assessment.grade is Grade.STEADY
    np.testing.assert_array_less(np.abs(found.moves[1]), 1.5 * found.uncertainties[1])


def test_a_camera_that_moved_is_reported_and_budgeted(
    instrument: Instrument, touching: Touching
) -> None:
    places, moved = np.tile(PAPER_CONE, (4, 1)), np.array([0.1, 0.0, 0.0])
    visits = [
        ("before", touching(places, seed=1, n_frames=5)),
        ("after", touching(places + moved, seed=2, n_frames=5)),
    ]

    found = measure_drift(visits, Conditions(instrument, LIMITS))

    assert found.assessment.grade is Grade.REPEAT
    assert "between before and after" in str(found.assessment.reason)
    assert found.share[0] == pytest.approx(0.1 / np.sqrt(3), rel=0.1)


def test_a_single_visit_is_refused(instrument: Instrument, touching: Touching) -> None:
    visits = [("before", touching(PAPER_CONE[None]))]

    with pytest.raises(CalibrationError, match="visited once"):
        measure_drift(visits, Conditions(instrument, LIMITS))


def test_a_move_that_would_not_show_is_not_denied(
    instrument: Instrument, touching: Touching
) -> None:
    touches = touching(PAPER_CONE[None], seed=7)
    visits = [("one", touches), ("two", touches)]
    found = measure_drift(
        visits, Conditions(instrument, VerificationLimits(drift=0.001))
    )

    assert not found.moves.any()
    # What both visits share is no part of it; the noise of each is.
    deviations = np.sqrt(2 * np.diag(touches[0].noise))
    np.testing.assert_allclose(found.uncertainties[1], 2 * deviations)
    assert found.assessment.reason.code == "drift.uncertain"
    assert found.assessment.grade is Grade.CHECK


def test_along_the_view_u_may_be_three_times_the_limit(
    instrument: Instrument, touching: Touching
) -> None:
    touches = touching(PAPER_CONE[None], seed=7)
    visits = [("one", touches), ("two", touches)]
    usual = measure_drift(visits, Conditions(instrument, LIMITS))
    along, across = usual.uncertainties[1, 2], usual.uncertainties[1, :2].max()
    assert along > across  # depth is what a camera sees least of
    needed = max(across, along / 3)

    for limit, grade in ((1.01 * needed, Grade.STEADY), (0.99 * needed, Grade.CHECK)):
        limits = VerificationLimits(drift=limit)
        found = measure_drift(visits, Conditions(instrument, limits))
        assert found.assessment.grade is grade


def test_a_move_that_a_guard_band_leaves_open_is_checked(
    instrument: Instrument, touching: Touching
) -> None:
    places, moved = np.tile(PAPER_CONE, (4, 1)), np.array([0.019, 0.0, 0.0])
    visits = [
        ("before", touching(places, seed=1, n_frames=5)),
        ("after", touching(places + moved, seed=2, n_frames=5)),
    ]
    limits = VerificationLimits(rule=DecisionRule.GUARD_BAND)

    found = measure_drift(visits, Conditions(instrument, limits))

    assert found.assessment.grade is Grade.CHECK


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("by", [0.999, 1.001])
def test_a_reference_seems_to_move_once_in_two_hundred_times(
    instrument: Instrument, axis: int, by: float
) -> None:
    """A move has a chi-square of three freedoms; along the view a third counts."""
    sigma, moved = np.array([0.002, 0.003, 0.006]), np.zeros(3)
    moved[axis] = by * np.sqrt(2 * 12.838156) * sigma[axis]
    shared = np.zeros((3, len(instrument.covariance)))
    one, other = (
        ProbedPoint(PAPER_CONE + off, np.diag(sigma**2), shared, np.eye(3), ("",), 0.0)
        for off in (np.zeros(3), moved)
    )
    share = 1 / 3 if axis == 2 else 1.0

    def found(limit: float) -> VerificationAssessment:
        conditions = Conditions(instrument, VerificationLimits(drift=limit))
        return measure_drift([("one", [one]), ("two", [other])], conditions).assessment

    beyond, within = found(0.99 * share * moved[axis]), found(3 * share * moved[axis])
    assert beyond.grade is (Grade.REPEAT if by > 1 else Grade.CHECK)
    assert beyond.next_step.code == (
        "verification.verify-again" if by > 1 else "drift.touch-longer"
    )
    # More than chance and a quarter of the limit: neither a pass nor refused.
    assert within.grade is (Grade.CHECK if by > 1 else Grade.STEADY)
    said = beyond.reason.values
    assert said["distance"] == pytest.approx(moved[axis])
    assert said["uncertainty"] == pytest.approx(2 * np.sqrt(2) * sigma[axis])
    assert found(5 * share * moved[axis]).reason.code == "drift.good"


def test_a_move_that_is_more_than_chance_and_within_its_limit_is_good(
    instrument: Instrument, touching: Touching
) -> None:
    places = np.tile(PAPER_CONE, (4, 1))
    visits = [
        (f"{off}", touching(places + off * np.eye(3)[0], n_frames=5))
        for off in (0, 0.02)
    ]
    found = measure_drift(visits, Conditions(instrument, VerificationLimits(drift=0.1)))
    first, *_ = bands = DRIFT.bands(
        found, Conditions(instrument, VerificationLimits(drift=0.1))
    )

    assert found.moves[1, 0] == pytest.approx(0.02, abs=0.005)
    assert found.assessment.reason.code == "drift.good"
    assert len(bands) == 3
    assert first.value == found.moves[1, 0]
    assert (first.lower, first.upper) == (-0.1, 0.1)
    assert first.decision is Decision.ACCEPTED
