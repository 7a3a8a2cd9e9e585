"""A lens field that boards measured, in the camera file and used for the tip."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.simulated_boards import simulate_board_poses
from tests.simulated_centers import simulate_centers

from lightpen.detection.observations import observe_centers
from lightpen.estimation.calibrate import Calibration, calibrate
from lightpen.formats.camera_files import read_camera
from lightpen.formats.observation_files import Centers
from lightpen.formats.rig_files import write_camera
from lightpen.model.camera import Camera
from lightpen.model.fisheye import LensField
from lightpen_extensions.boards.boards import parse_board
from lightpen_extensions.boards.calibration import calibrate_camera
from lightpen_extensions.boards.observing import Views
from lightpen_extensions.simulator.swings import paper_camera, paper_pen, swing_poses

N_VIEWS, N_IMAGES, NOISE = 24, 100, 0.03  # px
AMPLITUDE, LENGTH = 0.06, 0.25  # px; of the width


@pytest.mark.slow
def test_the_field_that_boards_measured_makes_the_tip_more_certain(
    tmp_path: Path,
) -> None:
    rng, pen = np.random.default_rng(0), paper_pen()
    truth = replace(paper_camera(), covariance=None)
    field = LensField.of(*truth.image_size, AMPLITUDE, LENGTH * truth.width)
    root = np.linalg.cholesky(field.covariance + 1e-12 * np.eye(len(field.nodes)))
    field = replace(field, values=root @ rng.standard_normal(field.values.shape))
    board = parse_board("chessboard:11x8:20")
    poses = simulate_board_poses(truth, board, N_VIEWS, rng)
    turned = board.points @ np.swapaxes(poses.rotations, 1, 2)
    pixels = truth.project(turned + poses.translations[:, None])
    pixels += field.at(pixels) + rng.normal(0, NOISE, pixels.shape)
    names = tuple(map(str, range(N_VIEWS)))
    views = Views(board, names, pixels[:, None], (truth.image_size,))
    file = tmp_path / "camera.yaml"
    write_camera(calibrate_camera(views).camera, file)

    swing = swing_poses(N_IMAGES, rng)
    centers = simulate_centers(
        truth, pen, swing.rotations, swing.translations, NOISE, rng
    )
    centers += field.at(centers)

    def tip(camera: Camera) -> Calibration:
        seen = Centers(np.arange(N_IMAGES), centers, Path("simulated"))
        return calibrate(camera, pen, observe_centers(seen, camera, pen))

    camera = read_camera(file)
    assert camera.lens_field is not None
    assert camera.lens_field.amplitude == pytest.approx(AMPLITUDE, rel=0.6)
    with_field, without = tip(camera), tip(replace(camera, lens_field=None))

    errors = [
        np.linalg.norm(found.joint.tip_pen - swing.tip_pen)
        for found in (with_field, without)
    ]
    u, u_without = (each.budget.expanded_uncertainty for each in (with_field, without))
    assert errors[0] < 0.6 * errors[1]
    assert np.all(np.abs(with_field.joint.tip_pen - swing.tip_pen) < u[:3])
    # The cone's place goes with the principal point, which the field draws along.
    assert np.all(u[3:] < 0.6 * u_without[3:])
