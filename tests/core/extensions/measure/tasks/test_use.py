"""What acts on a tip while it measures is in the uncertainty of what it measures."""

from dataclasses import replace
from datetime import date

import numpy as np
import pytest
from tests.simulated_centers import simulate_centers

from lightpen.arrays import FloatArray
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.model.bending import ASSUMED, Bending, measured_on
from lightpen.model.limits import USUAL
from lightpen.model.pen import Pen, grown
from lightpen.model.rigid import rig_of, rotations_of
from lightpen_extensions.measure.probing.instruments import in_use, instrument_of_files
from lightpen_extensions.measure.tasks.probed_point import (
    SEATING,
    ProbedPoint,
    ProbingFrame,
    StillFrames,
    joint_covariance,
    measure_touches,
)
from lightpen_extensions.simulator.swings import (
    PAPER_CONE,
    PAPER_TIP,
    paper_camera,
    paper_pen,
)

SIGMA = 0.01  # px
PEN = replace(paper_pen(), led_sigma=0.0, expansion=None)
ALUMINIUM = replace(PEN, expansion=2.3e-5, expansion_sigma=0.0, temperature_c=20.0)
CHI_SQUARE_95 = 7.8147  # of three degrees of freedom
HALF = np.array([150.0, 0.0, 0.0])  # mm
N_TRIALS = 300
TODAY = date(2026, 11, 3)


def exact_files(pen: Pen) -> Instrument:
    """Return the instrument of files without errors but the scale of the pen."""
    found = instrument_of_files(
        rig_of(paper_camera()), pen, PAPER_TIP, np.zeros((3, 3)), SIGMA
    )
    at, covariance = found.parameters, found.covariance.copy()
    for place in (at.diameter, *at.cameras):
        covariance[place, place] = 0.0
    return replace(found, covariance=covariance)


def touched(
    use: Instrument, places: FloatArray, rng: np.random.Generator
) -> tuple[ProbedPoint, ...]:
    """Touch places (N, 3) with a scale and a bending that the swing did not have."""
    n = len(places)
    scale = np.hypot(1e-5, 1.5 * 2.3e-5) * rng.standard_normal()
    tip = PAPER_TIP + ASSUMED * rng.standard_normal() * np.array([0.0, 1.0, 0.0])
    rotations = rotations_of(
        PEN, np.full(n, 0.4), rng.uniform(0, 2 * np.pi, n), rng.uniform(-0.2, 0.2, n)
    )
    held = []
    for place, R in zip(places, rotations, strict=True):
        bending = R @ (ASSUMED * rng.standard_normal(3) * [1.0, 0.0, 1.0])
        t = place + SEATING * rng.standard_normal(3) - bending - R @ tip
        (pixels,) = simulate_centers(
            use.camera, grown(PEN, scale, PAPER_TIP), R[None], t[None], SIGMA, rng
        )
        held.append(StillFrames((ProbingFrame("touch", pixels[None], R, t),)))
    return measure_touches(use, held)


@pytest.mark.slow
def test_points_and_distances_keep_their_coverage_though_each_touch_bends() -> None:
    """300 trials have a deviation of 1.3 %."""
    use, rng = in_use(exact_files(PEN), PEN, USUAL), np.random.default_rng(3)
    places = np.array([PAPER_CONE - HALF, PAPER_CONE + HALF])
    along = np.array([-1.0, 0, 0, 1.0, 0, 0])
    points, distances = [], []
    for _ in range(N_TRIALS):
        both = touched(use, places, rng)
        spread = joint_covariance(both, use)
        errors = np.ravel([t.point_cam for t in both] - places)
        first = errors[:3]
        points.append(first @ np.linalg.solve(spread[:3, :3], first) < CHI_SQUARE_95)
        distances.append(abs(along @ errors) < 1.96 * np.sqrt(along @ spread @ along))

    assert 0.91 < np.mean(points) < 0.985
    assert 0.91 < np.mean(distances) < 0.985


def test_a_pen_of_unknown_temperature_adds_seven_hundredths_to_a_metre() -> None:
    added, bending = in_use(exact_files(PEN), PEN, USUAL).remarks

    assert "adds 0.07 mm per metre" in str(added)
    assert "State both" in str(added)
    assert str(bending) == (
        "Bending (part of U when measuring): 0.004 mm assumed; a press test measures "
        "it."
    )


def test_a_stated_temperature_corrects_the_pen_and_adds_less() -> None:
    files = exact_files(ALUMINIUM)
    found = in_use(files, ALUMINIUM, replace(USUAL, temperature_c=25.0))

    arms = (1 + 5 * 2.3e-5) * (PEN.leds - PAPER_TIP)
    np.testing.assert_allclose(found.pen.leds - PAPER_TIP, arms)
    np.testing.assert_array_equal(found.tip_pen, PAPER_TIP)
    assert "adds 0.03 mm per metre" in str(found.remarks[0])


def test_the_temperature_of_the_swing_is_not_that_of_the_measurement() -> None:
    """A swing that found its own temperature says nothing of another."""
    files = exact_files(ALUMINIUM)
    at, none = files.parameters, np.zeros_like(files.covariance)
    scale = files.scale._replace(
        file_sigma=0.0, thermal_sigma=3e-5, variance=0.0, covariance=none[0]
    )

    found = in_use(replace(files, covariance=none, scale=scale), ALUMINIUM, USUAL)

    arms = (PEN.leds - PAPER_TIP).ravel()
    np.testing.assert_allclose(
        found.covariance[at.leds, at.leds], (1.5 * 2.3e-5) ** 2 * np.outer(arms, arms)
    )


def test_in_a_cone_the_stylus_bends_as_in_its_swing() -> None:
    use = in_use(exact_files(PEN), PEN, USUAL)
    (touch,) = touched(use, PAPER_CONE[None], np.random.default_rng(4))
    without = in_use(exact_files(PEN), PEN, USUAL, Bending(measured_on(TODAY, 0, 1e-9)))
    (unbent,) = touched(without, PAPER_CONE[None], np.random.default_rng(4))

    assert np.trace(touch.noise - touch.seated.noise) == pytest.approx(2 * ASSUMED**2)
    np.testing.assert_allclose(touch.seated.noise, unbent.noise, atol=1e-12)
    np.testing.assert_allclose(use.seated.covariance, without.covariance, atol=1e-12)
