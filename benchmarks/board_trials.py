"""Coverage of the intrinsics by boards with uneven squares before lenses with fields.

    python -m benchmarks.board_trials --sets 200 --rendered 200

draws sets of views with everything in usual sizes at random: noise, points of the
board, residual field of the lens, smooth errors of single views; some are rendered as
images and detected. Each set is calibrated as `lightpen intrinsics` does. It prints how
often 95 % intervals contain the truth, and the size of differences between random
halves of the views over the share of their standard uncertainty that halves draw anew;
and what was said of these sets, in which nothing is wrong.

    python -m benchmarks.board_trials --sets 0 --rendered 0 --photographed 1000

draws sets as people photograph them: a bowed board, a lens far from its model, errors
that the points of a view share, near and tilted views. It prints what is said of them:
``intrinsics.two-settings`` and ``intrinsics.apart`` of a camera that changed,
``intrinsics.turned`` of rotated images.
"""

import argparse
import pickle
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
from tests.simulated_boards import expose_board, render_board, simulate_board_poses

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.model.camera import Camera
from lightpen.model.fisheye import LensField
from lightpen_extensions.boards.adjustment import BoardFit, board_points
from lightpen_extensions.boards.boards import Board, parse_board
from lightpen_extensions.boards.calibration import CameraCalibration, calibrate_camera
from lightpen_extensions.boards.distortion import FEW, fit_camera
from lightpen_extensions.boards.effects import MixedFit, fit_effects
from lightpen_extensions.boards.observing import Views
from lightpen_extensions.boards.sightings import find_points
from lightpen_extensions.boards.start import BoardPoses
from lightpen_extensions.simulator.scenes import Sensor

STREAM = 27  # of the seeds
BOARD = "chessboard:9x6:20"
CAMERA = Camera(
    *(400, 300, 560.0, 559.7, 201.4, 148.8),
    distortion=np.array([-0.1, 0.05, 3e-4, -2e-4, 0.0]),
)
CAMERAS = {
    "400x300": CAMERA,
    "640x360": Camera(
        *(640, 360, 700.0, 699.7, 321.2, 178.3),
        distortion=np.array([-0.12, 0.08, 3e-4, -2e-4, 0.02]),
    ),
    "640x480": Camera(
        *(640, 480, 620.0, 619.6, 318.7, 242.4),
        distortion=np.array([0.08, -0.2, 4e-4, -3e-4, 0.1]),
    ),
    "1280x960": Camera(
        *(1280, 960, 1500.0, 1499.0, 646.3, 475.1),
        distortion=np.array([-0.2, 0.15, -3e-4, 2e-4, -0.05]),
    ),
}
N_VIEWS, N_RENDERED = (12, 18), (12, 18)
NOISE = 0.02, 0.06  # px
UNEVEN = 0.0, 0.05  # mm
FIELD = 0.005, 0.06  # px
LENGTH = 0.15, 0.5  # of the image's width
SMOOTH = 0.0, 0.02  # px
NORMAL_95 = 1.959964


class Trial(NamedTuple):
    """Errors of one set in standard uncertainties, (9,) each, and its messages."""

    errors: FloatArray
    halves: FloatArray
    remarks: tuple[str, ...]


def draw_field(
    rng: np.random.Generator,
    camera: Camera = CAMERA,
    amplitudes: tuple[float, float] = FIELD,
) -> LensField:
    """Return the residual field of a lens."""
    amplitude, share = rng.uniform(*amplitudes), rng.uniform(*LENGTH)
    field = LensField.of(*camera.image_size, amplitude, share * camera.width)
    values, vectors = np.linalg.eigh(field.covariance)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    return replace(field, values=root @ rng.standard_normal(field.values.shape))


def draw_points(
    camera: Camera,
    board: Board,
    poses: BoardPoses,
    field: LensField,
    rng: np.random.Generator,
) -> FloatArray:
    """Return where the points are seen, (V, N, 2), px."""
    true = board.points.copy()
    true[:, :2] += draw_uneven(board, rng)
    return observe_points(camera, board, true, poses, field, rng)


