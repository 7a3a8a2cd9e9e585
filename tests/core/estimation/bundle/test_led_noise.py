"""The noise of each centre by its detector, and of each LED."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.simulated_centers import calibrate_pixels, simulate_centers

from lightpen.arrays import BoolArray, FloatArray
from lightpen.detection.observations import observe_centers
from lightpen.estimation.bundle.adjustment import find_center_noise, find_led_noise
from lightpen.estimation.calibrate import Calibration, calibrate
from lightpen.estimation.reports.report import calibration_record
from lightpen.formats.observation_files import Centers
from lightpen.formats.opened_files import InputFile, Inputs
from lightpen.model.limits import SwingLimits
from lightpen.record.calibrations import shown_images
from lightpen_extensions.simulator.swings import paper_camera, paper_pen, swing_poses

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


def exact_residuals(
    sigmas: FloatArray, counts: FloatArray
) -> tuple[FloatArray, BoolArray]:
    """Return residuals, (N, 1, L, 2), all of one length, and which are used."""
    used = np.arange(100)[:, None, None] < counts
    return np.tile(sigmas[:, None], (100, 1, 1, 2)), used


@pytest.mark.parametrize("lost", [1.0, 0.5])
def test_the_noise_of_an_led_is_shrunk_by_what_is_not_known_of_it(lost: float) -> None:
    """The fit took a share of the degrees of freedom, and weighed by other noise."""
    sigmas = np.array([0.03, 0.03, 0.03, 0.033, 0.04, 0.06, 0.2, 0.0])
    counts = np.array([100, 60, 80, 90, 100, 40, 5 / lost - 1, 50])
    residuals, used = exact_residuals(sigmas, counts)
    weights = np.linspace(0.5, 2.0, 8)[None]
    weighed = 2 * np.sum(counts.astype(int) * (sigmas / weights[0]) ** 2)
    sigma = np.sqrt(weighed / (2 * np.sum(counts.astype(int)) * lost))

    noise = find_led_noise(residuals, used, float(sigma), weights)

    free = 2 * counts.astype(int) * lost
    known = free >= 10
    assert known.tolist() == 6 * [True] + [False, True]
    logs = np.log(np.maximum(2 * counts * sigmas**2, 1e-12)[known] / free[known])
    logs[-1] = np.log(1e-12)
    scatter = 2 / free[known]
    off = logs - np.median(logs)
    spread = np.mean(off**2 - scatter)
    expected = np.exp(0.5 * off * spread / (spread + scatter))
    assert noise is not None
    np.testing.assert_allclose(noise[0, known], expected, rtol=1e-9)
    assert noise[0, 6] == 1.0


@pytest.mark.parametrize(
    ("noisy", "n_leds", "n_images", "is_told"),
    [
        (1.66, 2, 20, False),  # two LEDs differ so by chance
        (1.71, 2, 20, True),
        (1.25, 10, 1000, False),  # certain, but not worth it
        (1.27, 10, 1000, True),
        (3.0, 1, 100, False),  # an LED alone
    ],
)
def test_noise_is_told_where_it_is_certain_and_worth_a_new_fit(
    noisy: float, n_leds: int, n_images: int, is_told: bool
) -> None:
    sigmas = np.append(noisy, np.ones(n_leds - 1))
    residuals = np.tile(sigmas[:, None], (n_images, 1, 1, 2))
    used = np.ones((n_images, 1, n_leds), bool)

    found = find_led_noise(residuals, used, 1.0, np.ones((1, n_leds)))
    assert (found is not None) == is_told


@pytest.mark.parametrize(("n_centers", "is_told"), [(30, False), (50, True)])
def test_sigmas_of_few_centers_tell_nothing(n_centers: int, is_told: bool) -> None:
    """Two halves that differ by a factor 2: twice n (log cosh log 2) is the gain."""
    factor = np.where(np.arange(n_centers) % 2, 2.0, 0.5)
    gain = 2 * n_centers * np.log(np.cosh(2 * np.log(1.3)))
    assert (gain > 10.83) == is_told
    actual = np.where(np.arange(n_centers) % 2, 1.3, 1 / 1.3)
    used = np.ones((n_centers, 1, 1), bool)
    residuals = np.tile(actual[:, None, None, None], (1, 1, 1, 2))

    found = find_center_noise(residuals, used, factor[:, None, None])
    assert (found is not None) == is_told


def calibrated(sigmas: FloatArray, seed: int) -> tuple[Calibration, FloatArray]:
    rng = np.random.default_rng([27, seed])
    swing = swing_poses(60, rng)
    pixels = simulate_centers(
        CAMERA, PEN, swing.rotations, swing.translations, 0.0, rng
    )
    pixels += sigmas[:, None] * rng.standard_normal(pixels.shape)
    found = calibrate_pixels(pixels, CAMERA, PEN)
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
        by_own, Inputs(FILE, FILE, (FILE,), None), SwingLimits()
    )
    np.testing.assert_array_equal(shown_images(record).sigmas, own.sigmas)
    off = by_own.joint.tip_pen - swing.tip_pen
    assert (np.abs(off) < by_own.budget.expanded_uncertainty[:3]).all()


def of_variances(variances: FloatArray, n_images: int) -> FloatArray:
    """Return residuals whose mean squares are exact, (N, 1, L, 2)."""
    signs = np.where(np.arange(n_images) % 2 == 0, 1.0, -1.0)[:, None, None, None]
    return np.asarray(signs * np.sqrt(variances)[:, None] * np.ones(2))


def test_logarithms_of_variances_are_shrunk_by_what_chance_scatters_them() -> None:
    """An LED in fewer images is shrunk more; the freedom of the fit is 0.9."""
    variances = np.array([1.0, 1.0, 1.0, 1.2, 0.9, 4.0, 6.0])
    counts = 2 * np.array([100, 100, 100, 100, 100, 100, 20])
    used = np.arange(100)[:, None, None] < (counts / 2)[None, None]
    weights = np.array([[1.0, 1.0, 1.0, 1.0, 1.0, 2.0, 2.0]])
    weighed = np.sum(variances * counts / weights[0] ** 2)
    sigma = float(np.sqrt(weighed / counts.sum() / 0.9))

    noise = find_led_noise(of_variances(variances, 100), used, sigma, weights)

    by_chance = 2 / (0.9 * counts)
    logs = np.log(variances / 0.9) - np.median(np.log(variances / 0.9))
    spread = np.mean(logs**2 - by_chance)
    expected = np.exp(0.5 * logs * spread / (spread + by_chance))
    assert noise is not None
    np.testing.assert_allclose(noise[0], expected)


@pytest.mark.parametrize(
    ("one", "is_told"), [(1.0, False), (3.45, False), (3.5, True), (1 / 3.5, True)]
)
def test_an_led_is_told_from_the_others_where_chance_alone_seldom_makes_it(
    one: float, is_told: bool
) -> None:
    """Logarithms of variances scatter by sqrt(2 / 40): the misfit has to be 27.9."""
    variances = np.where(np.arange(10) == 4, one, 1.0)
    used = np.ones((20, 1, 10), bool)
    sigma = float(np.sqrt(variances.mean()))

    noise = find_led_noise(of_variances(variances, 20), used, sigma, EVEN)

    logs = np.log(variances)
    assert (np.sum((logs - logs.mean()) ** 2) * 20 > 27.88) == is_told
    assert (noise is not None) == is_told


def test_an_led_that_is_hardly_noisier_is_not_worth_a_new_fit() -> None:
    """However sure it is: the noise has to be 1.25 times that of another."""
    used = np.ones((10_000, 1, 10), bool)
    for ratio, is_worth in ((1.24, False), (1.26, True)):
        variances = np.where(np.arange(10) == 4, ratio**2, 1.0)
        sigma = float(np.sqrt(variances.mean()))
        noise = find_led_noise(of_variances(variances, 10_000), used, sigma, EVEN)
        assert (noise is not None) == is_worth


def test_two_leds_at_least_have_to_be_seen_often_enough() -> None:
    """Ten degrees of freedom, of five images."""
    for n_seen, is_told in ((4, False), (5, True)):
        used = np.zeros((100, 1, 3), bool)
        used[:, 0, 0] = used[:n_seen, 0, 1] = True
        residuals = of_variances(np.array([1.0, 400.0, 1.0]), 100)
        squares = np.sum(residuals[used] ** 2)
        sigma = 0.999 * float(np.sqrt(squares / (2 * used.sum())))
        noise = find_led_noise(residuals, used, sigma, np.ones((1, 3)))
        assert (noise is not None) == is_told
        if noise is not None:
            assert noise[0, 2] == 1.0


def test_the_power_of_centres_is_that_of_maximum_likelihood() -> None:
    """Two kinds of centres: the ratio of noise is between two powers of that stated."""
    used = np.ones((60, 1, 10), bool)
    used[:, 0, 9] = False
    stated = np.where(np.arange(10) < 5, 1.0, 4.0) * np.ones(used.shape)
    for ratio, power in (
        (4**0.6, 0.5),
        (4**0.65, 0.75),
        (4**0.9, 1.0),
        (4**0.15, 0.25),
    ):
        variances = np.where(np.arange(10) < 5, 1.0, ratio**2)
        noise = find_center_noise(of_variances(variances, 60), used, stated)
        assert noise is not None
        np.testing.assert_allclose(noise, stated**power)
