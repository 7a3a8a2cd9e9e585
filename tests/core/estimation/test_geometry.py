"""LED geometry: its errors are found, corrected and covered, and none are invented."""

from dataclasses import replace

import numpy as np
import pytest
from lightpen.estimation.geometry import GeometryFit, fit_geometry

from lightpen.arrays import FloatArray
from lightpen.estimation.joint import JointFit, fit_joint
from lightpen.model.pen import Pen
from lightpen.model.rigid import fit_rigid
from lightpen.simulator.swings import (
    Swing,
    paper_camera,
    paper_pen,
    perturbed_pen,
    simulate_centers,
    swing_poses,
)

CAMERA = paper_camera()
PEN = paper_pen()
SWING = swing_poses(100, np.random.default_rng(0))


def fits(
    measured: Pen, sigma: float, seed: int, swing: Swing = SWING
) -> tuple[FloatArray, JointFit, GeometryFit]:
    rng = np.random.default_rng(seed)
    pixels = simulate_centers(
        CAMERA, PEN, swing.rotations, swing.translations, sigma, rng
    )
    plain = fit_joint(
        CAMERA, measured, pixels, swing.rotations, swing.tip_pen, swing.cone_cam
    )
    return pixels, plain, fit_geometry(CAMERA, measured, pixels, plain)


def tip_in_frame_of(measured: Pen) -> FloatArray:
    """Return the true tip in the frame in which the measured LEDs fit best."""
    R, t = fit_rigid(PEN.leds, measured.leds)
    return R @ SWING.tip_pen + t


def test_a_true_geometry_is_left_alone() -> None:
    corrected = [fits(PEN, 0.05, seed)[2].led_sigma > 0 for seed in range(20)]

    assert sum(corrected) <= 1  # one in a thousand is expected


def test_led_errors_are_found() -> None:
    measured = perturbed_pen(PEN, 0.01, np.random.default_rng(1))
    _, plain, geometry = fits(measured, 0.01, 2)

    assert 0.006 < geometry.led_sigma < 0.016
    assert geometry.joint.rms < 0.5 * plain.rms
    assert abs(geometry.joint.sigma - 0.01) < 0.001


def test_large_led_errors_do_not_pass_for_image_noise() -> None:
    measured = perturbed_pen(PEN, 0.1, np.random.default_rng(1))
    _, plain, geometry = fits(measured, 0.01, 2)

    assert plain.sigma > 0.1
    # 1400 residuals fix it to 1.9 %.
    assert geometry.joint.sigma == pytest.approx(0.01, rel=0.08)


def test_led_errors_that_hide_in_the_noise_count_all_the_same() -> None:
    swing = swing_poses(30, np.random.default_rng(0))
    center = PEN.leds.mean(axis=0)
    variances = []
    for seed in range(6):
        measured = perturbed_pen(PEN, 0.004, np.random.default_rng(100 + seed))
        geometry = fits(measured, 0.1, seed, swing)[2]
        if geometry.led_sigma == 0:
            variances.append(geometry.led_covariance[1, 1])

    assert len(variances) >= 4
    # They scale the pen, which moves the tip along y.
    by_scale = 0.004 / np.linalg.norm(PEN.leds - center) * (center - SWING.tip_pen)[1]
    assert 0.5 * by_scale < np.sqrt(np.mean(variances)) < 2 * by_scale


def test_the_tip_no_longer_takes_on_led_errors_and_its_covariance_is_honest() -> None:
    plain_errors, errors, predicted = [], [], []
    for seed in range(60):
        rng = np.random.default_rng(100 + seed)
        measured = perturbed_pen(PEN, 0.01, rng)
        _, plain, geometry = fits(measured, 0.02, seed)
        truth = tip_in_frame_of(measured)
        plain_errors.append(plain.tip_pen - truth)
        errors.append(geometry.joint.tip_pen - truth)
        total = geometry.joint.covariance + geometry.led_covariance
        predicted.append(np.diag(total)[:3])
    ratio = np.sqrt(np.mean(np.square(errors), axis=0) / np.mean(predicted, axis=0))

    # Only the pen's scale, which moves the tip along y, cannot be told from images.
    spread = np.std(errors, axis=0) / np.std(plain_errors, axis=0)
    assert spread[0] < 0.7
    assert spread[2] < 0.3
    # 60 draws fix a standard deviation to 9 %; led_sigma itself is found to 15 %.
    assert ((ratio > 0.6) & (ratio < 1.3)).all()


def test_corrections_do_not_move_the_pen_as_a_whole() -> None:
    measured = perturbed_pen(PEN, 0.02, np.random.default_rng(3))
    _, _, geometry = fits(measured, 0.01, 4)

    R, t = fit_rigid(measured.leds, measured.leds + geometry.corrections)

    assert np.abs(R - np.eye(3)).max() < 1e-8
    assert np.abs(t).max() < 1e-6


def test_the_fit_stands_with_the_corrected_leds() -> None:
    measured = perturbed_pen(PEN, 0.02, np.random.default_rng(5))
    pixels, _, geometry = fits(measured, 0.01, 6)
    corrected = replace(measured, leds=measured.leds + geometry.corrections)
    joint = geometry.joint

    again = fit_joint(
        CAMERA, corrected, pixels, joint.rotations, joint.tip_pen, joint.cone_cam
    )

    np.testing.assert_allclose(again.tip_pen, joint.tip_pen, atol=1e-6)
