"""How large errors of a kind are: found where they are, and none invented."""

import numpy as np
import pytest

from lightpen.arrays import FloatArray
from lightpen.estimation.variance_components import (
    find_beside,
    find_component,
    find_jitter,
)

N_RUNS = 40


def observed(
    n: int, sigma: float, seed: int, noise: float = 0.01
) -> tuple[FloatArray, FloatArray]:
    """Return what images say of n errors of one size: information and right side."""
    rng = np.random.default_rng(seed)
    A = rng.standard_normal((2 * n, n)) / noise
    errors = sigma * rng.standard_normal(n)
    return A.T @ A, A.T @ (A @ errors + rng.standard_normal(2 * n))


def shaken(
    n_images: int, root: FloatArray, seed: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return what each image says of a vector that is ``root`` times normal numbers."""
    rng = np.random.default_rng(seed)
    A = rng.standard_normal((n_images, 8, 3)) / 0.005
    vectors = rng.standard_normal((n_images, 3)) @ root.T
    seen = np.einsum("nki,ni->nk", A, vectors) + rng.standard_normal((n_images, 8))
    transposed = np.swapaxes(A, 1, 2)
    right = np.einsum("nki,nk->ni", A, seen)
    return transposed @ A, right, np.zeros((n_images, 3, 3))


def test_the_size_of_errors_is_found() -> None:
    found = [find_component(*observed(24, 0.02, seed)).sigma for seed in range(N_RUNS)]

    # 40 draws of 24 errors fix a standard deviation to 2.3 %, a grid of 6 % apart.
    assert np.sqrt(np.mean(np.square(found))) == pytest.approx(0.02, rel=0.08)


def test_errors_far_above_the_noise_are_significant_and_none_hardly_ever() -> None:
    for seed in range(N_RUNS):
        assert find_component(*observed(24, 0.05, seed)).is_significant
    by_chance = [find_component(*observed(24, 0.0, seed)) for seed in range(N_RUNS)]
    assert sum(each.is_significant for each in by_chance) <= 1  # one in a thousand


def test_errors_are_judged_beside_what_the_file_states() -> None:
    for seed in range(N_RUNS):
        stated = find_component(*observed(24, 0.02, seed), stated=0.02)
        assert not stated.is_significant
        assert find_component(*observed(24, 0.1, seed), stated=0.02).is_significant


def test_what_no_image_sees_is_no_evidence() -> None:
    S, right = np.zeros((4, 4)), np.zeros(4)
    S[0, 0], right[0] = 1e4, 0.0

    nothing = find_component(S, right)
    assert (nothing.sigma, nothing.gain) == (0.0, 0.0)


def test_a_jitter_is_found_with_its_directions() -> None:
    root = np.array([[0.01, 0.0, 0.0], [0.0, 0.002, 0.0], [0.006, 0.0, 0.008]])
    found = np.zeros((3, 3))
    for seed in range(N_RUNS):
        jitter = find_jitter(*shaken(60, root, seed)).covariance
        assert jitter is not None
        found += jitter / N_RUNS

    # 2400 vectors fix a variance to 2.9 %; the noise of each image adds to it.
    scale = np.sqrt(np.diag(root @ root.T))
    np.testing.assert_allclose(
        found / np.outer(scale, scale),
        root @ root.T / np.outer(scale, scale),
        atol=0.15,
    )


@pytest.mark.parametrize(("n_images", "n_runs"), [(15, 40), (4, 200)])
def test_a_jitter_of_few_images_is_taken_as_alike_all_round(
    n_images: int, n_runs: int
) -> None:
    variances = []
    for seed in range(n_runs):
        jitter = find_jitter(*shaken(n_images, 0.01 * np.eye(3), seed)).covariance
        assert jitter is not None
        np.testing.assert_array_equal(jitter, jitter[0, 0] * np.eye(3))
        variances.append(jitter[0, 0])

    # The numbers of all runs fix a variance to 3.3 and 2.9 %; those of one jitter
    # raise it by 45 / 43 and 12 / 10.
    raised = 3 * n_images / (3 * n_images - 2)
    assert np.mean(variances) == pytest.approx(0.01**2 * raised, rel=0.12)


def test_a_still_seat_has_no_jitter() -> None:
    still = np.zeros((3, 3))
    found = [find_jitter(*shaken(60, still, seed)) for seed in range(N_RUNS)]

    assert sum(jitter.covariance is not None for jitter in found) <= 1


def test_a_jitter_that_is_not_certain_is_expected_all_the_same() -> None:
    root = 0.001 * np.eye(3)  # images see each vector to 0.002
    found = [find_jitter(*shaken(8, root, seed)) for seed in range(N_RUNS)]

    assert sum(jitter.covariance is None for jitter in found) > N_RUNS / 2
    expected = np.sqrt(np.mean([jitter.expected_sigma**2 for jitter in found]))
    assert 0.5 * 0.001 < expected < 2 * 0.001


def test_what_is_expected_of_errors_is_what_they_are() -> None:
    found = [find_component(*observed(24, 0.02, seed)) for seed in range(N_RUNS)]
    expected = np.sqrt(np.mean([component.expected_sigma**2 for component in found]))
    assert expected == pytest.approx(0.02, rel=0.1)


def test_a_large_jitter_along_a_line_has_an_inverse() -> None:
    root = 20.0 * np.diag([1.0, 0.0, 0.0])
    jitter = find_jitter(*shaken(60, root, 1)).covariance
    assert jitter is not None
    assert np.linalg.cond(jitter) < 2e9  # double precision has 1e16, squared in a fit


LARGEST, N_SCALES = 1.0, 200
SCALES = LARGEST * 1e-5 ** (1 - np.arange(N_SCALES) / (N_SCALES - 1))


def expected_square(squares: FloatArray, costs: FloatArray) -> float:
    """Return the mean square of errors that are 0 in 7 of 10 cases, equation (6)."""
    likely = np.exp(-0.5 * costs)
    prior = np.append(0.7, 0.3 / N_SCALES / (1 + (SCALES / 0.02) ** 2) ** 2)
    return float(np.sum(prior * likely * squares) / np.sum(prior * likely))


@pytest.mark.parametrize("stated", [0.0, 0.003])
@pytest.mark.parametrize("size", [0.0, 0.001, 0.004, 0.3])
def test_errors_that_are_seen_apart_have_the_size_by_their_likelihood(
    size: float, stated: float
) -> None:
    """Each value seen is normal with the variance of its error and of its noise."""
    rng = np.random.default_rng(2)
    noise = np.array([0.001, 0.002, 0.004, 0.003])
    seen = np.append(noise[:2], size) if size == 0 else size * np.array([1, -2, 3])
    turn, _ = np.linalg.qr(rng.standard_normal((5, 5)))
    information = np.append(noise[:3] ** -2.0, [0.0, 0.0])  # two are not seen
    S = turn @ np.diag(information) @ turn.T
    right = turn @ (information * np.append(seen, [1.0, 1.0]))

    found = find_component(0.5 * (S + S.T), right, stated)

    sizes = np.append(stated, SCALES)
    both = noise[:3] ** 2 + sizes[:, None] ** 2
    costs = np.sum(np.log(both) + seen**2 / both, axis=1)
    best = np.argmin(costs)
    assert found.sigma == pytest.approx(sizes[best])
    assert found.gain == pytest.approx(costs[0] - costs[best], abs=1e-6)
    expected = expected_square(sizes**2, costs - costs.min())
    assert found.expected_sigma == pytest.approx(np.sqrt(expected))
    assert found.is_significant == (found.gain > 10.8276)
    assert found.exceeds(0.01) == (found.gain > 6.6349)


def test_errors_beside_others_have_the_size_by_their_likelihood() -> None:
    rng = np.random.default_rng(3)
    root = rng.standard_normal((6, 6)) / 0.002
    information = root @ root.T
    others = np.diag([1e-6, 4e-6, 0.0, 0.0, 0.0, 0.0])
    moves = rng.standard_normal((6, 2))
    seen = moves @ [0.01, -0.02] + rng.multivariate_normal(np.zeros(6), others)

    found = find_beside(information, information @ seen, moves, others)

    sizes = np.append(0.0, SCALES)
    alone = np.linalg.inv(information) + others
    totals = alone + sizes[:, None, None] ** 2 * moves @ moves.T
    misfits = seen @ np.linalg.inv(totals) @ seen
    costs = np.linalg.slogdet(totals)[1] + misfits
    assert found.sigma == pytest.approx(sizes[np.argmin(costs)])
    assert found.gain == pytest.approx(costs[0] - costs.min(), rel=1e-6)


def without_noise(vectors: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    n = len(vectors)
    return np.tile(1e14 * np.eye(3), (n, 1, 1)), 1e14 * vectors, np.zeros((n, 3, 3))


@pytest.mark.parametrize("n_images", [4, 12])
def test_a_jitter_that_is_alike_all_round_is_the_mean_of_what_it_may_be(
    n_images: int,
) -> None:
    """Seen without noise, 3 N numbers tell a variance: chi-square over its mean."""
    corners = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    signs = np.tile(corners, (n_images // 4, 1))
    found = find_jitter(*without_noise(0.01 * signs)).covariance

    assert found is not None
    raised = 3 * n_images / (3 * n_images - 2)
    # Of the scales tried, which are 6 % apart, or 12 % in variance.
    np.testing.assert_allclose(found, 1e-4 * raised * np.eye(3), rtol=0.07, atol=1e-12)


def test_a_jitter_that_is_uneven_is_the_mean_of_what_it_may_be() -> None:
    vectors = np.random.default_rng(5).standard_normal((40, 3)) * [0.01, 0.03, 0.002]
    information, right, nothing = without_noise(vectors)
    leverage = nothing + np.diag([1e-5, 0.0, 1e-6])

    found = find_jitter(information, right, leverage).covariance

    square = vectors.T @ vectors / 40 + leverage[0]
    assert found is not None
    np.testing.assert_allclose(found, square * 40 / 36, rtol=1e-4, atol=1e-9)


def test_a_jitter_that_is_not_found_is_expected_by_its_likelihood() -> None:
    noise = np.array([1.0, 2.0, 4.0]) * 1e-3
    vectors = np.outer([1.0, -1.0, 0.5, 0.5, -1.0], noise)
    information = np.tile(np.diag(noise**-2.0), (5, 1, 1))
    found = find_jitter(information, vectors * noise**-2.0, np.zeros((5, 3, 3)))

    sizes = np.append(0.0, SCALES[::4])
    both = noise**2 + sizes[:, None, None] ** 2
    costs = np.sum(np.log(both) + vectors**2 / both, axis=(1, 2))
    likely = np.exp(-0.5 * (costs - costs.min()))
    prior = np.append(0.7, 0.3 / 50 / (1 + (sizes[1:] / 0.02) ** 2) ** 2)
    expected = np.sum(prior * likely * sizes**2) / np.sum(prior * likely)
    assert found.covariance is None
    assert found.expected_sigma == pytest.approx(np.sqrt(expected))
