"""Tests of `lightpen.verification.tasks.drift`."""

from collections.abc import Callable

import numpy as np
import pytest

from lightpen.errors import CalibrationError
from lightpen.estimation.reports.verdict import Grade
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.model.decision_rules import DecisionRule
from lightpen.model.limits import VerificationLimits
from lightpen.simulator.swings import PAPER_CONE
from lightpen.verification.tasks.drift import measure_drift
from lightpen.verification.tasks.probed_point import ProbedPoint
from lightpen.verification.tasks.task import Conditions

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

    assert found.assessment.grade is Grade.PASS
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

    for limit, grade in ((1.01 * needed, Grade.PASS), (0.99 * needed, Grade.CHECK)):
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
