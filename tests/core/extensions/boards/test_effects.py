"""Tests of the effects of board and lens, and of the covariance by views."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.model.camera import Camera
from lightpen.model.fisheye import LensField
from lightpen_extensions.boards.adjustment import fit_board_poses
from lightpen_extensions.boards.distortion import fit_camera
from lightpen_extensions.boards.effects import MixedFit, _inverse, fit_effects
from lightpen_extensions.boards.observing import Views
from lightpen_extensions.boards.start import start_board_poses, start_camera

MakeViews = Callable[..., Views]
NOISE = 0.03  # px, of `make_views`


def fitted(views: Views) -> MixedFit:
    near = start_camera(views, 5)
    return fit_effects(views, fit_camera(views, near))


def uneven(views: Views, camera: Camera, sigma: float, seed: int = 5) -> Views:
    """Return the views of a board whose points are off in its plane, mm."""
    off = np.random.default_rng(seed).normal(0, sigma, (views.board.n_points, 2))
    return moved(views, camera, off)


def moved(views: Views, camera: Camera, off: FloatArray) -> Views:
    """Return the views of a board with points that are off by that, (N, 2), mm."""
    state = fit_camera(views, camera).state
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
    assert plain.field is None


def test_noise_alone_leaves_the_covariance_nearly_as_it_is(
    make_views: MakeViews, plain: MixedFit
) -> None:
    near = start_camera(make_views(n_views=20), 5)
    by_noise = fit_camera(make_views(n_views=20), near)
    at = by_noise.of_intrinsics(0)
    ratio = np.sqrt(np.diag(plain.adjustment.covariance / by_noise.covariance)[at])

    assert np.all(ratio < 1.8)
    assert np.all(ratio > 0.8)


def test_uneven_squares_are_found_and_make_the_camera_better(
    make_views: MakeViews, camera: Camera
) -> None:
    views = uneven(make_views(n_views=20), camera, 0.05)
    found = fitted(views)
    by_noise = fit_camera(views, camera)

    assert found.components.in_plane == pytest.approx(0.05, rel=0.25)
    assert found.components.noise == pytest.approx(NOISE, rel=0.05)
    errors = [
        np.abs(each.state.cameras[0].intrinsics - camera.intrinsics)[:4].max()
        for each in (found.adjustment, by_noise)
    ]
    assert errors[0] < errors[1]


def test_a_lens_field_is_found(make_views: MakeViews) -> None:
    found = fitted(through_field(make_views(n_views=20), 0.06))

    field = found.field
    assert field is not None
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
        assert found.field is not None

    assert np.sqrt(np.mean(np.square(errors))) < 1.2


def test_errors_that_a_view_has_to_itself_enlarge_the_covariance(
    make_views: MakeViews, plain: MixedFit
) -> None:
    views = make_views(n_views=20)
    flat = views.board.points[:, :2]
    x, y = (flat / np.abs(flat).max(axis=0)).T
    functions = np.stack([x * x, x * y, y * y], axis=-1)
    drawn = np.random.default_rng(2).normal(0, 0.06, (20, 3, 2))
    pulled = replace(views, pixels=views.pixels + (functions @ drawn)[:, None])
    found = fitted(pulled)

    at = found.adjustment.of_intrinsics(0)
    both = (np.diag(each.adjustment.covariance)[at] for each in (found, plain))
    stated, before = map(np.sqrt, both)
    assert np.all(stated[:2] > 1.5 * before[:2])


def test_a_view_is_predicted_by_the_others_as_by_a_fit_of_them(
    make_views: MakeViews, camera: Camera
) -> None:
    views = make_views(n_views=8, uneven=0.05)
    every = fitted(views).held_out
    alone = np.arange(8) == 3
    others = fitted(views.chosen(~alone)).adjustment
    poses = start_board_poses(camera, views.chosen(alone))
    state = replace(others.state, poses=poses)

    expected = fit_board_poses(views.chosen(alone), state).rms
    assert every[3] == pytest.approx(expected, rel=0.05)


def test_what_effects_leave_open_is_refused() -> None:
    with pytest.raises(CalibrationError, match="do not determine the camera"):
        _inverse(np.diag([1.0, 0.0]))


def test_residuals_before_a_lens_with_a_field_are_those_of_noise(
    make_views: MakeViews,
) -> None:
    views = make_views(n_views=10, noise=0.015)
    found = fitted(through_field(views, 0.12, seed=101, length=250.0))

    assert found.adjustment.rms == pytest.approx(0.015 * 2**0.5, rel=0.1)
