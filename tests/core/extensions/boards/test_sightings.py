"""Tests of finding boards in images."""

from dataclasses import replace
from functools import cache
from time import process_time

import cv2
import numpy as np
import pytest
from tests.simulated_boards import expose_board, render_board

from lightpen.arrays import FloatArray, Image
from lightpen.errors import CalibrationError, FileError
from lightpen.formats.images import ImageSource
from lightpen.model.camera import Camera
from lightpen.model.ellipse import ellipse_centers
from lightpen.model.rigid import rotation_from_vector
from lightpen_extensions.boards.boards import Board, parse_board
from lightpen_extensions.boards.observing import observe_board
from lightpen_extensions.boards.sightings import (
    EVENED,
    MARKED_WHOLE,
    _evened,
    count_corners,
    find_points,
)
from lightpen_extensions.simulator.scenes import Sensor

SMALL = Camera(
    *(400, 320, 600.0, 599.0, 201.0, 158.0),
    distortion=np.array([-0.1, 0.05, 3e-4, -2e-4, 0.0]),
)
STRAIGHT = replace(SMALL, distortion=np.zeros(5))
TILT = rotation_from_vector(np.array([0.35, -0.3, 0.1]))
# Rms error, px: of 8 bit with shot noise.
LIMITS = {
    "chessboard:9x6:20": 0.008,
    "charuco:7x5:20:14:DICT_4X4_50": 0.012,
    "circles:7x5:20:12": 0.03,
    "asymmetric-circles:4x9:15:14": 0.03,
}


def place(board: Board, filled: float = 0.6) -> FloatArray:
    longer = 2 * float(np.abs(board.points[:, :2]).max())
    return np.array([3.0, -2.0, SMALL.fx * longer / (filled * SMALL.width)])


@cache
def light_of(board: Board, filled: float) -> FloatArray:
    return render_board(SMALL, board, TILT, place(board, filled))


def image_of(board: Board, bits: int = 8, seed: int = 1, filled: float = 0.6) -> Image:
    light = light_of(board, filled)
    sensor = Sensor(bits=12) if bits == 12 else Sensor()
    return expose_board(light, sensor, np.random.default_rng(seed))


def truth(board: Board, filled: float = 0.6) -> FloatArray:
    points = board.points @ TILT.T + place(board, filled)
    if not board.kind.is_circles:
        return SMALL.project(points)
    normals = np.broadcast_to(TILT[:, 2], points.shape)
    return ellipse_centers(SMALL, points, normals, 0.5 * board.detail)


def source_of(*images: Image) -> ImageSource:
    names = tuple(f"{i}.png" for i in range(len(images)))
    return ImageSource(
        names, (), lambda: iter([lambda image=each: image for each in images])
    )


def error_of(points: FloatArray | None, board: Board) -> float:
    assert points is not None
    there = truth(board)
    errors = [np.nanmean((points[order] - there) ** 2) for order in board.orders]
    return float(np.sqrt(min(errors)))


@pytest.mark.slow
@pytest.mark.parametrize("word", LIMITS)
def test_the_points_of_a_board_are_found(word: str) -> None:
    board = parse_board(word)
    points = find_points(image_of(board), board)

    assert error_of(points, board) < LIMITS[word]
    assert points is not None
    assert np.isfinite(points[:, 0]).mean() > 0.9  # a ChArUco board may lack some


@pytest.mark.slow
@pytest.mark.parametrize("word", ["circles:7x5:20:14", "asymmetric-circles:4x9:15:14"])
def test_no_circle_of_a_grid_is_seen_off_its_place(word: str) -> None:
    board = parse_board(word)
    points = board.points @ TILT.T + place(board)
    light = render_board(STRAIGHT, board, TILT, place(board))
    seen = find_points(np.round(60_000 * light).astype(np.uint16), board)
    normals = np.broadcast_to(TILT[:, 2], points.shape)
    there = ellipse_centers(STRAIGHT, points, normals, 0.5 * board.detail)

    assert seen is not None
    off = [np.abs(seen[order] - there).max() for order in board.orders]
    assert min(off) < 0.015


