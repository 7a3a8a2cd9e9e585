"""The budget: blocks, halves, camera and the weakest direction."""

from dataclasses import replace

import numpy as np
import pytest
from lightpen.estimation.geometry import GeometryFit

from lightpen.arrays import FloatArray
from lightpen.estimation.joint import fit_joint
from lightpen.estimation.uncertainty import combine, compare_halves
from lightpen.simulator.swings import (
    Swing,
    paper_camera,
    paper_pen,
    simulate_centers,
    swing_poses,
)

CAMERA = paper_camera()
PEN = paper_pen()
SWING = swing_poses(100, np.random.default_rng(0))


def noise(seed: int, correlation: float = 0.0) -> FloatArray:
    """Return normal noise whose neighbours in time are correlated, unit variance."""
    rng = np.random.default_rng(seed)
    fresh = rng.standard_normal((100, PEN.n_leds, 2))
    series = fresh.copy()
    for i in range(1, 100):
        series[i] = correlation * series[i - 1] + np.sqrt(1 - correlation**2) * fresh[i]
    return series


def fit(errors: FloatArray, swing: Swing = SWING) -> tuple[FloatArray, GeometryFit]:
    exact = simulate_centers(
        CAMERA,
        PEN,
        swing.rotations,
        swing.translations,
        0.0,
        np.random.default_rng(0),
    )
    pixels = exact + errors
    joint = fit_joint(
        CAMERA, PEN, pixels, swing.rotations, swing.tip_pen, swing.cone_cam
    )
    return pixels, GeometryFit(joint, np.zeros_like(PEN.leds), 0.0, np.zeros((6, 6)))


def of_images(geometry: GeometryFit, some: slice) -> GeometryFit:
    """Return what some of the images say about the same solution."""
    joint = geometry.joint
    part = replace(
        joint,
        rotations=joint.rotations[some],
        residuals=joint.residuals[some],
        used=joint.used[some],
        information=joint.information[some],
        gradients=joint.gradients[some],
    )
    return replace(geometry, joint=part)


def test_blocks_of_independent_noise_scatter_as_that_noise_does() -> None:
    ratios = []
    for seed in range(10):
        pixels, geometry = fit(0.05 * noise(seed))
        for first in range(0, 99, 9):  # three blocks each
            some = slice(first, first + 9)
            budget = combine(CAMERA, PEN, pixels[some], of_images(geometry, some))
            ratios.append(budget.block_ratio)

    # 110 draws of 12 degrees of freedom fix the mean to 4 %.
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.15)


def test_independent_noise_is_hardly_ever_raised() -> None:
    factors = [
        combine(CAMERA, PEN, *fit(0.05 * noise(seed))).correlation_factor
        for seed in range(40)
    ]

    assert np.mean(np.array(factors) > 1) <= 0.1


@pytest.mark.parametrize("correlation", [0.5, 0.9])
def test_correlated_noise_raises_the_uncertainty_to_the_scatter_it_has(
    correlation: float,
) -> None:
    swing = swing_poses(100, np.random.default_rng(0), "operator")
    errors, independent, raised = [], [], []
    for seed in range(60):
        pixels, geometry = fit(0.05 * noise(seed, correlation), swing)
        budget = combine(CAMERA, PEN, pixels, geometry)
        errors.append(geometry.joint.tip_pen - swing.tip_pen)
        independent.append(np.diag(budget.noise)[:3])
        raised.append(np.diag(budget.covariance)[:3])
    scatter = np.mean(np.square(errors), axis=0)

    assert (scatter > 1.5 * np.mean(independent, axis=0)).all()
    # 60 draws fix a variance to 18 %.
    np.testing.assert_allclose(np.mean(raised, axis=0), scatter, rtol=0.5)


def test_halves_differ_as_predicted() -> None:
    outside = 0
    for seed in range(100):
        halves = compare_halves(fit(0.05 * noise(seed))[1].joint)
        beyond = np.abs(halves.difference) > halves.expanded_uncertainty
        outside += int(beyond.sum())

    assert 3 <= outside <= 30  # 4.6 % of 300 lie beyond two standard deviations


def test_halves_agree_with_two_fits_of_half_the_images() -> None:
    pixels, geometry = fit(0.05 * noise(1))
    odd, even = (
        fit_joint(
            CAMERA,
            PEN,
            pixels[k::2],
            SWING.rotations[k::2],
            SWING.tip_pen,
            SWING.cone_cam,
        ).tip_pen
        for k in (0, 1)
    )

    np.testing.assert_allclose(
        compare_halves(geometry.joint).difference, odd - even, atol=2e-4
    )


def test_the_cameras_covariance_moves_the_tip_as_a_changed_camera_does() -> None:
    pixels, geometry = fit(0.001 * noise(2))
    sigmas = np.array([0.5, 0.5, 1.0, 1.0, 1e-4, 1e-3, 1e-5, 1e-5, 0.0])
    joint = geometry.joint
    moved = np.zeros((6, 6))
    for k in range(8):
        values = CAMERA.intrinsics
        values[k] += sigmas[k]
        other = replace(
            CAMERA,
            fx=values[0],
            fy=values[1],
            cx=values[2],
            cy=values[3],
            distortion=values[4:],
        )
        again = fit_joint(
            other, PEN, pixels, joint.rotations, joint.tip_pen, joint.cone_cam
        )
        change = np.hstack(
            [again.tip_pen - joint.tip_pen, again.cone_cam - joint.cone_cam]
        )
        moved += np.outer(change, change)

    known = replace(CAMERA, covariance=np.diag(sigmas**2))
    part = combine(known, PEN, pixels, geometry).camera

    np.testing.assert_allclose(np.diag(part), np.diag(moved), rtol=0.05)


def test_the_uncertainty_is_the_sum_of_its_parts() -> None:
    known = replace(CAMERA, covariance=np.diag([1.0, 1, 1, 1, 1e-8, 1e-6, 0, 0, 0]))
    pixels, geometry = fit(0.05 * noise(8))
    leds = replace(geometry, led_covariance=1e-6 * np.eye(6))
    budget = combine(known, PEN, pixels, leds)

    total = budget.correlation_factor * budget.noise + budget.camera + 1e-6 * np.eye(6)
    assert budget.camera[4, 4] > 1e-8
    np.testing.assert_allclose(budget.covariance, total)
    np.testing.assert_allclose(budget.expanded_uncertainty, 2 * np.sqrt(np.diag(total)))


def test_a_camera_without_covariance_adds_nothing() -> None:
    assert not combine(CAMERA, PEN, *fit(0.01 * noise(3))).camera.any()


def test_too_few_images_for_blocks_are_said_so() -> None:
    pixels, geometry = fit(0.01 * noise(4))

    budget = combine(CAMERA, PEN, pixels[:8], of_images(geometry, slice(8)))

    assert budget.blocks is None
    assert budget.correlation_factor == 1


def test_the_weakest_direction_is_where_the_covariance_is_largest() -> None:
    budget = combine(CAMERA, PEN, *fit(0.05 * noise(5)))
    weakest = budget.weakest_direction
    tip = budget.covariance[:3, :3]

    assert weakest @ tip @ weakest == pytest.approx(np.linalg.eigvalsh(tip)[-1])
    assert budget.weakest_uncertainty == pytest.approx(
        2 * np.sqrt(weakest @ tip @ weakest)
    )
