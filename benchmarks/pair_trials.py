"""Two cameras by boards that move between the exposures of a pair.

    python -m benchmarks.pair_trials --pairs 40

As `benchmarks.board_trials`, each camera with its own noise, lens field and smooth
errors. It prints how often 95 % intervals contain the truth, the size of differences
between random halves of the views over their standard uncertainty, and U of fx in the
pair over U by the camera alone.
"""

import argparse
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from benchmarks.board_trials import (
    BOARD,
    CAMERA,
    NORMAL_95,
    STREAM,
    TOLERANCES,
    draw_field,
    draw_uneven,
    observe_points,
)

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.intrinsics.adjustment import adjust_board
from lightpen.intrinsics.board_fit import N_SHAPE, BoardFit
from lightpen.intrinsics.boards import parse_board
from lightpen.intrinsics.pair import PairCalibration, calibrate_pair
from lightpen.intrinsics.start import BoardPoses
from lightpen.intrinsics.variance_components import MixedFit, fit_effects
from lightpen.intrinsics.views import Views
from lightpen.model.camera import Camera
from lightpen.model.rigid import rotation_from_vector, vector_from_rotation
from lightpen.simulator.boards import simulate_board_poses

OTHER = Camera(
    *(400, 300, 575.0, 574.2, 197.3, 152.1),
    distortion=np.array([-0.12, 0.07, -2e-4, 4e-4, 0.0]),
)
TURN = rotation_from_vector(np.array([0.02, -0.2, 0.01]))
SHIFT = np.array([-100.0, 3.0, 12.0])
N_VIEWS = 16
MOTION = 0.0, 0.2  # mm between the exposures of a pair
ARM = 60.0  # mm, at which a rotation moves the board as far
RIM = 5  # px


class PairTrial(NamedTuple):
    """Errors in standard uncertainties, (24,) each, and U of fx over that alone, (2,).

    Of the intrinsics of both, then rotation and translation of the second.
    """

    errors: FloatArray
    halves: FloatArray
    widened: FloatArray


def draw_pair(rng: np.random.Generator) -> Views:
    """Return views of a board by two cameras."""
    board, size = parse_board(BOARD), np.array(OTHER.image_size)
    rotations: list[FloatArray] = []
    translations: list[FloatArray] = []
    while len(rotations) < N_VIEWS:
        (R,), (t,) = simulate_board_poses(CAMERA, board, 1, rng)
        pixels = OTHER.project((board.points @ R.T + t) @ TURN.T + SHIFT)
        if np.all((pixels > RIM) & (pixels < size - RIM)):
            rotations.append(R)
            translations.append(t)
    true = board.points.copy()
    true[:, :2] += draw_uneven(board, rng)
    first = np.array(rotations), np.array(translations)
    motion = rng.uniform(*MOTION)
    turns = rotation_from_vector(rng.normal(0, motion / ARM, (N_VIEWS, 3)))
    moved = first[0], first[1] + rng.normal(0, motion, (N_VIEWS, 3))
    second = TURN @ turns @ moved[0], moved[1] @ TURN.T + SHIFT
    seen = [
        observe_points(camera, board, true, BoardPoses(*poses), draw_field(rng), rng)
        for camera, poses in ((CAMERA, first), (OTHER, second))
    ]
    names = tuple(map(str, range(N_VIEWS)))
    sizes = (CAMERA.image_size, OTHER.image_size)
    return Views(board, names, np.stack(seen, axis=1), sizes)


def run_pair_trial(seed: int) -> PairTrial | str:
    """Return the errors of a pair drawn at random, or why it was refused."""
    rng = np.random.default_rng([STREAM, 1, seed])
    try:
        found = calibrate_pair(draw_pair(rng), TOLERANCES, ("left", "right"))
        if any(len(each.intrinsics) != 9 for each in found.adjustment.state.cameras):
            return "another lens model"
        halves = _halves(found, rng)
    except CalibrationError as error:
        return error.message.code
    own, off = found.adjustment, np.zeros(3)
    true = np.concatenate([CAMERA.intrinsics, OTHER.intrinsics, off, SHIFT])
    u = _sigmas(own.covariance)
    one, other = (each.adjustment.covariance[0, 0] for each in found.alone)
    return PairTrial(
        (_values(own) - true) / u, halves, u[[0, 9]] / np.sqrt([one, other])
    )


def _halves(found: PairCalibration, rng: np.random.Generator) -> FloatArray:
    """Return the difference of random halves by what they draw anew of U."""
    n_views, state = found.views.n_views, found.adjustment.state
    is_first = rng.permutation(n_views) < n_views // 2
    fits: list[MixedFit] = []
    for which in (is_first, ~is_first):
        poses = BoardPoses(*(each[which] for each in state.poses))
        views = found.views.chosen(which)
        start = replace(
            state, poses=poses, shape=np.zeros(N_SHAPE), offsets=np.zeros(3)
        )
        fits.append(fit_effects(views, adjust_board(views, start, TOLERANCES)))
    one, other = (_values(each.adjustment) for each in fits)
    return (one - other) / np.hypot(*(_sigmas(each.repeatability) for each in fits))


def _values(fitted: BoardFit) -> FloatArray:
    state = fitted.state
    turn = vector_from_rotation(state.rotations[1] @ TURN.T)
    intrinsics = [each.intrinsics for each in state.cameras]
    return np.concatenate([*intrinsics, turn, state.translations[1]])


def _sigmas(covariance: FloatArray) -> FloatArray:
    return np.sqrt(np.diag(covariance)[:-N_SHAPE])


def main() -> None:
    """Run the trials and print what they came to."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pairs", type=int, default=40)
    parser.add_argument("--first", type=int, default=0, help="number of the first pair")
    options = parser.parse_args()
    seeds = range(options.first, options.first + options.pairs)
    trials = [run_pair_trial(seed) for seed in seeds]
    good = [trial for trial in trials if isinstance(trial, PairTrial)]
    refused = [trial for trial in trials if isinstance(trial, str)]
    errors = np.array([trial.errors for trial in good])
    halves = np.array([trial.halves for trial in good])
    covered = 100 * np.mean(np.abs(errors) < NORMAL_95, axis=0)
    sizes = np.sqrt(np.mean(halves**2, axis=0))
    together = np.sqrt(np.mean(halves**2))
    widened = np.median([trial.widened for trial in good], axis=0)
    print(f"{len(trials)} pairs; of both fx fy cx cy k1 k2 p1 p2 k3, rotation, place")
    print(f"  errors: in 95 % intervals {np.round(covered, 1)} %")
    print(f"  halves: z {np.round(sizes, 2)}, together {together:.2f}")
    print(f"  U of fx over that alone, median {np.round(widened, 2)}")
    print(f"  refused or of another lens model {refused}")


if __name__ == "__main__":
    main()
