"""Tests of `lightpen.verification.tasks.articulation`."""

from collections.abc import Callable

import numpy as np
import pytest

from lightpen.errors import CalibrationError
from lightpen.estimation.reports.verdict import Grade
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.model.limits import VerificationLimits
from lightpen.model.rigid import rotation_from_vector
from lightpen.simulator.swings import PAPER_CONE, PAPER_TIP
from lightpen.verification.tasks.articulation import (
    ARTICULATION,
    ArticulationOptions,
    by_posture,
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


def placed(
    offs: np.ndarray, degrees: float = 20.0
) -> list[tuple[str, tuple[ProbedPoint, ...]]]:
    """Points off the cone, five in each of postures that lean to all sides."""
    turns = np.radians(degrees) * np.array([[0, 0, 0], *np.eye(3)[:2], *-np.eye(3)[:2]])
    points = [
        ProbedPoint(
            PAPER_CONE + off, 1e-6 * np.eye(3), *(np.zeros((3, 43)), R, (f"{i}",), 0.0)
        )
        for i, (off, R) in enumerate(
            zip(offs, np.repeat(rotation_from_vector(turns), 5, axis=0), strict=True)
        )
    ]
    return [(f"{i}", tuple(points[5 * i : 5 * i + 5])) for i in range(5)]


@pytest.mark.parametrize(
    ("median", "off", "is_one_point"),
    [
        # Within 0.2 mm, or eight times the median.
        *((0.001, 0.199, True), (0.001, 0.201, False)),
        *((0.1, 0.799, True), (0.1, 0.801, False)),
    ],
)
def test_all_points_are_of_one_place(
    instrument: Instrument, median: float, off: float, is_one_point: bool
) -> None:
    offs = np.zeros((25, 3))
    offs[2:24, 0] = median * (-1.0) ** np.arange(22)
    offs[:2, 1] = off, -off
    conditions = Conditions(instrument, LIMITS)
    if is_one_point:
        found = measure_articulation(placed(offs), conditions)
        ways = offs[:5] - offs[:5].mean(axis=0)
        assert found.spreads[0] == pytest.approx(np.linalg.norm(ways, axis=1).max())
        assert found.uncertainty > found.expected > 0
        return
    with pytest.raises(CalibrationError) as refused:
        measure_articulation(placed(offs), conditions)
    assert refused.value.message.values["distance"] == pytest.approx(
        off - 0.0, abs=2e-3
    )


def test_postures_differ_by_three_degrees_rms(instrument: Instrument) -> None:
    conditions = Conditions(instrument, LIMITS)
    found = []
    for degrees in np.linspace(2.5, 4.5, 20):
        try:
            measure_articulation(placed(np.zeros((25, 3)), degrees), conditions)
            found.append((degrees, True))
        except CalibrationError as error:
            said = error.message.values
            assert said["needed"] == pytest.approx(3.0)
            found.append((degrees, False))
    # Four of five postures lean, so that the axis of the camera turns most.
    least = 3.0 / np.sqrt(0.8)
    assert [enough for _, enough in found] == [each > least for each, _ in found]


@pytest.mark.parametrize(
    ("n_touches", "sizes"), [(25, [5] * 5), (30, [5] * 6), (12, [5, 5, 2, 0, 0])]
)
def test_a_single_run_holds_five_touches_of_each_posture(
    n_touches: int, sizes: list[int]
) -> None:
    touches = [each for _, own in placed(np.zeros((25, 3))) for each in own] * 2
    parted = by_posture([("", touches[:n_touches])])

    assert [len(own) for _, own in parted] == sizes
    assert [name for name, _ in parted] == [
        f"posture {i + 1}" for i in range(len(sizes))
    ]
    assert [each for _, own in parted for each in own] == touches[:n_touches]
    assert by_posture([("a", touches), ("b", touches)])[1] == ("b", touches)


def test_the_simulated_operator_leans_to_four_sides() -> None:
    goals = [ARTICULATION.hand(ArticulationOptions(), run, 3) for run in range(5)]

    assert [goal.tilt for goal in goals] == [0.0, *[0.4] * 4]
    directions = [goal.direction for goal in goals]
    np.testing.assert_allclose(directions, np.pi / 2 * np.arange(5))
