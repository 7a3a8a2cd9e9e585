"""Tests of two cameras that see one board."""

from dataclasses import replace

import numpy as np
import pytest
from tests.simulated_boards import simulate_board_poses

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.model.camera import Camera
from lightpen.model.rigid import rotation_from_vector
from lightpen_extensions.boards.boards import parse_board
from lightpen_extensions.boards.observing import Views
from lightpen_extensions.boards.pair import PairCalibration, calibrate_pair

TURN = rotation_from_vector(np.array([0.02, -0.2, 0.01]))
SHIFT = np.array([-120.0, 3.0, 12.0])
NAMES = ("left", "right")
NOISE = 0.03  # px


def both_see(
    camera: Camera,
    n_views: int = 14,
    late: float = 0.0,
    stretch: float = 0.0,
    turn: FloatArray = TURN,
    shift: FloatArray = SHIFT,
    moved: float = 0.0,
) -> Views:
    """Return views of a board that moves from view to view, the right one late.

    Between the two exposures of a view it moves at random.
    """
    board = parse_board("chessboard:9x6:20")
    rng = np.random.default_rng(4)
    poses = simulate_board_poses(camera, board, n_views, rng)
    drift = np.linspace(0, 40, n_views)[:, None] * np.array([1.0, 0.2, 0.0])
    pixels = np.full((n_views, 2, board.n_points, 2), np.nan)
    for c, delay in enumerate((0.0, late)):
        speed = np.gradient(poses.translations + drift, axis=0)
        places = poses.translations + delay * speed
        if c == 1 and moved:
            places += np.random.default_rng(8).normal(0, moved, places.shape)
        printed = board.points * [1 + stretch, 1.0, 1.0]
        points = printed @ np.swapaxes(poses.rotations, 1, 2) + places[:, None]
        if c == 1:
            points = points @ turn.T + shift
        pixels[:, c] = camera.project(points)
    pixels += rng.normal(0, NOISE, pixels.shape)
    names = tuple(f"{v}.png" for v in range(n_views))
    return Views(board, names, pixels, (camera.image_size,) * 2)


@pytest.fixture(scope="module")
def found(camera: Camera) -> PairCalibration:
    return calibrate_pair(both_see(camera), NAMES)


def errors(found: PairCalibration) -> FloatArray:
    """Return how far off the second camera is, in standard uncertainties."""
    assert found.rig.covariance is not None
    turn = found.rig.rotations[1] @ TURN.T
    vector = 0.5 * np.array([turn[2, 1], turn[0, 2], turn[1, 0]])
    vector -= 0.5 * np.array([turn[1, 2], turn[2, 0], turn[0, 1]])
    off = np.concatenate([vector, found.rig.translations[1] - SHIFT])
    return np.asarray(off / np.sqrt(np.diag(found.rig.covariance)))


@pytest.mark.slow
def test_the_second_camera_stands_where_it_does(found: PairCalibration) -> None:
    assert np.abs(errors(found)).max() < 3.5  # of six
    assert found.baseline == pytest.approx(np.linalg.norm(SHIFT), abs=0.3)
    assert not found.remarks


@pytest.mark.slow
def test_the_scale_of_the_board_is_part_of_the_baseline(camera: Camera) -> None:
    found = calibrate_pair(both_see(camera), NAMES, scale_sigma=0.01)

    assert found.baseline_sigma == pytest.approx(0.01 * found.baseline, rel=0.05)


@pytest.mark.slow
def test_views_of_one_camera_alone_say_nothing_of_the_place(camera: Camera) -> None:
    turn = rotation_from_vector(np.array([0.0, -1.0, 0.0]))
    middle = np.array([20.0, 0.0, 400.0])
    views = both_see(camera, turn=turn, shift=middle - turn @ middle)
    pixels = views.pixels.copy()
    pixels[9:, 0] = np.nan
    known = replace(camera, covariance=np.diag(np.full(9, 1e-12)))
    found = calibrate_pair(replace(views, pixels=pixels), NAMES, (known, known))

    assert found.n_pairs == 9
    np.testing.assert_allclose(found.rig.rotations[1], turn, atol=1e-3)
    assert np.sqrt(np.nanmean(found.adjustment.view_rms**2)) < 2 * NOISE


@pytest.mark.slow
def test_a_board_numbered_from_its_other_end_is_turned_round(camera: Camera) -> None:
    views = both_see(camera)
    pixels = views.pixels.copy()
    pixels[::2, 1] = pixels[::2, 1, ::-1]
    found = calibrate_pair(replace(views, pixels=pixels), NAMES)

    assert found.n_pairs == views.n_views
    assert np.abs(errors(found)).max() < 3.5


@pytest.mark.slow
def test_a_pair_of_images_of_two_moments_is_left_out(camera: Camera) -> None:
    views = both_see(camera)
    pixels = views.pixels.copy()
    pixels[5, 1] = pixels[8, 1]
    found = calibrate_pair(replace(views, pixels=pixels), NAMES)

    assert found.left_out == ("5.png",)


@pytest.mark.slow
def test_cameras_whose_files_are_given_keep_to_them(camera: Camera) -> None:
    known = replace(camera, covariance=np.diag(np.full(9, 1e-12)))
    found = calibrate_pair(both_see(camera), NAMES, (known, known))

    assert not found.alone
    for own in found.rig.cameras:
        np.testing.assert_allclose(own.intrinsics, camera.intrinsics, atol=1e-4)


@pytest.mark.parametrize(("zoom", "k1"), [(1.1, -0.1), (1.0, 0.6)])
def test_a_file_of_another_lens_is_refused_with_its_camera(
    camera: Camera, zoom: float, k1: float
) -> None:
    known = replace(camera, covariance=np.diag(np.full(9, 1e-12)))
    distortion = np.array([k1, *camera.distortion[1:]])
    other = replace(known, fx=zoom * camera.fx, distortion=distortion)

    with pytest.raises(CalibrationError, match="The intrinsics file of right"):
        calibrate_pair(both_see(camera), NAMES, (known, other))


@pytest.mark.slow
def test_a_board_that_moves_between_exposures_is_in_the_uncertainty_of_the_place(
    camera: Camera, found: PairCalibration
) -> None:
    moved = calibrate_pair(both_see(camera, moved=0.2), NAMES)

    assert np.abs(errors(moved)).max() < 3.5
    assert moved.baseline_sigma > 2 * found.baseline_sigma
    for one, other in zip(moved.rig.cameras, found.rig.cameras, strict=True):
        assert one.covariance is not None
        assert other.covariance is not None
        ratio = np.diag(one.covariance) / np.diag(other.covariance)
        assert np.all(ratio[:4] < 1.5)


def test_too_few_views_of_both_are_refused(camera: Camera) -> None:
    views = both_see(camera)
    pixels = views.pixels.copy()
    pixels[2:, 1] = np.nan
    known = replace(camera, covariance=np.diag(np.full(9, 1e-12)))

    with pytest.raises(CalibrationError, match="in 2 views"):
        calibrate_pair(replace(views, pixels=pixels), NAMES, (known, known))
