"""Coverage of the intrinsics by boards with uneven squares before lenses with fields.

    python -m benchmarks.board_trials --sets 200 --rendered 12

draws sets of views with everything in usual sizes at random: 16 to 30 views, noise,
points of the board, residual field of the lens, smooth errors of single views. It
prints how often 95 % intervals contain the truth, and the size of differences between
random halves of the views over their standard uncertainty: by U as it is stated (which
contains what both halves share), and by its share that halves draw anew.
"""

import argparse
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.intrinsics.board_fit import BoardFit
from lightpen.intrinsics.boards import Board, parse_board
from lightpen.intrinsics.distortion import FEW, fit_camera
from lightpen.intrinsics.effects import smooth_functions
from lightpen.intrinsics.sightings import find_points
from lightpen.intrinsics.start import BoardPoses, start_camera
from lightpen.intrinsics.variance_components import MixedFit, fit_effects
from lightpen.intrinsics.views import BoardTolerances, Views
from lightpen.model.camera import Camera
from lightpen.model.lens_field import LensField
from lightpen.simulator.boards import expose_board, render_board, simulate_board_poses
from lightpen.simulator.sensor import Sensor

STREAM = 27  # of the seeds
BOARD = "chessboard:9x6:20"
CAMERA = Camera(
    *(640, 480, 900.0, 899.4, 322.3, 238.1),
    distortion=np.array([-0.1, 0.05, 3e-4, -2e-4, 0.0]),
)
N_VIEWS = 16, 30
NOISE = 0.02, 0.06  # px
UNEVEN = 0.0, 0.05  # mm
FIELD = 0.005, 0.06  # px
LENGTH = 0.15, 0.5  # of the image's width
SMOOTH = 0.0, 0.02  # px
NORMAL_95 = 1.959964
TOLERANCES = BoardTolerances()


class Trial(NamedTuple):
    """Errors of one set in standard uncertainties, (9,) each."""

    errors: FloatArray
    by_noise: FloatArray
    halves: FloatArray
    repeated: FloatArray


def draw_field(rng: np.random.Generator) -> LensField:
    """Return the residual field of a lens."""
    amplitude, share = rng.uniform(*FIELD), rng.uniform(*LENGTH)
    field = LensField.of(*CAMERA.image_size, amplitude, share * CAMERA.width)
    values, vectors = np.linalg.eigh(field.covariance)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    return replace(field, values=root @ rng.standard_normal(field.values.shape))


def draw_points(
    board: Board, poses: BoardPoses, field: LensField, rng: np.random.Generator
) -> FloatArray:
    """Return where the points are seen, (V, N, 2), px."""
    true = board.points.copy()
    true[:, :2] += rng.normal(0, rng.uniform(*UNEVEN), (board.n_points, 2))
    points = true @ np.swapaxes(poses.rotations, 1, 2) + poses.translations[:, None]
    pixels = CAMERA.project(points)
    pixels += field.at(pixels)
    functions = smooth_functions(board)
    drawn = rng.standard_normal((len(pixels), functions.shape[1], 2))
    pixels += rng.uniform(*SMOOTH) * (functions @ drawn)
    return pixels + rng.normal(0, rng.uniform(*NOISE), pixels.shape)


def render_points(
    board: Board, poses: BoardPoses, field: LensField, rng: np.random.Generator
) -> FloatArray:
    """Return the points that are found in images, (V, N, 2), px."""
    uneven = rng.normal(0, rng.uniform(*UNEVEN), (board.n_points, 2))
    found = []
    for R, t in zip(poses.rotations, poses.translations, strict=True):
        light = render_board(CAMERA, board, R, t, field=field, uneven=uneven)
        points = find_points(expose_board(light, Sensor(), rng), board)
        if points is not None:
            found.append(points)
    return np.array(found)


def run_trial(seed: int, *, rendered: bool) -> Trial:
    """Return the errors of a set drawn at random."""
    rng = np.random.default_rng([STREAM, seed])
    board = parse_board(BOARD)
    n_views = int(rng.integers(*N_VIEWS, endpoint=True))
    poses = simulate_board_poses(CAMERA, board, n_views, rng)
    field = draw_field(rng)
    draw = render_points if rendered else draw_points
    pixels = draw(board, poses, field, rng)
    views = _views(board, pixels)
    fitted = fit_camera(views, TOLERANCES, start_camera(views, FEW))
    found = fit_effects(views, fitted)
    truth = CAMERA.intrinsics
    order = rng.permutation(views.n_views)
    half = views.n_views // 2
    one, other = (
        _fit(_views(board, pixels[np.sort(part)]), fitted)
        for part in (order[:half], order[half:])
    )
    change = _intrinsics(one.adjustment) - _intrinsics(other.adjustment)
    return Trial(
        (_intrinsics(found.adjustment) - truth) / _sigmas(found.adjustment.covariance),
        (_intrinsics(fitted) - truth) / _sigmas(fitted.covariance),
        change
        / np.hypot(*(_sigmas(each.adjustment.covariance) for each in (one, other))),
        change / np.hypot(*(_sigmas(each.repeatability) for each in (one, other))),
    )


def _fit(views: Views, near: BoardFit) -> MixedFit:
    return fit_effects(views, fit_camera(views, TOLERANCES, near.state.cameras[0]))


def _views(board: Board, pixels: FloatArray) -> Views:
    names = tuple(map(str, range(len(pixels))))
    return Views(board, names, pixels[:, None], (CAMERA.image_size,))


def _intrinsics(fitted: BoardFit) -> FloatArray:
    return fitted.state.cameras[0].intrinsics


def _sigmas(covariance: FloatArray) -> FloatArray:
    return np.sqrt(np.diag(covariance)[: len(CAMERA.intrinsics)])


def main() -> None:
    """Run the trials and print their table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sets", type=int, default=200)
    parser.add_argument("--rendered", type=int, default=12)
    parser.add_argument("--first", type=int, default=0, help="number of the first set")
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    for words, rendered, count in (
        ("points", False, options.sets),
        ("images", True, options.rendered),
    ):
        if count == 0:
            continue
        seeds = range(options.first, options.first + count)
        with ProcessPoolExecutor(options.workers) as pool:
            trials = list(pool.map(partial(run_trial, rendered=rendered), seeds))
        print(f"{count} sets of {words}; " + " ".join(["fx fy cx cy k1 k2 p1 p2 k3"]))
        for name in ("errors", "by_noise"):
            z = np.array([getattr(trial, name) for trial in trials])
            covered = 100 * np.mean(np.abs(z) < NORMAL_95, axis=0)
            print(f"  {name}: in 95 % intervals {np.round(covered, 1)} %")
        for name in ("halves", "repeated"):
            z = np.array([getattr(trial, name) for trial in trials])
            each, together = np.sqrt(np.mean(z**2, axis=0)), np.sqrt(np.mean(z**2))
            print(f"  {name}: z {np.round(each, 2)}, together {together:.2f}")


if __name__ == "__main__":
    main()
