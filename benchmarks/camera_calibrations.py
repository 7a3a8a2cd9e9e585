"""Cameras calibrated by boards: the image set, and intervals by Monte Carlo."""

import time
from dataclasses import replace
from functools import partial
from math import comb
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
import numpy as np
from benchmarks.board_trials import Trial, run_trial
from benchmarks.held_out_views import held_out_rows
from benchmarks.rows import Row, numbers, without_data
from benchmarks.workers import Workers
from tests.simulated_boards import expose_board, render_board, simulate_board_poses
from tests.simulated_centers import simulate_centers

from lightpen.arrays import FloatArray
from lightpen.detection.observations import observe_centers
from lightpen.errors import CalibrationError
from lightpen.estimation.calibrate import calibrate
from lightpen.formats.camera_files import read_camera
from lightpen.formats.images import find_images
from lightpen.formats.observation_files import Centers
from lightpen.model.camera import Camera
from lightpen.model.limits import Assumptions
from lightpen_extensions.boards.boards import Board, parse_board
from lightpen_extensions.boards.calibration import calibrate_camera
from lightpen_extensions.boards.observing import Views, observe_board
from lightpen_extensions.simulator.scenes import Sensor
from lightpen_extensions.simulator.swings import paper_camera, paper_pen, swing_poses

SET_BOARD = "chessboard:11x8:20"
FOCAL_LIMIT, CENTER_LIMIT, RMS_LIMIT, N_VIEWS = 0.15, 0.4, 0.03, 24  # px
N_TRIALS, N_SETS = 120, 120  # some six minutes on two cores
OF_HALVES = 0.9, 1.1
N_SMALL, MOST_TIMES = 29, 5.0  # views; times the processor time of OpenCV
N_PARTS = 12
REFINING = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_COUNT, 30, 1e-3)
CORNER_NOISE, LED_NOISE, N_IMAGES = 0.03, 0.03, 60  # px
# All that enters the tip's U but the camera and the noise.
TINY = 1e-9
NOTHING_ELSE = Assumptions(warmth=TINY, form_error=0.0, center_bias=0.0)
NORMAL_95 = 1.959964
COVERED = (93.0, 97.0)  # per cent
CHANCE = 0.99  # of a coverage of 95 % in so many trials; a row has three
STREAM = 23  # of the seeds
SMALL_BOARD = "chessboard:8x6:20"
SMALL = Camera(
    *(640, 360, 700.0, 699.7, 321.2, 178.3),
    distortion=np.array([-0.12, 0.08, 0.0003, -0.0002, 0.0]),
)


def camera_calibration_rows(workers: Workers, data: Path | None) -> list[Row]:
    """Return what calibrations by a board reach."""
    parts = list(range(N_PARTS))
    trials = workers.map(partial(run_trial, rendered=True), range(N_SETS))
    tips = np.concatenate(workers.map(_tip_deviations, parts))
    return [
        *(without_data("`chessboard`") if data is None else [_of_set(data)]),
        *_lens_rows(trials),
        _covered(
            f"Tip x y z with {len(tips)} cameras calibrated so, by the noise of the "
            "estimate and the camera, the only errors drawn here",
            tips,
        ),
        *held_out_rows(workers, data),
        *([] if data is None else workers.call(partial(_time_rows, data))),
    ]


def _of_set(data: Path) -> Row:
    truth = read_camera(data / "chessboard" / "camera_truth.yaml")
    source = find_images(str(data / "chessboard"))
    observed = observe_board(source, parse_board(SET_BOARD), lambda fraction: None)
    found = calibrate_camera(observed.views)
    assert found.camera.covariance is not None
    errors = found.camera.intrinsics - truth.intrinsics
    sigmas = np.sqrt(np.diag(found.camera.covariance))
    inside = np.abs(errors) < NORMAL_95 * sigmas
    n_found, rms = observed.views.n_views, found.adjustment.rms
    met = (
        n_found == N_VIEWS
        and rms <= RMS_LIMIT
        and bool(inside.all())
        and bool(np.all(np.abs(errors[:2]) <= FOCAL_LIMIT))
        and bool(np.all(np.abs(errors[2:4]) <= CENTER_LIMIT))
    )
    return Row(
        "`chessboard`: views found; errors of fx fy cx cy; rms; 95 % intervals that "
        "hold the truth",
        f"{n_found}; {numbers(errors[:4], 2)} px; {rms:.4f} px; {inside.sum()} of "
        f"{len(inside)}",
        f"{N_VIEWS}; {FOCAL_LIMIT} and {CENTER_LIMIT} px; {RMS_LIMIT} px; all",
        met=met,
    )


def _covered(what: str, deviations: FloatArray) -> Row:
    """Return how many errors are in their intervals, beside what chance makes."""
    n_trials = len(deviations)
    shares = 100 * np.mean(np.abs(deviations) < NORMAL_95, axis=0)
    least, most = _by_chance(n_trials)
    low, high = min(COVERED[0], least), max(COVERED[1], most)
    return Row(
        f"{what}: in their 95 % intervals",
        f"{numbers(shares, 1)} %",
        f"{COVERED[0]:.0f} to {COVERED[1]:.0f} % (with {n_trials}, true 95 % give "
        f"{least:.1f} to {most:.1f} % in 99 of 100 cases)",
        met=bool(np.all((shares >= low) & (shares <= high))),
    )


