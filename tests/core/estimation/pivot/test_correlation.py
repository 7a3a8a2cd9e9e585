"""Covariance of correlated residuals: true for white and for drifting noise."""

import numpy as np
import pytest
from tests.simulated_centers import correlated_noise
from tests.simulated_swings import swing_of_kind

from lightpen.arrays import FloatArray
from lightpen.estimation.pivot.pivot import contact_matrix
from lightpen.estimation.pivot_calibration import correlated_covariance
from lightpen_extensions.simulator.swings import swing_poses

SWING = swing_of_kind(150, np.random.default_rng(0), "operator")
DESIGN = contact_matrix(SWING.rotations)
INVERSE = np.linalg.inv(np.einsum("nki,nkj->ij", DESIGN, DESIGN))
N_DRAWS = 80


def solve(noise: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the error of a fit whose equations have this noise, and its residuals."""
    error = INVERSE @ np.einsum("nki,nk->i", DESIGN, noise)
    return error, DESIGN @ error - noise


@pytest.mark.slow
@pytest.mark.parametrize(("correlation", "most"), [(0.0, 1.8), (0.9, 3.0)])
def test_the_covariance_agrees_with_the_scatter_of_many_fits(
    correlation: float, most: float
) -> None:
    squares, predicted = np.empty((2, N_DRAWS, 6))
    for seed in range(N_DRAWS):
        noise = correlated_noise(150, correlation, np.random.default_rng(seed))
        error, residuals = solve(noise)
        squares[seed] = error**2
        predicted[seed] = np.diag(correlated_covariance(DESIGN, residuals))

    ratio = predicted.mean(axis=0) / squares.mean(axis=0)
    # The variance of 80 draws is itself known to sqrt(2 / 80) = 16 %. At 0.9 the 150
    # poses are worth eight, which cannot tell their correlation: that widens U.
    assert np.all((ratio > 0.65) & (ratio < most))
    # Two standard deviations cover 95 %, which 80 draws tell to 2.4 %.
    assert np.mean(squares < 4 * predicted, axis=0).min() > 0.87


def test_noise_may_differ_from_direction_to_direction() -> None:
    design = contact_matrix(swing_poses(150, np.random.default_rng(0)).rotations)
    inverse = np.linalg.inv(np.einsum("nki,nkj->ij", design, design))
    sigma = np.array([0.01, 1.0, 0.1])
    noise = sigma * correlated_noise(150, 0.0, np.random.default_rng(1))
    error = inverse @ np.einsum("nki,nk->i", design, noise)

    covariance = correlated_covariance(design, design @ error - noise)

    scores = np.einsum("nki,k,nkj->ij", design, sigma**2, design)
    # 150 poses tell a variance to 12 %.
    np.testing.assert_allclose(
        np.diag(covariance), np.diag(inverse @ scores @ inverse), rtol=0.3
    )


def test_residuals_count_for_what_was_stated_at_least() -> None:
    _, residuals = solve(0.1 * correlated_noise(150, 0.0, np.random.default_rng(2)))

    covariance = correlated_covariance(DESIGN, residuals, least=1.0)

    # The scores come from the swing's frequencies, which tell 99 % of the design.
    np.testing.assert_allclose(np.diag(covariance), np.diag(INVERSE), rtol=0.2)


def test_exact_equations_leave_no_doubt() -> None:
    covariance = correlated_covariance(DESIGN, np.zeros((150, 3)))

    assert np.sqrt(np.diag(covariance)).max() < 1e-11
