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
from lightpen.estimation.uncertainty.second_cone import SecondSwing
from lightpen.formats.observation_files import Centers
from lightpen.model.pen import Pen, grown
from lightpen_extensions.simulator.swings import (
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
    """Return the calibration of two swings by a file whose LEDs are too far apart.

    They are so from the tip, which keeps its place.
    """
    file = grown(PEN, growth, PAPER_TIP)
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


def test_the_distance_tells_a_wrong_scale_which_does_not_move_the_tip() -> None:
    result = calibrated(5e-4, 0.03, 2)

    assert np.linalg.norm(result.joint.tip_pen - PAPER_TIP) < 0.012
    (contradiction,) = result.contradictions
    assert contradiction.of_pen
    assert contradiction.estimated == pytest.approx(1 - 5e-4, abs=3e-5)


def test_the_distance_tells_the_scale_and_how_well() -> None:
    right, off = (calibrated(0.0, 0.0, 4, DISTANCE + d).second for d in (0.0, 0.002))

    assert right is not None
    assert off is not None
    assert right.scale == pytest.approx(0.0, abs=1e-7)
    # The file is taken as known to 36 ppm, the distance to 14, with 2 um of the LEDs.
    known = 3.6e-5**-2 + (0.002 / DISTANCE) ** -2
    assert off.scale == pytest.approx((DISTANCE / 0.002) / known, rel=0.1)
    assert 2 / np.sqrt(known) < off.scale_uncertainty < 2.5 / np.sqrt(known)


def test_no_second_cone_has_nothing_to_say() -> None:
    rng = np.random.default_rng(5)
    assert calibrate(CAMERA, PEN, seen(CONES[0], 0.03, rng, PEN)).second is None