@pytest.mark.parametrize("is_saturated", [False, True])
def test_corners_are_placed_by_all_that_their_edges_show(*, is_saturated: bool) -> None:
    board = parse_board("chessboard:9x6:20")
    light = light_of(board, 0.6)
    uneven = np.linspace(0.4, 1.3, light.shape[1])
    light = np.minimum(2 * light, 1.0) if is_saturated else uneven * light
    image = expose_board(light, Sensor(), np.random.default_rng(1))

    assert error_of(find_points(image, board), board) < 0.012


def test_twelve_bits_tell_no_less_than_eight() -> None:
    board = parse_board("chessboard:9x6:20")
    deep = find_points(image_of(board, bits=12), board)
    flat = find_points(image_of(board), board)

    assert error_of(deep, board) < 1.1 * error_of(flat, board)


def test_markers_in_a_very_large_image_are_found_in_a_smaller_one() -> None:
    word = "charuco:7x5:20:14:DICT_4X4_50"
    board = parse_board(word)
    seen = cv2.resize(image_of(board), None, fx=2, fy=2, interpolation=cv2.INTER_CUBIC)
    large = np.full((4000, 6000), 60, dtype=np.uint8)
    x, y = 1500, 1000
    large[y : y + seen.shape[0], x : x + seen.shape[1]] = seen
    assert large.size > MARKED_WHOLE
    points = find_points(large, board)

    assert points is not None
    assert error_of((points - (x, y) + 0.5) / 2 - 0.5, board) < LIMITS[word]


def test_a_charuco_board_that_is_partly_hidden_is_found() -> None:
    board = parse_board("charuco:7x5:20:14:DICT_4X4_50")
    image = image_of(board)
    image[:, :150] = 30
    points = find_points(image, board)

    assert points is not None
    seen = np.isfinite(points[:, 0])
    assert 6 <= seen.sum() < board.n_points
    assert error_of(points, board) < 0.06


def test_markers_of_a_few_pixels_are_read() -> None:
    board = parse_board("charuco:7x5:20:15:DICT_6X6_250")
    points = find_points(image_of(board, filled=0.3), board)

    assert points is not None
    seen = np.isfinite(points[:, 0])
    assert seen.mean() > 0.8
    assert np.abs(points[seen] - truth(board, 0.3)[seen]).max() < 0.3


def test_circles_in_dim_and_uneven_light_are_found() -> None:
    board = parse_board("circles:7x5:20:12")
    light = np.linspace(0.08, 0.5, SMALL.width)
    points = find_points((image_of(board) * light).astype(np.uint8), board)

    assert error_of(points, board) < 0.1  # of the few levels that are left


def test_uneven_light_is_found_in_a_reduced_image() -> None:
    grain = np.random.default_rng(1).integers(0, 30, (360, 640))
    grey = (np.linspace(60, 200, 640) + grain).astype(np.uint8)
    times = [process_time()]
    around = cv2.GaussianBlur(grey, (0, 0), EVENED * 640)
    times.append(process_time())
    even = _evened(grey)
    times.append(process_time())
    slowly, fast = np.diff(times)

    whole = cv2.normalize(
        cv2.divide(grey, around, scale=128.0), around, 0, 255, cv2.NORM_MINMAX
    )
    assert np.abs(even.astype(float) - whole).mean() < 3.0
    assert fast < 0.3 * slowly


def test_rows_numbered_in_a_mirror_are_put_right() -> None:
    board = parse_board("chessboard:9x6:20")
    mirrored = image_of(board)[:, ::-1].copy()
    points = find_points(mirrored, board)
    assert points is not None
    homography, _ = cv2.findHomography(board.points[:, :2], points)

    assert np.linalg.det(homography) > 0  # seen from ahead


