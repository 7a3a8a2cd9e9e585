"""Tests of the bundle adjustment of a board."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from lightpen.model.camera import Camera
from lightpen_extensions.boards.adjustment import (
    N_SHAPE,
    BoardFit,
    BoardState,
    adjust_board,
    fit_board_poses,
)
from lightpen_extensions.boards.observing import Views
from lightpen_extensions.boards.start import start_board_poses, start_camera

MakeViews = Callable[..., Views]

EXACT = 1e-6  # px


def fitted(views: Views, n: int = 5) -> BoardFit:
    camera = start_camera(views, n)
    poses = start_board_poses(camera, views)
    state = BoardState(
        (camera,), np.eye(3)[None], np.zeros((1, 3)), poses, np.zeros(N_SHAPE)
    )
    return adjust_board(views, state)


@pytest.mark.parametrize(
    "word", ["chessboard:9x6:20", "circles:9x6:20:12", "asymmetric-circles:4x11:20:16"]
)
def test_exact_points_give_the_exact_camera(
    make_views: MakeViews, camera: Camera, word: str
) -> None:
    found = fitted(make_views(word, noise=0.0))

    assert found.rms < EXACT
    np.testing.assert_allclose(
        found.state.cameras[0].intrinsics[:4], camera.intrinsics[:4], atol=1e-3
    )


def test_the_jacobian_agrees_with_differences(make_views: MakeViews) -> None:
    # Of an exact fit the score of a state beside it is its information times the way.
    found = fitted(make_views(noise=0.0, n_views=6))
    views = make_views(noise=0.0, n_views=6)
    steps = 1e-4 * np.sqrt(np.diag(found.covariance)) / found.sigma
    at = found.of_intrinsics(0)

    for k in range(at.start, at.stop):
        step = np.zeros(at.stop)
        step[k] = steps[k]
        camera = found.state.cameras[0]
        camera = camera.with_intrinsics(camera.intrinsics + step)
        beside = replace(found.state, cameras=(camera,))
        residuals = fit_board_poses(views, beside).residuals
        grown = float(np.nansum(residuals**2))
        expected = step @ found.information.sum(axis=0)[at, at] @ step
        assert grown == pytest.approx(expected, rel=0.02)


@pytest.mark.slow
def test_the_covariance_agrees_with_the_scatter_of_fits(
    make_views: MakeViews, camera: Camera
) -> None:
    found = [fitted(make_views(n_views=10, seed=seed)) for seed in range(40)]
    at = found[0].of_intrinsics(0)
    errors = np.array([f.state.cameras[0].intrinsics for f in found])
    errors -= camera.intrinsics
    stated = np.array([np.sqrt(np.diag(f.covariance)[at]) for f in found])
    deviations = errors / stated

    # The mean square of 40 normal deviations is 1 to 0.22; three times that, of nine.
    assert np.all(np.abs(np.mean(deviations**2, axis=0) - 1) < 0.67)


def test_a_bent_and_stretched_board_is_found_to_be_so(
    make_views: MakeViews, camera: Camera
) -> None:
    shape = np.array([2e-3, -1e-3, 0.3, -0.1, 0.15])
    found = fitted(make_views(shape=shape, noise=0.0))

    # The priors pull by their weight beside that of points that are nearly exact.
    np.testing.assert_allclose(found.state.shape, shape, atol=1e-4)
    np.testing.assert_allclose(
        found.state.cameras[0].intrinsics[:4], camera.intrinsics[:4], atol=0.01
    )