def _by_chance(n_trials: int) -> tuple[float, float]:
    """Return the shares, %, between which the binomial distribution of 95 % lies."""
    likely = [
        comb(n_trials, k) * 0.95**k * 0.05 ** (n_trials - k)
        for k in range(n_trials + 1)
    ]
    below = np.cumsum(likely)
    tail = 0.5 * (1 - CHANCE)
    least, most = np.searchsorted(below, [tail, 1 - tail])
    return 100 * float(least) / n_trials, 100 * float(most) / n_trials


def _lens_rows(trials: list[Trial | str]) -> list[Row]:
    """Return how honest U is before lenses with fields and uneven squares."""
    good = [trial for trial in trials if isinstance(trial, Trial)]
    halves = float(np.sqrt(np.nanmean([trial.halves**2 for trial in good])))
    n_warned = sum(bool(trial.remarks) for trial in good)
    n_refused = len(trials) - len(good)
    low, high = OF_HALVES
    errors = np.array([trial.errors for trial in good])
    return [
        _covered(
            f"fx fy cx cy k1 k2 p1 p2 k3 by {len(good)} sets of rendered boards with "
            "uneven squares, before lenses with fields",
            errors,
        ),
        Row(
            "the same: difference of random halves, over its standard uncertainty, rms",
            f"{halves:.2f}",
            f"{low} to {high}",
            met=low <= halves <= high,
        ),
        Row(
            "the same, in which nothing is wrong: refused or of another lens model, "
            "warned of",
            f"{n_refused}, {n_warned}",
        ),
    ]


def _time_rows(data: Path) -> list[Row]:
    """Return processor times of whole calibrations."""
    return [
        _timed("24 views of 5 MP", str(data / "chessboard"), SET_BOARD),
        _of_small_views(),
    ]


def _of_small_views() -> Row:
    board = parse_board(SMALL_BOARD)
    rng = np.random.default_rng([STREAM, 2])
    poses = simulate_board_poses(SMALL, board, N_SMALL, rng)
    with TemporaryDirectory() as folder:
        for v, (R, t) in enumerate(
            zip(poses.rotations, poses.translations, strict=True)
        ):
            image = expose_board(render_board(SMALL, board, R, t), Sensor(), rng)
            cv2.imwrite(f"{folder}/{v:02}.png", image)
        return _timed(f"{N_SMALL} views of 640x360", folder, SMALL_BOARD)


def _timed(what: str, folder: str, word: str) -> Row:
    board = parse_board(word)
    start = time.process_time()
    observed = observe_board(find_images(folder), board, lambda fraction: None)
    searched = time.process_time() - start
    calibrate_camera(observed.views)
    taken = time.process_time() - start
    theirs = _time_of_opencv(folder, board)
    return Row(
        f"{what}: processor time of a calibration, the search for the board in it",
        f"{taken:.1f}, {searched:.1f} s, {taken / theirs:.1f} times OpenCV's",
        f"<= {MOST_TIMES:g} times",
        f"cv2.findChessboardCorners, cornerSubPix and calibrateCamera {theirs:.2f} s",
        met=taken <= MOST_TIMES * theirs,
    )


def _time_of_opencv(folder: str, board: Board) -> float:
    """Return the processor time of the same by OpenCV, s."""
    start = time.process_time()
    size, seen = (0, 0), []
    for load in find_images(folder).open():
        image = load()
        size = image.shape[1], image.shape[0]
        found, corners = cv2.findChessboardCorners(image, (board.columns, board.rows))
        if found:
            seen.append(cv2.cornerSubPix(image, corners, (5, 5), (-1, -1), REFINING))
    points = board.points.astype(np.float32)
    cv2.calibrateCamera([points] * len(seen), seen, size, None, None)
    return time.process_time() - start


def _tip_deviations(part: int) -> FloatArray:
    """Return errors of the tip by cameras calibrated so, likewise."""
    truth = replace(paper_camera(), covariance=None)
    pen = replace(paper_pen(), scale_sigma=TINY, diameter_sigma=TINY)
    board = parse_board(SET_BOARD)
    deviations = []
    for trial in range(part, N_TRIALS, N_PARTS):
        rng = np.random.default_rng([STREAM, 1, trial])
        poses = simulate_board_poses(truth, board, N_VIEWS, rng)
        points = board.points @ np.swapaxes(poses.rotations, 1, 2)
        pixels = truth.project(points + poses.translations[:, None])
        pixels += rng.normal(0, CORNER_NOISE / np.sqrt(2), pixels.shape)
        names = tuple(map(str, range(N_VIEWS)))
        views = Views(board, names, pixels[:, None], (truth.image_size,))
        camera = _calibrated(views)
        swing = swing_poses(N_IMAGES, rng)
        pixels = simulate_centers(
            truth, pen, swing.rotations, swing.translations, LED_NOISE, rng
        )
        centers = Centers(np.arange(N_IMAGES), pixels, Path("simulated"))
        observations = observe_centers(centers, camera, pen)
        solved = calibrate(camera, pen, observations, NOTHING_ELSE)
        bundle = solved.bundle
        drawn = bundle.independent_noise + bundle.part(*bundle.layout.cameras)
        sigmas = np.sqrt(np.diag(drawn)[:3])
        deviations.append((solved.joint.tip_pen - swing.tip_pen) / sigmas)
    return np.array(deviations)


def _calibrated(views: Views) -> Camera:
    try:
        return calibrate_camera(views).camera
    except CalibrationError as error:
        raise RuntimeError(f"A set of boards was refused: {error}") from error