def test_an_image_without_a_board_shows_none() -> None:
    blank = np.full((320, 400), 40, dtype=np.uint8)

    for word in LIMITS:
        assert find_points(blank, parse_board(word)) is None


@pytest.mark.parametrize(
    ("shown", "said", "code"),
    [
        ("chessboard:9x6:20", "chessboard:10x7:20", "intrinsics.other-count"),
        ("chessboard:9x6:20", "chessboard:6x9:20", None),
        ("chessboard:9x6:20", "circles:7x5:20:12", "intrinsics.unseen"),
    ],
)
def test_another_board_than_was_said_is_named(
    shown: str, said: str, code: str | None
) -> None:
    image = image_of(parse_board(shown))
    if code is None:  # a chessboard lies as it likes
        assert find_points(image, parse_board(said)) is not None
        return

    with pytest.raises(CalibrationError) as caught:
        observe_board(source_of(image), parse_board(said), lambda fraction: None)
    assert caught.value.message.code == code


def test_the_corners_of_a_chessboard_are_counted() -> None:
    assert count_corners(image_of(parse_board("chessboard:9x6:20"))) == (9, 6)


def test_a_charuco_board_in_white_on_black_is_found() -> None:
    board = parse_board("charuco:7x5:20:14:DICT_4X4_50")
    image = image_of(board)
    points, others = (find_points(each, board) for each in (255 - image, image))

    assert points is not None
    assert others is not None
    np.testing.assert_allclose(points, others, atol=1e-3)


def test_a_board_of_which_a_part_is_seen_is_not_said_to_be_another() -> None:
    whole = parse_board("chessboard:11x8:20")
    image = image_of(whole, filled=0.75)[:, :250].copy()
    with pytest.raises(CalibrationError) as caught:
        observe_board(source_of(image), whole, lambda fraction: None)
    assert caught.value.message.code == "intrinsics.unseen"


def test_a_mirrored_board_is_said_to_be_so() -> None:
    board = parse_board("charuco:7x5:20:14:DICT_4X4_50")
    mirrored = image_of(board)[:, ::-1].copy()

    with pytest.raises(CalibrationError, match="mirrored"):
        observe_board(source_of(mirrored), board, lambda fraction: None)


def test_images_of_two_sizes_are_refused() -> None:
    board = parse_board("chessboard:9x6:20")
    image = image_of(board)

    with pytest.raises(FileError, match=r"400 x 310 px, 0\.png has 400 x 320"):
        observe_board(
            source_of(image, image[:310].copy()), board, lambda fraction: None
        )


def test_images_in_which_it_is_not_seen_are_named() -> None:
    board = parse_board("chessboard:9x6:20")
    blank = np.full((320, 400), 40, dtype=np.uint8)
    observed = observe_board(
        source_of(image_of(board), blank), board, lambda fraction: None
    )

    assert observed.views.names == ("0.png",)
    assert observed.unseen == ("1.png",)
    assert observed.views.image_sizes == ((400, 320),)


@pytest.mark.parametrize("is_found_quickly", [True, False])
@pytest.mark.parametrize("quarters", [0, 1, 2, 3])
def test_a_board_of_unlike_ends_is_numbered_from_the_same_one_however_it_is_found(
    monkeypatch: pytest.MonkeyPatch, quarters: int, is_found_quickly: bool
) -> None:
    board = parse_board("chessboard:8x5:20")
    if not is_found_quickly:
        missed = (False, None)
        monkeypatch.setattr(cv2, "findChessboardCorners", lambda *_, **__: missed)
    points = find_points(np.rot90(image_of(board), quarters).copy(), board)

    assert points is not None
    there = truth(board)
    for _ in range(quarters):  # as np.rot90: a column becomes a row from below
        sides = SMALL.image_size if _ % 2 == 0 else SMALL.image_size[::-1]
        there = np.stack([there[:, 1], sides[0] - 1 - there[:, 0]], axis=1)
    assert np.abs(points - there).max() < 0.2
