"""Tests of `lightpen.detection.rig_observations`."""

from dataclasses import replace

import numpy as np
from tests.accepted_tip import seen_by
from tests.simulated_rigs import from_first, row_of_cameras

from lightpen.detection.pose import fit_poses
from lightpen.detection.rig_observations import fit_rig_poses
from lightpen_extensions.simulator.swings import paper_pen, swing_poses

RIG = replace(from_first(row_of_cameras(2, 800.0)), names=("left", "right"))
PEN = paper_pen()
N = 30


def test_exact_images_of_two_cameras_give_the_exact_pose() -> None:
    rng = np.random.default_rng(1)
    swing = swing_poses(N, rng)
    seen = np.stack(
        seen_by(RIG, PEN, swing.rotations, swing.translations, rng, 0.0), axis=1
    )

    poses = fit_rig_poses(RIG, PEN, seen, swing.rotations, swing.translations + 2.0)

    np.testing.assert_allclose(poses.rotations, swing.rotations, atol=1e-8)
    np.testing.assert_allclose(poses.translations, swing.translations, atol=1e-5)


def test_the_scatter_of_poses_is_as_their_covariance_says() -> None:
    rng = np.random.default_rng(2)
    swing = swing_poses(400, rng)
    seen = np.stack(seen_by(RIG, PEN, swing.rotations, swing.translations, rng), axis=1)
    poses = fit_rig_poses(RIG, PEN, seen, swing.rotations, swing.translations)

    errors = poses.translations - swing.translations
    expected = np.diagonal(poses.covariances, axis1=1, axis2=2)[:, 3:]
    # 1200 squares of normal numbers have a mean of 1 to 4 %, three times that.
    assert abs(np.mean(errors**2 / expected) - 1) < 0.13


def test_a_second_camera_sees_the_depth_that_one_hardly_sees() -> None:
    rng = np.random.default_rng(3)
    swing = swing_poses(N, rng)
    start = swing.rotations, swing.translations
    seen = seen_by(RIG, PEN, *start, rng)
    alone = fit_poses(RIG.cameras[0], PEN, seen[0], *start)
    together = fit_rig_poses(RIG, PEN, np.stack(seen, axis=1), *start)

    depth = np.sqrt([each.covariances[:, 5, 5].mean() for each in (alone, together)])
    assert depth[0] > 3 * depth[1]