def draw_uneven(board: Board, rng: np.random.Generator) -> FloatArray:
    """Return by how much points are off, (N, 2), mm.

    In every second set columns and rows are off as a whole, too, as by a printer.
    """
    off = rng.normal(0, rng.uniform(*UNEVEN), (board.n_points, 2))
    if rng.random() < 0.5:
        sigma = rng.uniform(*UNEVEN)
        off[:, 0] += np.tile(rng.normal(0, sigma, board.columns), board.rows)
        off[:, 1] += np.repeat(rng.normal(0, sigma, board.rows), board.columns)
    return off


def observe_points(
    camera: Camera,
    board: Board,
    true: FloatArray,
    poses: BoardPoses,
    field: LensField,
    rng: np.random.Generator,
    noise: tuple[float, float] = NOISE,
    smooth: tuple[float, float] = SMOOTH,
) -> FloatArray:
    """Return where a camera sees points (N, 3), mm, of a board, (V, N, 2), px."""
    points = true @ np.swapaxes(poses.rotations, 1, 2) + poses.translations[:, None]
    pixels = camera.project(points)
    pixels += field.at(pixels)
    functions = _smooth_functions(board)
    drawn = rng.standard_normal((len(pixels), functions.shape[1], 2))
    pixels += rng.uniform(*smooth) * (functions @ drawn)
    return pixels + rng.normal(0, rng.uniform(*noise), pixels.shape)


def _smooth_functions(board: Board) -> FloatArray:
    """Return functions of second and third order over the board, (N, 7).

    Orthogonal to each other and to functions of lower order, of mean square 1.
    """
    x, y = board.points[:, 0], board.points[:, 1]
    u, v = x / np.abs(x).max(), y / np.abs(y).max()
    powers = [(i - j, j) for i in range(4) for j in range(i + 1)]
    columns = np.stack([u**i * v**j for i, j in powers], axis=-1)
    orthogonal, triangle = np.linalg.qr(columns)
    independent = np.abs(np.diag(triangle)) > 1e-9 * np.sqrt(len(x))
    independent[:3] = False  # a place and a tilt are the pose's
    functions = orthogonal[:, independent] * np.sqrt(len(x))
    functions.flags.writeable = False
    return np.asarray(functions)


def render_points(
    camera: Camera,
    board: Board,
    poses: BoardPoses,
    field: LensField,
    rng: np.random.Generator,
) -> FloatArray:
    """Return the points that are found in images, (V, N, 2), px."""
    uneven = draw_uneven(board, rng)
    found = []
    for R, t in zip(poses.rotations, poses.translations, strict=True):
        light = render_board(camera, board, R, t, field=field, uneven=uneven)
        points = find_points(expose_board(light, Sensor(), rng), board)
        if points is not None:
            found.append(points)
    return np.array(found)


def run_trial(seed: int, *, rendered: bool, size: str = "400x300") -> Trial | str:
    """Return the errors of a set drawn at random, or why it was refused."""
    rng, camera = np.random.default_rng([STREAM, seed]), CAMERAS[size]
    board = parse_board(BOARD)
    n_views = int(rng.integers(*(N_RENDERED if rendered else N_VIEWS), endpoint=True))
    poses = simulate_board_poses(camera, board, n_views, rng)
    field = draw_field(rng, camera)
    draw = render_points if rendered else draw_points
    views = _views(camera, board, draw(camera, board, poses, field, rng))
    try:
        found = calibrate_camera(views)
    except CalibrationError as error:
        return error.message.code
    if found.choice.n_coefficients != FEW:
        return found.choice.message.code
    adjustment = found.adjustment
    errors = _intrinsics(adjustment) - camera.intrinsics
    return Trial(
        errors / _sigmas(adjustment.covariance),
        _halves(found, rng),
        tuple(remark.code for remark in found.remarks),
    )


def photographed(seed: int) -> Views:
    """Return views by a webcam of a bowed board, with errors that each view shares.

    The lens has a field beside Brown's model, three views are near and tilted.
    """
    camera, board = CAMERAS["640x480"], parse_board(BOARD)
    rng = np.random.default_rng([STREAM, 5, seed])
    poses = simulate_board_poses(camera, board, int(rng.integers(10, 30)), rng)
    poses.translations[:3, 2] *= 0.8
    field = draw_field(rng, camera, (0.0, 0.3))
    bend = rng.normal(0, rng.uniform(0.0, 0.7), 3)
    true = board_points(board, np.r_[0.0, 0.0, bend])
    true[:, :2] += draw_uneven(board, rng)
    sizes = (0.03, 0.15), (0.0, 0.1)
    return _views(
        camera, board, observe_points(camera, board, true, poses, field, rng, *sizes)
    )


