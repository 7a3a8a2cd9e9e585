"""Tests of `lightpen.verification.tasks.length`."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from lightpen.errors import CalibrationError
from lightpen.estimation.reports.verdict import Grade
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.model.limits import VerificationLimits
from lightpen.simulator.swings import PAPER_CONE, PAPER_TIP
from lightpen.verification.tasks.length import LengthOptions, measure_length
from lightpen.verification.tasks.probed_point import ProbedPoint
from lightpen.verification.tasks.task import Conditions, Surface

Touching = Callable[..., tuple[ProbedPoint, ...]]
LENGTH = 150.0
LIMITS = VerificationLimits()
OPTIONS = LengthOptions(length=LENGTH)
START = PAPER_CONE - np.array([LENGTH / 2, 0, 0])
END = PAPER_CONE + np.array([LENGTH / 2, 0, 0])


def test_a_length_is_measured_within_its_uncertainty(
    instrument: Instrument, touching: Touching
) -> None:
    run = ("here", touching(np.array([START, START, END, END])))

    found = measure_length([run], Conditions(instrument, LIMITS), OPTIONS)

    assert found.assessment.grade is Grade.SCALE
    assert abs(found.errors[0]) < found.uncertainties[0]
    assert [len(end) for end in found.runs[0].ends] == [2, 2]
    assert found.runs[0].along_view < 0.1


def test_a_camera_that_moved_makes_a_length_less_certain_along_it(
    instrument: Instrument, touching: Touching
) -> None:
    run = ("here", touching(np.array([START, END])))

    still, across, along = (
        measure_length(
            [run], Conditions(instrument, LIMITS, drift=np.array(drift)), OPTIONS
        )
        for drift in ([0.0, 0.0, 0.0], [0.0, 0.01, 0.0], [0.01, 0.0, 0.0])
    )

    assert across.uncertainties[0] == pytest.approx(still.uncertainties[0])
    moved = np.hypot(still.uncertainties[0], 2 * 0.01)
    assert along.uncertainties[0] == pytest.approx(moved, rel=1e-3)


@pytest.mark.parametrize("ball_offset", [2.0, -2.0])
def test_at_faces_the_ball_is_compensated_along_the_length(
    instrument: Instrument, touching: Touching, ball_offset: float
) -> None:
    """Between inner faces the ball is short of the ends, on outer ones beyond."""
    run = ("here", touching(np.array([START, START, END, END])))

    plain = measure_length([run], Conditions(instrument, LIMITS), OPTIONS)
    found = measure_length(
        [run],
        Conditions(instrument, LIMITS, ball_diameter=2 * abs(ball_offset)),
        LengthOptions(
            length=LENGTH + 2 * ball_offset,
            surface=Surface.BORE if ball_offset > 0 else Surface.BOSS,
        ),
    )

    assert found.errors[0] == pytest.approx(plain.errors[0], abs=1e-9)
    moved = found.runs[0].ends[1][0].point_cam - plain.runs[0].ends[1][0].point_cam
    outwards = (END - START) / np.linalg.norm(END - START)
    np.testing.assert_allclose(moved, ball_offset * outwards, atol=0.001)


def test_a_pen_that_grew_is_reported_by_the_length(
    instrument: Instrument, touching: Touching
) -> None:
    grown, larger = 5e-4, instrument.covariance.copy()
    leds = instrument.pen.leds - instrument.pen.leds.mean(axis=0)
    at = instrument.parameters.leds
    larger[at, at] += 1e-6 * np.outer(leds, leds)  # the scale is known to 0.1 % only
    unsure = replace(instrument, covariance=larger)
    # A pen of which the file says too little measures too little.
    shrunk = PAPER_CONE / (1 + grown)
    half = np.array([LENGTH / 2 / (1 + grown), 0, 0])
    runs = [
        (
            str(seed),
            touching(np.array([shrunk - half, shrunk + half]), seed=seed, tilt=0.0),
        )
        for seed in range(3)
    ]

    found = measure_length(runs, Conditions(unsure, LIMITS), OPTIONS)

    assert found.scale.factor - 1 == pytest.approx(grown, rel=0.3)
    assert found.scale.uncertainty < 0.2 * found.scale.uncertainty_before
    vague = measure_length(
        runs,
        Conditions(unsure, LIMITS),
        LengthOptions(length=LENGTH, length_uncertainty=0.1),
    )
    # All three are off by what is certified; before that, U is 0.2 %.
    by_length = np.hypot(0.1 / LENGTH, found.scale.uncertainty)
    together = (by_length**-2 + found.scale.uncertainty_before**-2) ** -0.5
    assert vague.scale.uncertainty == pytest.approx(together, rel=0.05)


def test_one_end_touched_twice_is_refused(
    instrument: Instrument, touching: Touching
) -> None:
    run = ("here", touching(np.array([START, START])))

    with pytest.raises(CalibrationError, match="one end was probed again"):
        measure_length([run], Conditions(instrument, LIMITS), OPTIONS)


def test_a_touch_between_the_ends_is_refused_by_its_name(
    instrument: Instrument, touching: Touching
) -> None:
    run = ("here", touching(np.array([START, START + np.array([40, 0, 0]), END])))

    with pytest.raises(CalibrationError, match="more than two positions: touch"):
        measure_length([run], Conditions(instrument, LIMITS), OPTIONS)


def test_a_single_touch_is_refused(instrument: Instrument, touching: Touching) -> None:
    with pytest.raises(CalibrationError, match="needs both its ends"):
        measure_length(
            [("here", touching(START[None]))], Conditions(instrument, LIMITS), OPTIONS
        )


def test_a_length_beyond_its_limit_is_refused(
    instrument: Instrument, touching: Touching
) -> None:
    run = ("here", touching(np.array([START, END]), tip_pen=PAPER_TIP))

    found = measure_length(
        [run], Conditions(instrument, LIMITS), LengthOptions(length=LENGTH + 0.2)
    )

    assert found.assessment.grade is Grade.REPEAT


def test_touches_of_an_end_shrink_the_noise_and_not_what_they_share(
    instrument: Instrument, touching: Touching
) -> None:
    once = touching(np.array([START, END]))
    often = (once[0],) * 4 + (once[1],) * 4

    def uncertainty(touches: tuple[ProbedPoint, ...], by: Instrument) -> float:
        found = measure_length([("here", touches)], Conditions(by, LIMITS), OPTIONS)
        return found.runs[0].uncertainty

    exact = replace(instrument, covariance=0 * instrument.covariance)
    noise = uncertainty(once, exact)
    shared = uncertainty(once, instrument) ** 2 - noise**2
    assert uncertainty(often, exact) == pytest.approx(noise / 2)
    assert uncertainty(often, instrument) ** 2 == pytest.approx(shared + noise**2 / 4)


def test_u_of_the_ball_counts_where_faces_are_touched(
    instrument: Instrument, touching: Touching
) -> None:
    touches = touching(np.array([START, END]))
    conditions = Conditions(instrument, LIMITS, ball_diameter=3.0)

    def uncertainty(surface: Surface, of_ball: float) -> float:
        beyond = 3.0 * (surface is Surface.BORE)
        options = LengthOptions(
            length=LENGTH + beyond, surface=surface, ball_uncertainty=of_ball
        )
        found = measure_length([("here", touches)], conditions, options)
        return float(found.uncertainties[0])

    assert uncertainty(Surface.BORE, 0.02) == pytest.approx(
        np.hypot(uncertainty(Surface.BORE, 0.0), 0.02)
    )
    assert uncertainty(Surface.GROOVE, 0.02) == uncertainty(Surface.GROOVE, 0.0)


def test_a_length_grows_with_the_temperature_of_its_artefact(
    instrument: Instrument, touching: Touching
) -> None:
    runs = [("here", touching(np.array([START, END])))]
    steel = LengthOptions(
        LENGTH, temperature=28.0, temperature_uncertainty=0.5, expansion=11.5
    )

    cold = measure_length(runs, Conditions(instrument, LIMITS), OPTIONS)
    warm = measure_length(runs, Conditions(instrument, LIMITS), steel)

    growth = 11.5e-6 * LENGTH
    assert warm.errors[0] == pytest.approx(cold.errors[0] - 8 * growth)
    # U of the temperature, and a tenth of the coefficient over 8 K.
    known = growth * np.hypot(0.5, 0.8)
    assert warm.certified_uncertainties[0] == pytest.approx(known)
    assert warm.uncertainties[0] == pytest.approx(
        np.hypot(cold.uncertainties[0], known)
    )


def test_each_of_seven_places_has_its_length_and_permissible_error(
    instrument: Instrument, touching: Touching
) -> None:
    middle, along = (START + END) / 2, (END - START) / 2
    sizes = np.array([0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0])
    runs = [
        (str(i), touching(np.array([middle - s * along, middle + s * along]), seed=i))
        for i, s in enumerate(sizes)
    ]
    options = LengthOptions(LENGTH, lengths=tuple(sizes * LENGTH))
    limits = VerificationLimits(length=0.02, length_per_m=0.1)

    found = measure_length(runs, Conditions(instrument, limits), options)

    np.testing.assert_allclose(
        [run.limit for run in found.runs], 0.02 + 1e-4 * sizes * LENGTH
    )
    np.testing.assert_array_less(np.abs(found.errors), found.uncertainties)
    # The verdict is by the place with the largest error for its limit.
    shares = np.abs(found.errors) / [run.limit for run in found.runs]
    assert found.worst is found.runs[int(np.argmax(shares))]
    assert found.assessment.grade is Grade.SCALE
