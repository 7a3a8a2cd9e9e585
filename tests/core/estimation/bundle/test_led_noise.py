"""The noise of each LED as a variance component."""

from pathlib import Path

import numpy as np
import pytest

from lightpen.arrays import FloatArray
from lightpen.detection.observations import observe_centers
from lightpen.estimation.bundle.led_noise import find_led_noise
from lightpen.estimation.calibrate import Calibration, calibrate
from lightpen.formats.observation_files import Centers
from lightpen.simulator.swings import (
    paper_camera,
    paper_pen,
    simulate_centers,
    swing_poses,
)

CAMERA, PEN = paper_camera(), paper_pen()
EVEN = np.ones((1, 10))


def drawn(sigmas: FloatArray, seed: int = 0, n_images: int = 100) -> FloatArray:
    rng = np.random.default_rng(seed)
    return sigmas[:, None] * rng.standard_normal((n_images, 1, len(sigmas), 2))


def test_leds_that_are_alike_are_not_told_apart() -> None:
    told = [
        find_led_noise(
            drawn(np.full(10, 0.03), seed), np.ones((100, 1, 10), bool), 0.03, EVEN
        )
        for seed in range(50)
    ]
    assert all(noise is None for noise in told)


def test_noisy_leds_are_told_from_usual_ones() -> None:
    sigmas = np.full(10, 0.03)
    sigmas[[2, 7]] = 0.2
    together = float(np.sqrt(np.mean(sigmas**2)))
    noise = find_led_noise(drawn(sigmas), np.ones((100, 1, 10), bool), together, EVEN)
    assert noise is not None
    np.testing.assert_allclose(noise[0], sigmas / 0.03, rtol=0.2)


def test_leds_that_are_hardly_seen_are_taken_as_usual() -> None:
    sigmas = np.array([0.03] * 8 + [0.2, 0.2])
    used = np.ones((100, 1, 10), bool)
    used[3:, :, 9] = False
    together = float(np.sqrt(np.mean(sigmas[:9] ** 2)))
    noise = find_led_noise(drawn(sigmas), used, together, EVEN)
    assert noise is not None
    assert noise[0, 9] == 1.0
    assert noise[0, 8] > 4.0


def calibrated(sigmas: FloatArray, seed: int) -> tuple[Calibration, FloatArray]:
    rng = np.random.default_rng([27, seed])
    swing = swing_poses(60, rng)
    pixels = simulate_centers(
        CAMERA, PEN, swing.rotations, swing.translations, 0.0, rng
    )
    pixels += sigmas[:, None] * rng.standard_normal(pixels.shape)
    centers = Centers(np.arange(60), pixels, Path("simulated"))
    found = calibrate(CAMERA, PEN, observe_centers(centers, CAMERA, PEN))
    return found, found.joint.tip_pen - swing.tip_pen


@pytest.mark.slow
def test_two_noisy_leds_hardly_worsen_the_tip() -> None:
    noisy = np.full(10, 0.03)
    noisy[[1, 8]] = 0.2
    rms = {}
    for name, sigmas in (("noisy", noisy), ("even", np.full(10, 0.03))):
        errors = [calibrated(sigmas, seed)[1] for seed in range(6)]
        rms[name] = float(np.sqrt(np.mean(np.square(errors))))
    # Eight even LEDs are worth little less than ten.
    assert rms["noisy"] < 1.6 * rms["even"]


def test_the_noise_that_weighs_is_that_of_the_usual_leds() -> None:
    noisy = np.full(10, 0.03)
    noisy[[1, 8]] = 0.2
    found, _ = calibrated(noisy, 0)
    assert found.bundle.sigma == pytest.approx(0.03, rel=0.15)
    assert found.bundle.unknowns.noise[0, 8] > 4.0
