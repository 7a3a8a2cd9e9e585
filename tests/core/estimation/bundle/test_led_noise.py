"""The noise of each centre by its detector, and of each LED."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lightpen.arrays import FloatArray
from lightpen.detection.observations import observe_centers
from lightpen.estimation.bundle.led_noise import find_center_noise, find_led_noise
from lightpen.estimation.calibrate import Calibration, calibrate
from lightpen.estimation.reports.report import calibration_record
from lightpen.formats.hashes import InputFile, Inputs
from lightpen.formats.observation_files import Centers
from lightpen.model.limits import SwingLimits
from lightpen.record.calibrations.calibrations import shown_images
from lightpen.simulator.swings import (
    paper_camera,
    paper_pen,
    simulate_centers,
    swing_poses,
)

CAMERA, PEN = paper_camera(), paper_pen()
EVEN = np.ones((1, 10))
FILE = InputFile(Path("simulated"), "0" * 64, b"")


def drawn(sigmas: FloatArray, seed: int = 0, n_images: int = 100) -> FloatArray:
    rng = np.random.default_rng(seed)
    return sigmas[:, None] * rng.standard_normal((n_images, 1, len(sigmas), 2))


def test_leds_that_are_alike_are_not_distinguished() -> None:
    reported = [
        find_led_noise(
            drawn(np.full(10, 0.03), seed), np.ones((100, 1, 10), bool), 0.03, EVEN
        )
        for seed in range(50)
    ]
    assert all(noise is None for noise in reported)


def test_noisy_leds_are_distinguished_from_usual_ones() -> None:
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


@pytest.mark.parametrize(("n_seen", "is_told"), [(8, False), (12, True)])
def test_degrees_of_freedom_that_the_fit_took_tell_nothing_of_an_led(
    n_seen: int, is_told: bool
) -> None:
    """Half of them: what is left of the residuals is as much smaller than the noise."""
    sigmas = np.array([0.03] * 8 + [0.2, 0.2])
    used = np.ones((100, 1, 10), bool)
    used[n_seen:, :, 9] = False
    weights = (sigmas / 0.03)[None]
    residuals = np.sqrt(0.5) * drawn(sigmas)

    noise = find_led_noise(residuals, used, 0.03, weights)

    assert noise is not None
    assert (noise[0, 9] > 2.0) == is_told
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
    assert (found.bundle.unknowns.noise[:, 0, 8] > 4.0).all()


def test_centers_are_weighed_as_far_as_residuals_follow_their_sigmas() -> None:
    used = np.ones((100, 1, 10), bool)
    rng = np.random.default_rng(3)
    stated = 0.03 * np.exp(0.5 * rng.standard_normal(used.shape))
    usual = stated / np.median(stated)
    for power in (0.0, 0.5, 1.0):
        residuals = 0.05 * drawn(np.ones(10)) * usual[..., None] ** power
        noise = find_center_noise(residuals, used, stated)
        if power == 0:
            assert noise is None
        else:
            assert noise is not None
            np.testing.assert_allclose(noise, usual**power, rtol=1e-9)


def test_centers_without_sigmas_count_as_usual() -> None:
    used = np.ones((100, 1, 10), bool)
    stated = np.where(np.arange(10) < 5, 0.01, 0.05) * np.ones(used.shape)
    residuals = drawn(np.where(np.arange(10) < 5, 0.02, 0.1))
    stated[0, 0, 0] = np.nan
    noise = find_center_noise(residuals, used, stated)
    assert noise is not None
    assert noise[0, 0, 0] == 1.0
    np.testing.assert_allclose(noise[1, 0, 9] / noise[1, 0, 0], 5.0)


def test_sigmas_of_centers_sharpen_the_tip_and_are_recorded() -> None:
    rng = np.random.default_rng(28)
    swing = swing_poses(60, rng)
    pixels = simulate_centers(
        CAMERA, PEN, swing.rotations, swing.translations, 0.0, rng
    )
    sigmas = 0.05 * np.exp(0.7 * rng.standard_normal(pixels.shape[:-1]))
    pixels += sigmas[..., None] * rng.standard_normal(pixels.shape)
    alike = observe_centers(
        Centers(np.arange(60), pixels, Path("simulated")), CAMERA, PEN
    )
    own = replace(alike, sigmas=np.where(np.isfinite(pixels[..., 0]), sigmas, np.nan))
    by_own, by_alike = (calibrate(CAMERA, PEN, seen) for seen in (own, alike))
    noise = [
        float(np.trace(found.bundle.independent_noise[:3, :3]))
        for found in (by_own, by_alike)
    ]
    assert noise[0] < 0.8 * noise[1]
    record = calibration_record(
        by_own, Inputs(FILE, FILE, (FILE,), None), "joint", SwingLimits()
    )
    np.testing.assert_array_equal(shown_images(record).sigmas, own.sigmas)
    off = by_own.joint.tip_pen - swing.tip_pen
    assert (np.abs(off) < by_own.budget.expanded_uncertainty[:3]).all()
