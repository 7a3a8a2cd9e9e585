"""Tests of the single points of a board that are off their places."""

from collections.abc import Callable

import numpy as np
import pytest

from lightpen.arrays import FloatArray
from lightpen.intrinsics.distortion import fit_camera
from lightpen.intrinsics.unevenness import fit_unevenness
from lightpen.intrinsics.views import BoardTolerances, Views
from lightpen.model.camera import Camera

MakeViews = Callable[..., Views]
NOISE = 0.03  # px, of `make_views`


def beyond_affine(views: Views, off: FloatArray) -> FloatArray:
    """Return what of offsets (N, 2) no affine deformation of the board explains."""
    points = views.board.points[:, :2]
    affine = np.c_[points, np.ones(len(points))]
    return np.asarray(off - affine @ np.linalg.lstsq(affine, off, rcond=None)[0])


def test_points_of_an_uneven_board_are_found_and_noise_is_left(
    make_views: MakeViews, camera: Camera
) -> None:
    views = make_views(n_views=12, uneven=0.1)
    true = np.random.default_rng(27).normal(0, 0.1, (views.board.n_points, 2))
    fit = fit_camera(views, BoardTolerances(), camera)
    off, left = fit_unevenness((views,), [fit])

    error = off[:, :2] - beyond_affine(views, true)
    assert np.sqrt(np.mean(error**2)) < 0.01
    assert left == pytest.approx(NOISE, rel=0.1)
    assert not off[:, 2].any()


def test_two_cameras_see_one_board(make_views: MakeViews, camera: Camera) -> None:
    groups = (make_views(n_views=6, uneven=0.1), make_views(n_views=6, uneven=0.1))
    fits = [fit_camera(views, BoardTolerances(), camera) for views in groups]
    together, left = fit_unevenness(groups, fits)
    alone, _ = fit_unevenness(groups[:1], fits[:1])

    np.testing.assert_allclose(together, alone, atol=1e-3)
    assert left < 1.1 * NOISE
