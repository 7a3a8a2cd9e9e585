"""The residual field of a lens as a Gaussian process on a grid."""

from dataclasses import replace

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.model.camera import Camera
from lightpen.model.coverage import inverse
from lightpen.model.fisheye import LensField, correlation

WIDTH, HEIGHT = 2448, 2048


def scattered(count: int, seed: int = 0) -> FloatArray:
    return np.random.default_rng(seed).uniform(0, 1, (count, 2)) * [WIDTH, HEIGHT]


def test_the_basis_gives_the_values_back_at_the_nodes() -> None:
    field = LensField.of(WIDTH, HEIGHT, 0.02, 400.0)
    np.testing.assert_allclose(
        field.basis(field.nodes), np.eye(len(field.nodes)), atol=1e-3
    )


def test_a_grid_leaves_little_of_a_field_of_its_length() -> None:
    field = LensField.of(WIDTH, HEIGHT, 1.0, 400.0)
    points = scattered(300)
    weights = field.basis(points)
    nodes = correlation(field.nodes, field.nodes, field.length)
    left = 1 - np.einsum("ij,jk,ik->i", weights, nodes, weights)
    # Its root mean square; at the edge it is larger than within.
    assert np.sqrt(np.mean(np.maximum(left, 0))) < 0.02


def test_a_field_that_was_not_measured_varies_by_its_amplitude_everywhere() -> None:
    field = LensField.of(WIDTH, HEIGHT, 0.03, 300.0)
    points = scattered(50)
    np.testing.assert_allclose(
        field.covariance_at(points),
        0.03**2 * correlation(points, points, 300.0),
        atol=1e-8,
    )
    np.testing.assert_array_equal(field.at(points), 0.0)


def test_what_was_measured_lowers_the_covariance_and_sets_the_mean() -> None:
    rng = np.random.default_rng(1)
    prior = LensField.of(WIDTH, HEIGHT, 0.05, 500.0)
    truth = rng.multivariate_normal(
        np.zeros(len(prior.nodes)), prior.covariance, 2, method="eigh"
    ).T
    points = scattered(4000, 2)
    weights, noise = prior.basis(points), 0.03
    seen = weights @ truth + noise * rng.normal(size=(4000, 2))
    information = np.linalg.inv(prior.covariance + 1e-9 * np.eye(len(truth)))
    covariance = inverse(information + weights.T @ weights / noise**2)
    field = replace(
        prior, values=covariance @ weights.T @ seen / noise**2, covariance=covariance
    )
    places = scattered(200, 3)
    off = field.at(places) - prior.basis(places) @ truth
    sigmas = np.sqrt(np.diag(field.covariance_at(places)))
    assert sigmas.max() < 0.01  # px, of 0.05 before
    assert 0.7 < np.sqrt(np.mean((off / sigmas[:, None]) ** 2)) < 1.3


def test_a_camera_takes_the_mean_of_its_field_off_observed_pixels() -> None:
    field = LensField.of(WIDTH, HEIGHT, 0.05, 500.0)
    field = replace(field, values=np.full_like(field.values, 0.04))
    camera = Camera(WIDTH, HEIGHT, 4638.0, 4638.0, 1223.5, 1023.5, lens_field=field)
    seen = np.array([[1000.0, 900.0], [np.nan, np.nan]])
    found = camera.without_lens_field(seen)
    np.testing.assert_allclose(found[0], seen[0] - 0.04, atol=1e-3)
    assert np.isnan(found[1]).all()
    plain = replace(camera, lens_field=None)
    np.testing.assert_array_equal(plain.without_lens_field(seen), seen)
