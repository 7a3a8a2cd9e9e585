"""Tests of fisheyes and other wide lenses by views of a board."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from lightpen.arrays import FloatArray
from lightpen.formats.camera_files import read_camera
from lightpen.formats.rig_files import write_camera
from lightpen.model.camera import Camera, LensModel
from lightpen.model.rigid import rotation_from_vector, skew
from lightpen_extensions.boards.boards import parse_board
from lightpen_extensions.boards.calibration import CameraCalibration, calibrate_camera
from lightpen_extensions.boards.distortion import (
    FEW,
    FISHEYE,
    MANY,
    choose_distortion,
    fit_camera,
    map_uncertainty,
)
from lightpen_extensions.boards.observing import Views
from lightpen_extensions.boards.start import start_any_camera
from lightpen_extensions.discover.scaled_start import convert_lens

NOISE = 0.04  # px
WIDE = Camera(
    *(1280, 800, 480.0, 481.0, 645.0, 396.0),
    distortion=np.array([-0.02, 0.01, -0.006, 0.001]),
    lens=LensModel.KANNALA_BRANDT,
)
ROUND = Camera(  # whose corners lie beyond 90 degrees
    *(512, 512, 190.9, 190.8, 254.9, 256.9),
    distortion=np.array([0.0034, 0.0007, -0.002, 0.0002]),
    lens=LensModel.KANNALA_BRANDT,
)

RATIONAL = Camera(
    *(640, 480, 510.6, 511.1, 322.0, 238.0),
    distortion=np.array([0.38, 0.035, -5e-4, 1e-4, 0.0147, 0.764, 0.0858, 0.0329]),
)

ANGLES = np.linspace(0, 2 * np.pi, 90, endpoint=False)
RING = np.c_[np.cos(ANGLES), np.sin(ANGLES), np.zeros(90)]
FOLDING_BEYOND = np.array([0.11, -0.08, 0.36, -0.64])


def held_before(
    camera: Camera,
    n_views: int,
    seed: int,
    least: float = 0.12,
    word: str = "chessboard:9x6:20",
) -> Views:
    """Return views of a board that faces the camera wherever it is held."""
    board = parse_board(word)
    rng, size = np.random.default_rng(seed), np.array(camera.image_size)
    longer = 2 * float(np.abs(board.points[:, :2]).max())
    seen: list[FloatArray] = []
    while len(seen) < n_views:
        place = rng.uniform(least, 1 - least, 2) * size
        ray = np.append(camera.unproject(place), 1.0)
        ray /= np.linalg.norm(ray)
        axis = np.array([-ray[1], ray[0], 0.0]) / np.hypot(*ray[:2])
        facing = rotation_from_vector(axis * np.arccos(ray[2]))
        tilt = rotation_from_vector(np.append(rng.uniform(-0.6, 0.6, 2), 0.0))
        roll = rotation_from_vector(np.array([0, 0, rng.choice([0, np.pi / 2, 0.2])]))
        depth = camera.fx * longer / (rng.uniform(0.3, 0.7) * size.min())
        R = facing @ tilt @ roll
        points = board.points @ R.T + depth * ray
        if np.any(points[:, 2] < 0.06 * np.linalg.norm(points, axis=1)):
            continue
        pixels = camera.project(points)
        if board.kind.is_circles:
            rims = camera.project(points[:, None] + 0.5 * board.detail * RING @ R.T)
            pixels = np.array(
                [cv2.fitEllipse(rim)[0] for rim in rims.astype(np.float32)]
            )
        if np.all((pixels > 5) & (pixels < size - 6)):
            seen.append(pixels + rng.normal(0, NOISE, pixels.shape))
    names = tuple(map(str, range(n_views)))
    return Views(board, names, np.array(seen)[:, None], (camera.image_size,))


@pytest.fixture(scope="module")
def found() -> CameraCalibration:
    return calibrate_camera(held_before(WIDE, 24, 1))


@pytest.mark.slow
def test_a_fisheye_is_taken_for_one(found: CameraCalibration) -> None:
    assert found.camera.lens is LensModel.KANNALA_BRANDT
    assert found.held_out_rms < 1.1 * NOISE * 2**0.5
    assert "Fisheye model" in str(found.choice.message)
    assert not found.remarks


def test_the_truth_of_a_fisheye_lies_within_the_intervals(
    found: CameraCalibration,
) -> None:
    assert found.camera.covariance is not None
    sigmas = np.sqrt(np.diag(found.camera.covariance))

    assert np.all(np.abs(found.camera.intrinsics - WIDE.intrinsics) < 3.5 * sigmas)
    assert map_uncertainty(found.camera, found.camera.covariance).worst < 0.5


def test_circles_before_a_fisheye_are_seen_as_ellipses_about_their_centroids() -> None:
    views = held_before(WIDE, 14, seed=2, word="circles:8x6:25:15")
    fitted = fit_camera(views, WIDE)

    off = fitted.state.cameras[0].intrinsics - WIDE.intrinsics
    assert np.all(np.abs(off) < 3.5 * np.sqrt(np.diag(fitted.covariance)[: len(off)]))


@pytest.mark.slow
def test_a_round_image_is_uncertain_only_where_it_shows_something() -> None:
    found = calibrate_camera(held_before(ROUND, 24, 2))
    assert found.camera.covariance is not None
    uncertain = map_uncertainty(found.camera, found.camera.covariance)

    assert found.camera.lens is LensModel.KANNALA_BRANDT
    assert np.isnan(uncertain.sigmas[0, 0])
    assert uncertain.worst < 1.0


def test_a_fisheye_is_begun_with_where_rows_are_straighter_by_it() -> None:
    start = start_any_camera(held_before(WIDE, 12, 3))

    assert start.lens is LensModel.KANNALA_BRANDT
    assert start.fx == pytest.approx(WIDE.fx, rel=0.3)


def test_another_lens_model_images_nearly_the_same() -> None:
    mild = Camera(
        *(640, 480, 420.0, 421.0, 322.0, 238.0),
        distortion=np.array([-0.2, 0.05, 3e-4, -2e-4, 0.0]),
    )
    fisheye = convert_lens(mild, 4)
    assert fisheye is not None
    directions = mild.unproject(np.array([[100.0, 80.0], [320, 240], [500, 400]]))

    np.testing.assert_allclose(
        fisheye.pixels(directions), mild.pixels(directions), atol=1.0
    )


def test_a_fisheye_that_folds_beyond_its_image_sees_all_of_it() -> None:
    camera = replace(WIDE, fx=1100.0, fy=1100.0, distortion=FOLDING_BEYOND)
    corners = np.array([[0.0, 0.0], [1279.0, 0.0], [640.0, 400.0]])

    assert camera.sees(corners).all()
    assert convert_lens(camera, FEW) is not None


def test_a_camera_that_images_nothing_has_no_other_model() -> None:
    """Its normal equations have no solution, which is no bug of the caller."""
    flat = replace(WIDE, fx=1e-9, fy=1e-9)

    assert convert_lens(flat, MANY) is None


def test_a_fisheye_that_folds_beyond_its_image_is_read_as_written(
    tmp_path: Path,
) -> None:
    camera = replace(WIDE, fx=1100.0, fy=1100.0, distortion=FOLDING_BEYOND)
    write_camera(camera, tmp_path / "camera.yaml")
    found = read_camera(tmp_path / "camera.yaml")

    assert found.lens is LensModel.KANNALA_BRANDT
    np.testing.assert_array_equal(found.intrinsics, camera.intrinsics)


@pytest.fixture(scope="module")
def rational() -> Views:
    """Return views in the middle of the image of a lens of the rational form."""
    return held_before(RATIONAL, 20, 4, least=0.3)


def test_a_lens_that_corners_leave_open_is_not_taken_for_a_changed_camera(
    rational: Views,
) -> None:
    found = calibrate_camera(rational)
    codes = {each.code for each in found.remarks}
    assert codes <= {"intrinsics.uncertain", "camera-validity.fold"}
    assert found.held_out_rms < 1.2 * NOISE * 2**0.5


@pytest.mark.parametrize("seed", [1000, pytest.param(1002, marks=pytest.mark.slow)])
def test_a_lens_is_as_uncertain_as_it_is_off_wherever_views_reach(seed: int) -> None:
    views = held_before(RATIONAL, 24, seed, least=0.08)
    camera = calibrate_camera(views).camera
    assert camera.covariance is not None

    known = map_uncertainty(camera, camera.covariance)
    seen = views.pixels[np.isfinite(views.pixels[..., 0])]
    apart = np.linalg.norm(known.pixels[..., None, :] - seen, axis=-1).min(axis=-1)
    reached = (apart < 20.0) & camera.sees(known.pixels)
    pixels, sigmas = known.pixels[reached], known.sigmas[reached, None]
    directions = RATIONAL.unproject(pixels)
    off = ((camera.pixels(directions) - pixels) / sigmas).ravel()
    points = np.column_stack([directions, np.ones(len(directions))])
    by_turn = camera.project_with_jacobian(points).jacobian @ skew(points)
    by_turn = (by_turn / sigmas[..., None]).reshape(-1, 3)
    off -= by_turn @ np.linalg.lstsq(by_turn, off, rcond=None)[0]
    assert (np.abs(off) < 3).all()


def test_a_plain_lens_is_kept_though_a_fisheye_was_begun_with(
    make_views: Callable[..., Views], camera: Camera
) -> None:
    views, fisheye = make_views(), convert_lens(camera, FISHEYE)
    assert fisheye is not None
    begun = fit_camera(views, fisheye)
    choice, _ = choose_distortion(views, begun, lambda _: None)

    assert choice.n_coefficients == FEW
