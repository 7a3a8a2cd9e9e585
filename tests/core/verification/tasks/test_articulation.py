"""Tests of `lightpen.verification.tasks.articulation`."""

from collections.abc import Callable

import numpy as np
import pytest

from lightpen.errors import CalibrationError
from lightpen.estimation.reports.verdict import Grade
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.model.limits import VerificationLimits
from lightpen.simulator.swings import PAPER_CONE, PAPER_TIP
from lightpen.verification.tasks.articulation import (
    measure_articulation,
    smallest_diameters,
)
from lightpen.verification.tasks.probed_point import ProbedPoint
from lightpen.verification.tasks.task import Conditions

Touching = Callable[..., tuple[ProbedPoint, ...]]
LIMITS = VerificationLimits()


def in_postures(
    touching: Touching, tip_pen: np.ndarray = PAPER_TIP
) -> list[tuple[str, tuple[ProbedPoint, ...]]]:
    """Five touches in each of five postures."""
    by_seed = [
        touching(np.tile(PAPER_CONE, (5, 1)), seed=seed, tip_pen=tip_pen)
        for seed in range(5)
    ]
    return [(f"posture {i}", tuple(each[i] for each in by_seed)) for i in range(5)]


def test_the_smallest_sphere_holds_all_points_and_touches_some() -> None:
    rng = np.random.default_rng(0)
    octahedron = np.concatenate([np.eye(3), -np.eye(3)])
    triangle = np.array([[0, 0, 0], [1, 0, 0], [0.5, 0.8, 0]])

    assert smallest_diameters(octahedron[None])[0] == pytest.approx(2)
    assert smallest_diameters(triangle[None])[0] == pytest.approx(0.89 / 0.8)
    points = rng.standard_normal((7, 3))
    span = np.linalg.norm(points[:, None] - points[None], axis=2).max()
    assert (
        span <= smallest_diameters(points[None])[0] <= span * np.sqrt(1.5)
    )  # Jung's theorem


def test_a_right_tip_stays_within_what_is_expected(
    instrument: Instrument, touching: Touching
) -> None:
    found = measure_articulation(in_postures(touching), Conditions(instrument, LIMITS))

    assert found.assessment.grade is Grade.PASS
    assert found.location_error < 2.5 * found.expected


def test_a_wrong_tip_wanders(instrument: Instrument, touching: Touching) -> None:
    wrong = PAPER_TIP + np.array([0.4, 0.0, 0.0])

    found = measure_articulation(
        in_postures(touching, wrong), Conditions(instrument, LIMITS)
    )

    assert found.assessment.grade is Grade.REPEAT
    assert found.location_error > 0.1


def test_four_postures_or_four_touches_are_refused(
    instrument: Instrument, touching: Touching
) -> None:
    postures = in_postures(touching)
    with pytest.raises(CalibrationError, match="4 postures, 5 are needed"):
        measure_articulation(postures[:4], Conditions(instrument, LIMITS))
    fewer = [(name, touches[:4]) for name, touches in postures]
    with pytest.raises(CalibrationError, match="posture 0 has 4 usable points"):
        measure_articulation(fewer, Conditions(instrument, LIMITS))


def test_one_posture_five_times_is_refused(
    instrument: Instrument, touching: Touching
) -> None:
    name, touches = in_postures(touching)[0]
    with pytest.raises(CalibrationError, match="postures differ by"):
        measure_articulation([(name, touches)] * 5, Conditions(instrument, LIMITS))


def test_a_lifted_pen_is_named(instrument: Instrument, touching: Touching) -> None:
    postures = in_postures(touching)
    (lifted,) = touching(PAPER_CONE[None] + np.array([0, -20, 0]))
    name, touches = postures[2]
    postures[2] = (name, (*touches[:4], lifted))

    with pytest.raises(CalibrationError, match=r"touch 1 image 1 is 20\.0"):
        measure_articulation(postures, Conditions(instrument, LIMITS))
