"""Tests of `lightpen.verification.drift`."""

from collections.abc import Callable

import numpy as np
import pytest

from lightpen.errors import CalibrationError
from lightpen.estimation.instrument import Instrument
from lightpen.estimation.verdict import Grade
from lightpen.model.limits import VerificationLimits
from lightpen.simulator.swings import PAPER_CONE
from lightpen.verification.drift import measure_drift
from lightpen.verification.touch import Touch

Touching = Callable[..., tuple[Touch, ...]]
LIMITS = VerificationLimits()


def test_a_witness_that_stays_is_accepted(
    instrument: Instrument, touching: Touching
) -> None:
    places = np.tile(PAPER_CONE, (4, 1))
    visits = [
        ("before", touching(places, seed=1, n_frames=5)),
        ("after", touching(places, seed=2, n_frames=5)),
    ]

    found = measure_drift(visits, instrument, LIMITS)

    assert found.assessment.grade is Grade.PASS
    np.testing.assert_array_less(np.abs(found.moves[1]), 1.5 * found.uncertainties[1])


def test_a_camera_that_moved_is_told_and_budgeted(
    instrument: Instrument, touching: Touching
) -> None:
    places, moved = np.tile(PAPER_CONE, (4, 1)), np.array([0.1, 0.0, 0.0])
    visits = [
        ("before", touching(places, seed=1, n_frames=5)),
        ("after", touching(places + moved, seed=2, n_frames=5)),
    ]

    found = measure_drift(visits, instrument, LIMITS)

    assert found.assessment.grade is Grade.REPEAT
    assert "between before and after" in str(found.assessment.reason)
    assert found.share[0] == pytest.approx(0.1 / np.sqrt(3), rel=0.1)


def test_a_single_visit_is_refused(instrument: Instrument, touching: Touching) -> None:
    visits = [("before", touching(PAPER_CONE[None]))]

    with pytest.raises(CalibrationError, match="visited once"):
        measure_drift(visits, instrument, LIMITS)


def test_a_move_that_would_not_show_is_not_denied(
    instrument: Instrument, touching: Touching
) -> None:
    touches = touching(PAPER_CONE[None], seed=7)
    visits = [("one", touches), ("two", touches)]
    found = measure_drift(visits, instrument, VerificationLimits(drift=0.001))

    assert not found.moves.any()
    # What both visits share is no part of it; the noise of each is.
    deviations = np.sqrt(2 * np.diag(touches[0].noise))
    np.testing.assert_allclose(found.uncertainties[1], 2 * deviations)
    assert found.assessment.reason.code == "drift.uncertain"
    assert found.assessment.grade is Grade.CHECK
