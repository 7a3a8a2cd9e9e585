"""Tests of the random effects of board, lens and views."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.intrinsics.distortion import fit_camera
from lightpen.intrinsics.effects import design_of, smooth_functions
from lightpen.intrinsics.start import start_camera
from lightpen.intrinsics.variance_components import MixedFit, _inverse, fit_effects
from lightpen.intrinsics.views import BoardTolerances, Views
from lightpen.model.camera import Camera
from lightpen.model.lens_field import LensField

MakeViews = Callable[..., Views]
NOISE = 0.03  # px, of `make_views`


def fitted(views: Views) -> MixedFit:
    near = start_camera(views, 5)
    return fit_effects(views, fit_camera(views, BoardTolerances(), near))


def uneven(views: Views, camera: Camera, sigma: float, seed: int = 5) -> Views:
    """Return the views of a board whose points are off in its plane, mm."""
    off = np.random.default_rng(seed).normal(0, sigma, (views.board.n_points, 2))
    return moved(views, camera, off)


def moved(views: Views, camera: Camera, off: FloatArray) -> Views:
    """Return the views of a board with points that are off by that, (N, 2), mm."""
    state = fit_camera(views, BoardTolerances(), camera).state
    points = views.board.points.copy()
    points[:, :2] += off
    poses = state.poses

    def seen(points: FloatArray) -> FloatArray:
        return camera.project(
            points @ np.swapaxes(poses.rotations, 1, 2) + poses.translations[:, None]
        )

    shift = seen(points) - seen(views.board.points)
    return replace(views, pixels=views.pixels + shift[:, None])


def through_field(
    views: Views, amplitude: float, seed: int = 6, length: float = 190.0
) -> Views:
    """Return the views through a lens with a residual field."""
    field = LensField.of(*views.image_sizes[0], amplitude, length)
    root = np.linalg.cholesky(field.covariance + 1e-12 * np.eye(len(field.nodes)))
    drawn = np.random.default_rng(seed).normal(size=field.values.shape)
    field = replace(field, values=root @ drawn)
    return replace(views, pixels=views.pixels + field.at(views.pixels))


@pytest.fixture(scope="module")
def plain(make_views: MakeViews) -> MixedFit:
    return fitted(make_views(n_views=20))


def test_noise_alone_is_found_to_be_so(plain: MixedFit) -> None:
    found = plain.components

    assert found.noise == pytest.approx(NOISE, rel=0.05)
    assert found.in_plane < 0.002
    assert found.view < 0.2 * NOISE
    assert plain.fields == (None,)
    assert plain.clustering == pytest.approx(1.0, abs=0.5)


def test_noise_alone_leaves_the_covariance_nearly_as_it_is(
    make_views: MakeViews, plain: MixedFit
) -> None:
    near = start_camera(make_views(n_views=20), 5)
    by_noise = fit_camera(make_views(n_views=20), BoardTolerances(), near)
    at = by_noise.of_intrinsics(0)
    ratio = np.sqrt(np.diag(plain.adjustment.covariance / by_noise.covariance)[at])

    assert np.all(ratio < 1.5)
    assert np.all(ratio > 0.9)


def test_uneven_squares_are_found_and_make_the_camera_better(
    make_views: MakeViews, camera: Camera
) -> None:
    views = uneven(make_views(n_views=20), camera, 0.05)
    found = fitted(views)
    by_noise = fit_camera(views, BoardTolerances(), camera)

    assert found.components.in_plane == pytest.approx(0.05, rel=0.25)
    assert found.components.noise == pytest.approx(NOISE, rel=0.05)
    errors = [
        np.abs(each.state.cameras[0].intrinsics - camera.intrinsics)[:4].max()
        for each in (found.adjustment, by_noise)
    ]
    assert errors[0] < errors[1]


def test_rows_and_columns_that_are_off_as_a_whole_are_found(
    make_views: MakeViews, camera: Camera
) -> None:
    views = make_views(n_views=20)
    rng, board = np.random.default_rng(7), views.board
    off = np.zeros((board.n_points, 2))
    off[:, 0] = np.tile(rng.normal(0, 0.05, board.columns), board.rows)
    off[:, 1] = np.repeat(rng.normal(0, 0.05, board.rows), board.columns)
    found = fitted(moved(views, camera, off)).components

    assert found.lines == pytest.approx(0.05, rel=0.5)
    assert found.in_plane < 0.005


def test_a_lens_field_is_found(make_views: MakeViews) -> None:
    found = fitted(through_field(make_views(n_views=20), 0.06))

    (field,) = found.fields
    assert field is not None
    assert found.field_gain > 20
    assert 0.02 < field.amplitude < 0.3
    assert found.components.noise == pytest.approx(NOISE, rel=0.05)
    assert found.adjustment.rms == pytest.approx(2**0.5 * NOISE, rel=0.05)

    # Most of what leaves the principal point open goes with the field.
    at = found.adjustment.of_intrinsics(0)
    shared, beside = found.adjustment.covariance[at, at], field.intrinsics_covariance
    assert beside is not None
    share = np.diag(beside) / np.diag(shared)
    assert np.all(share < 1.0)
    assert np.all(share[2:4] < 0.3), share


@pytest.mark.slow
def test_fields_far_above_the_noise_leave_errors_as_large_as_stated(
    make_views: MakeViews, camera: Camera
) -> None:
    length, errors = 0.21 * 640, []
    for seed in range(4):
        views = make_views(n_views=20, noise=0.012, seed=seed)
        found = fitted(through_field(views, 0.25, seed + 100, length))
        state, covariance = found.adjustment.state, found.adjustment.covariance
        off = state.cameras[0].intrinsics - camera.intrinsics
        errors.append(off / np.sqrt(np.diag(covariance)[: len(off)]))
        assert found.fields[0] is not None
        assert found.fields[0].length == pytest.approx(length, rel=0.1)

    assert np.sqrt(np.mean(np.square(errors))) < 1.2


def test_smooth_errors_of_single_views_are_found(make_views: MakeViews) -> None:
    views = make_views(n_views=20)
    functions = smooth_functions(views.board)
    drawn = np.random.default_rng(2).normal(0, 0.02, (20, functions.shape[1], 2))
    pulled = replace(views, pixels=views.pixels + (functions @ drawn)[:, None])
    found = fitted(pulled)

    assert found.components.view == pytest.approx(0.02, rel=0.2)
    assert found.components.noise == pytest.approx(NOISE, rel=0.05)


def test_the_normal_equations_are_those_of_the_whole_design(
    make_views: MakeViews,
) -> None:
    """Their columns, view by view, add up to the columns of their sum."""
    views = make_views(n_views=6)
    fit = fit_camera(views, BoardTolerances(), start_camera(views, 5))
    design = design_of(views, fit, 200.0)
    n = design.n_shared

    np.testing.assert_allclose(design.columns.sum(axis=0), design.normal[:, :n])
    np.testing.assert_allclose(design.normal, design.normal.T)


def test_what_effects_leave_open_is_refused() -> None:
    with pytest.raises(CalibrationError, match="do not determine the camera"):
        _inverse(np.diag([1.0, 0.0]))


def test_a_change_of_the_camera_is_in_the_scores_of_the_views_after_it(
    make_views: MakeViews, camera: Camera
) -> None:
    before = make_views(n_views=20)
    after = make_views(n_views=20, of=replace(camera, cx=camera.cx + 3.0))
    which = (np.arange(20) >= 10)[:, None, None, None]
    found = fitted(replace(before, pixels=np.where(which, after.pixels, before.pixels)))
    score, information = found.scores.change(which[:, 0, 0, 0].astype(float))
    at = found.adjustment.of_intrinsics(0)
    covariance = np.linalg.inv(information[at, at])
    difference = covariance @ score[at]

    assert abs(difference[2] - 3.0) < 3 * np.sqrt(covariance[2, 2])
    assert difference[2] > 3 * np.sqrt(covariance[2, 2])
    rest = found.scores.without(which[:, 0, 0, 0].astype(float), at, difference)
    left, _ = rest.change(which[:, 0, 0, 0].astype(float))
    np.testing.assert_allclose(left[at], 0.0, atol=1e-6 * np.abs(score[at]).max())
    assert rest.clustering < found.scores.clustering


def test_residuals_before_a_lens_with_a_field_are_those_of_noise(
    make_views: MakeViews,
) -> None:
    views = make_views(n_views=10, noise=0.015)
    found = fitted(through_field(views, 0.12, seed=101, length=250.0))

    assert found.adjustment.rms == pytest.approx(0.015 * 2**0.5, rel=0.1)
