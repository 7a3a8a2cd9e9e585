"""The pose of one image is that which the fit of many finds."""

import numpy as np
import pytest
from tests.simulated_centers import simulate_centers

from lightpen.detection.pose import fit_pose, fit_poses
from lightpen.model.rigid import rotation_from_vector
from lightpen_extensions.simulator.swings import paper_camera, paper_pen, swing_poses

CAMERA, PEN = paper_camera(), paper_pen()
ALIKE = np.full(PEN.n_leds, 0.01)


@pytest.mark.parametrize("off", [0.0, 1.0])  # px, of one LED
def test_one_image_has_the_pose_that_the_fit_of_many_finds(off: float) -> None:
    rng = np.random.default_rng(0)
    swing = swing_poses(8, rng)
    every = simulate_centers(
        CAMERA, PEN, swing.rotations, swing.translations, 0.03, rng
    )
    every[:, 3] += off
    turn = rotation_from_vector(np.array([0.01, -0.02, 0.01]))
    for pixels, R, t in zip(every, swing.rotations, swing.translations, strict=True):
        start = turn @ R, t + np.array([3.0, -2.0, 10.0])
        one = fit_pose(CAMERA, PEN, pixels, *start, ALIKE)
        many = fit_poses(CAMERA, PEN, pixels[None], start[0][None], start[1][None])
        # Far below the standard deviations, some 0.02 mrad and 20 um in depth.
        np.testing.assert_allclose(one.rotation, many.rotations[0], atol=1e-6)
        np.testing.assert_allclose(one.translation, many.translations[0], atol=1e-3)
        np.testing.assert_allclose(one.sigma, many.sigma, rtol=0.01)
