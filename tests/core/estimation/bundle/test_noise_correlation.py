"""Noise that lasts from image to image: measured, and carried to the tip."""

from dataclasses import replace
from functools import cache
from itertools import product

import numpy as np
import pytest
from tests.simulated_calibrations import CAMERA, PEN, lasting, observed

from lightpen.arrays import FloatArray
from lightpen.estimation.bundle.noise_correlation import lag1
from lightpen.estimation.calibrate import Calibration, calibrate
from lightpen.estimation.reports.report_warnings import warnings_of
from lightpen.estimation.uncertainty.budget import ContributionName
from lightpen.model.pen import Pen
from lightpen_extensions.simulator.swings import Swing, swing_poses


def calibrated(swing: Swing, errors: FloatArray, pen: Pen = PEN) -> Calibration:
    return calibrate(CAMERA, pen, observed(swing, errors, CAMERA, pen))


@cache
def of_noise(n_images: int, coefficient: float, seed: int) -> tuple[Swing, Calibration]:
    swing = swing_poses(n_images, np.random.default_rng(seed))
    return swing, calibrated(swing, 0.03 * lasting(seed, coefficient, n_images))


@pytest.mark.slow
@pytest.mark.parametrize("coefficient", [0.5, 0.9])
def test_the_coefficient_is_found_though_the_fit_takes_most_of_it(
    coefficient: float,
) -> None:
    found = [
        of_noise(60, coefficient, seed)[1].budget.autocorrelation for seed in range(10)
    ]

    assert np.mean(found) == pytest.approx(coefficient, abs=0.1)


@pytest.mark.slow
def test_independent_noise_is_taken_as_such() -> None:
    results = [of_noise(30, 0.0, seed)[1].budget for seed in range(20)]

    # One in a hundred by the autocorrelation, one by the blocks.
    assert sum(budget.correlation_factor > 1 for budget in results) <= 2


@pytest.mark.slow
@pytest.mark.parametrize("coefficient", [0.25, 0.9])
def test_u_covers_the_tip_whose_noise_lasts(coefficient: float) -> None:
    inside = []
    for n_images, seed in product((10, 30, 60), range(8)):
        swing, result = of_noise(n_images, coefficient, seed)
        error = np.abs(result.joint.tip_pen - swing.tip_pen)
        inside.append(error <= result.budget.expanded_uncertainty[:3])

    # 95 % of 72, less three standard deviations of 2.6 %. Where the correlation is not
    # measured, the scatter between blocks alone covers 78 %.
    assert np.mean(inside) >= 0.87


@pytest.mark.slow
def test_noise_that_lasts_is_not_counted_again_as_errors_of_leds_and_drift() -> None:
    ratios, warned = [], []
    for seed in range(5):
        swing = swing_poses(60, np.random.default_rng(seed))
        unstated = replace(PEN, led_sigma=None)
        result = calibrated(swing, 0.03 * lasting(seed, 0.9, 60), unstated)
        # Fitted as if the LEDs were off, which takes noise out of the tip.
        assert result.bundle.components.leds.sigma > 0.001
        of = {
            share.name: float(np.linalg.norm(share.standard_uncertainty))
            for share in result.budget.shares
        }
        ratios.append(of.get(ContributionName.LEDS, 0.0) / of[ContributionName.NOISE])
        warned += [each.code for each in warnings_of(result)]

    assert np.mean(ratios) < 0.2
    assert "warning.drift" not in warned


def test_an_led_that_is_not_used_has_no_part_in_the_correlation() -> None:
    residuals = lasting(1, 0.9, 200)
    used = np.ones((200, PEN.n_leds), dtype=bool)
    used[:, 0] = False
    residuals[:, 0] = np.nan

    # 3600 pairs, of which one in ten is new.
    assert lag1(residuals, used) == pytest.approx(0.9, abs=0.05)


def test_images_without_neighbours_tell_no_correlation() -> None:
    used = np.zeros((20, PEN.n_leds), dtype=bool)
    used[::2] = True

    assert lag1(lasting(1, 0.9, 20), used) == 0.0
