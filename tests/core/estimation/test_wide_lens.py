"""Tests of a tip before a fisheye."""

from dataclasses import replace

import numpy as np
import pytest
from tests.simulated_centers import observe_pixels, simulate_centers

from lightpen.estimation.calibrate import calibrate
from lightpen.model.camera import Camera, LensModel
from lightpen.model.limits import Assumptions
from lightpen.model.rigid import rotation_from_vector
from lightpen_extensions.simulator.swings import paper_pen, swing_poses

FISHEYE = Camera(
    *(2448, 2048, 1300.0, 1299.0, 1219.6, 1031.3),
    distortion=np.array([-0.02, 0.012, -0.004, 0.001]),
    covariance=np.diag(np.array([0.02] * 4 + [1e-5] * 4) ** 2),
    lens=LensModel.KANNALA_BRANDT,
)
N_IMAGES, NOISE = 60, 0.02  # px
OFF_AXIS = rotation_from_vector(np.radians([15.0, 35.0, 0.0]))


@pytest.mark.parametrize("camera", [FISHEYE, replace(FISHEYE, covariance=None)])
def test_a_pen_far_off_the_axis_of_a_fisheye_has_its_tip_within_u(
    camera: Camera,
) -> None:
    rng = np.random.default_rng(1)
    pen, swing = paper_pen(), swing_poses(N_IMAGES, rng)
    R, t = OFF_AXIS @ swing.rotations, swing.translations @ OFF_AXIS.T
    pixels = simulate_centers(camera, pen, R, t, NOISE, rng)
    observations = observe_pixels(pixels, camera, pen)
    found = calibrate(camera, pen, observations, Assumptions())

    errors = found.joint.tip_pen - swing.tip_pen
    sigmas = np.sqrt(
        sum(share.standard_uncertainty**2 for share in found.budget.shares)
    )
    assert np.all(np.abs(errors) < 3 * sigmas)
    assert found.joint.rms < 2 * NOISE
