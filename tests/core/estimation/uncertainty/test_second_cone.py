"""Two swings in cones at a known distance: the scale of the pen and what it says."""

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from lightpen.arrays import FloatArray
from lightpen.detection.observations import Observations, observe_centers
from lightpen.estimation.bundle.priors import ConeSeparation
from lightpen.estimation.calibrate import Calibration, calibrate
from lightpen.estimation.uncertainty.budget import ContributionName
from lightpen.estimation.uncertainty.second_cone import SecondSwing
from lightpen.formats.observation_files import Centers
from lightpen.model.pen import Pen, grown
from lightpen.simulator.swings import (
    PAPER_CONE,
    PAPER_TIP,
    paper_camera,
    paper_pen,
    simulate_centers,
    swing_poses,
)

CAMERA = paper_camera()
PEN = replace(paper_pen(), led_sigma=0.002, scale_sigma=None, expansion=None)
CONES = PAPER_CONE + np.array([[-70.0, 0.0, 0.0], [70.0, 0.0, 10.0]])
DISTANCE = float(np.linalg.norm(CONES[1] - CONES[0]))
N_IMAGES = 40


def seen(
    cone: FloatArray, sigma: float, rng: np.random.Generator, file: Pen
) -> Observations:
    swing = swing_poses(N_IMAGES, rng, cone_cam=cone)
    pixels = simulate_centers(
        CAMERA, PEN, swing.rotations, swing.translations, sigma, rng
    )
    centers = Centers(np.arange(N_IMAGES), pixels, Path("simulated"))
    return observe_centers(centers, CAMERA, file)


def calibrated(
    growth: float, sigma: float, seed: int, distance: float = DISTANCE
) -> Calibration:
    """Return the calibration of two swings by a file whose LEDs are too far apart."""
    file = grown(PEN, growth)
    look = partial(seen, sigma=sigma, rng=np.random.default_rng(seed), file=file)
    first, other = (look(cone) for cone in CONES)
    second = SecondSwing(other, ConeSeparation(distance, 0.002))
    return calibrate(CAMERA, file, first, second=second)


def test_exact_swings_give_the_exact_tip_and_both_cones() -> None:
    result = calibrated(0.0, 0.0, 1)

    np.testing.assert_allclose(result.joint.tip_pen, PAPER_TIP, atol=1e-5)
    assert result.second is not None
    np.testing.assert_allclose(result.joint.cone_cam, CONES[0], atol=1e-4)
    np.testing.assert_allclose(result.second.cone_cam, CONES[1], atol=1e-4)
    assert result.second.n_used == N_IMAGES
    assert len(result.used) == N_IMAGES


def test_the_distance_puts_a_wrong_scale_right_and_names_it() -> None:
    result = calibrated(5e-4, 0.03, 2)

    # 500 ppm put the tip 90 um off; the distance is known to 2 um in 140 mm.
    assert np.linalg.norm(result.joint.tip_pen - PAPER_TIP) < 0.012
    (contradiction,) = result.contradictions
    assert contradiction.of_pen
    assert contradiction.estimated == pytest.approx(1 - 5e-4, abs=3e-5)


def test_the_distance_shrinks_the_uncertainty_and_the_result_says_by_how_much() -> None:
    result = calibrated(0.0, 0.03, 3)

    assert result.second is not None
    before, after = result.second.uncertainty_without, result.second.uncertainty_with
    assert after[1] < 0.9 * before[1]  # y, along which the scale moves the tip
    assert (after <= before + 1e-9).all()
    names = {share.name for share in result.budget.shares}
    assert ContributionName.DISTANCE in names


def test_an_error_of_the_distance_is_held_by_its_share() -> None:
    right, off = (calibrated(0.0, 0.0, 4, DISTANCE + d) for d in (0.0, 0.002))
    moved = np.abs(off.joint.tip_pen - right.joint.tip_pen)
    (share,) = (s for s in right.budget.shares if s.name is ContributionName.DISTANCE)

    np.testing.assert_allclose(moved[1], share.standard_uncertainty[1], rtol=0.02)


def test_no_second_cone_has_nothing_to_say() -> None:
    rng = np.random.default_rng(5)
    assert calibrate(CAMERA, PEN, seen(CONES[0], 0.03, rng, PEN)).second is None
