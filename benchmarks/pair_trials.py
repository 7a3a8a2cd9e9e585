"""Two cameras by boards that move between the exposures of a pair.

    python -m benchmarks.pair_trials --pairs 40

As `benchmarks.board_trials`, each camera with its own noise, lens field and smooth
errors. It prints how often 95 % intervals of the place of the second camera contain the
truth.
"""

import argparse

import numpy as np
from benchmarks.board_trials import (
    BOARD,
    CAMERA,
    NORMAL_95,
    STREAM,
    draw_field,
    draw_uneven,
    observe_points,
)
from tests.simulated_boards import simulate_board_poses

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.model.camera import Camera
from lightpen.model.rigid import rotation_from_vector, vector_from_rotation
from lightpen_extensions.boards.boards import parse_board
from lightpen_extensions.boards.observing import Views
from lightpen_extensions.boards.pair import calibrate_pair
from lightpen_extensions.boards.start import BoardPoses

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


def run_pair_trial(seed: int) -> FloatArray | str:
    """Return the errors of rotation and translation, (6,), or why it was refused.

    In standard uncertainties.
    """
    rng = np.random.default_rng([STREAM, 1, seed])
    try:
        rig = calibrate_pair(draw_pair(rng), ("left", "right")).rig
    except CalibrationError as error:
        return error.message.code
    assert rig.covariance is not None
    turn = vector_from_rotation(rig.rotations[1] @ TURN.T)
    off = np.concatenate([turn, rig.translations[1] - SHIFT])
    return np.asarray(off / np.sqrt(np.diag(rig.covariance)))


def main() -> None:
    """Run the trials and print what they came to."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pairs", type=int, default=40)
    parser.add_argument("--first", type=int, default=0, help="number of the first pair")
    options = parser.parse_args()
    seeds = range(options.first, options.first + options.pairs)
    trials = [run_pair_trial(seed) for seed in seeds]
    errors = np.array([trial for trial in trials if not isinstance(trial, str)])
    covered = 100 * np.mean(np.abs(errors) < NORMAL_95, axis=0)
    print(f"{len(trials)} pairs; rotation and translation of the second camera")
    print(f"  errors: in 95 % intervals {np.round(covered, 1)} %")
    print(f"  refused {[trial for trial in trials if isinstance(trial, str)]}")


if __name__ == "__main__":
    main()