def said_of(seed: int) -> tuple[str, ...]:
    """Return the codes of what is said of `photographed` views, or why not used."""
    try:
        remarks = calibrate_camera(photographed(seed)).remarks
    except CalibrationError as error:
        return (error.message.code,)
    return tuple(remark.code for remark in remarks)


def _halves(found: CameraCalibration, rng: np.random.Generator) -> FloatArray:
    """Return the difference of two halves by its uncertainty, (9,).

    NaN where half the views leave corners open.
    """
    order = rng.permutation(found.views.n_views)
    is_first = np.isin(np.arange(len(order)), order[: len(order) // 2])
    try:
        one, other = (
            _fit(found.views.chosen(which), found.adjustment)
            for which in (is_first, ~is_first)
        )
    except CalibrationError:
        return np.full(4 + FEW, np.nan)
    change = _intrinsics(one.adjustment) - _intrinsics(other.adjustment)
    sigmas = np.hypot(*(_sigmas(each.repeatability) for each in (one, other)))
    return np.asarray(change / sigmas)


def _fit(views: Views, near: BoardFit) -> MixedFit:
    return fit_effects(views, fit_camera(views, near.state.cameras[0]))


def _views(camera: Camera, board: Board, pixels: FloatArray) -> Views:
    names = tuple(map(str, range(len(pixels))))
    return Views(board, names, pixels[:, None], (camera.image_size,))


def _intrinsics(fitted: BoardFit) -> FloatArray:
    return fitted.state.cameras[0].intrinsics


def _sigmas(covariance: FloatArray) -> FloatArray:
    return np.sqrt(np.diag(covariance)[: 4 + FEW])


def main() -> None:
    """Run the trials and print their table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sets", type=int, default=200)
    parser.add_argument("--rendered", type=int, default=12)
    parser.add_argument("--photographed", type=int, default=0)
    parser.add_argument("--first", type=int, default=0, help="number of the first set")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--camera", choices=CAMERAS, default="400x300")
    parser.add_argument("--save", default="", help="beginning of the file names")
    options = parser.parse_args()
    for words, rendered, count in (
        ("points", False, options.sets),
        ("images", True, options.rendered),
    ):
        if count == 0:
            continue
        seeds = range(options.first, options.first + count)
        with ProcessPoolExecutor(options.workers) as pool:
            trials = []
            run = partial(run_trial, rendered=rendered, size=options.camera)
            for trial in pool.map(run, seeds):
                trials.append(trial)
                if options.save:
                    path = Path(f"{options.save}-{words}-{options.first}")
                    path.write_bytes(pickle.dumps(trials))
        _print(words, trials)
    seeds = range(options.first, options.first + options.photographed)
    if seeds:
        with ProcessPoolExecutor(options.workers) as pool:
            said = Counter(code for codes in pool.map(said_of, seeds) for code in codes)
        print(f"{len(seeds)} sets as photographed, nothing wrong; said {dict(said)}")


def _print(words: str, trials: list[Trial | str]) -> None:
    good = [trial for trial in trials if isinstance(trial, Trial)]
    refused = Counter(trial for trial in trials if isinstance(trial, str))
    print(f"{len(trials)} sets of {words}; fx fy cx cy k1 k2 p1 p2 k3")
    z = np.array([trial.errors for trial in good])
    covered = 100 * np.mean(np.abs(z) < NORMAL_95, axis=0)
    print(f"  errors: in 95 % intervals {np.round(covered, 1)} %")
    z = np.array([trial.halves for trial in good])
    each, together = np.sqrt(np.nanmean(z**2, axis=0)), np.sqrt(np.nanmean(z**2))
    print(f"  halves: z {np.round(each, 2)}, together {together:.2f}")
    remarks = Counter(remark for trial in good for remark in trial.remarks)
    print(f"  refused or of another lens model {dict(refused)}; said {dict(remarks)}")


if __name__ == "__main__":
    main()
