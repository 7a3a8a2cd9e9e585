import numpy as np
import pytest
from benchmarks.labelling import spots_at

from lightpen.arrays import FloatArray
from lightpen.detection.labelling.constellation import (
    SpotArrays,
    constellation_of,
    spot_arrays,
)
from lightpen.detection.labelling.matching import log_false_alarms, match, settle
from lightpen.model.ellipse import disc_images
from lightpen.model.rigid import rotation_from_vector
from lightpen_extensions.simulator.swings import paper_camera, paper_pen

CAMERA = paper_camera()
PEN = paper_pen()
CONSTELLATION = constellation_of(PEN)
FACING = np.diag([1.0, -1.0, -1.0])
R = rotation_from_vector(np.array([0.3, -0.2, 0.1])) @ FACING
T = np.array([20.0, 100.0, 1050.0])


def true_sight(noise: float = 0.0, shift: FloatArray | None = None) -> SpotArrays:
    """Return the sight of all discs, the first of them shifted by some px."""
    discs = disc_images(CAMERA, PEN.leds @ R.T + T, PEN.normals @ R.T, PEN.diameter / 2)
    centers = discs.centers + np.random.default_rng(0).normal(0, 1, (10, 2)) * noise
    if shift is not None:
        centers[0] += shift
    return spot_arrays([spots_at(centers, discs.shapes)], CAMERA, PEN.diameter / 2)


def test_the_size_of_a_spot_tells_its_distance() -> None:
    truth = np.linalg.norm(PEN.leds @ R.T + T, axis=1)
    # The disc's far rim is smaller than its near one: a relative error of second
    # order in radius over distance.
    np.testing.assert_allclose(true_sight().ranges[0], truth, rtol=1e-4)


def test_a_pose_beside_the_truth_settles_in_it() -> None:
    sight = true_sight()
    beside = rotation_from_vector(np.array([0.003, -0.004, 0.004])) @ R
    start = match(sight, CONSTELLATION, np.zeros(1, int), beside[None], T[None], 8.0)
    settled = settle(sight, CONSTELLATION, start)
    np.testing.assert_array_equal(settled.spot, [np.arange(10)])
    np.testing.assert_allclose(settled.R[0], R, atol=1e-6)
    np.testing.assert_allclose(settled.t[0], T, atol=1e-3)


def test_a_spot_off_its_place_is_dropped() -> None:
    sight = true_sight(noise=0.03, shift=np.array([1.0, 0.8]))
    start = match(sight, CONSTELLATION, np.zeros(1, int), R[None], T[None], 8.0)
    settled = settle(sight, CONSTELLATION, start)
    np.testing.assert_array_equal(settled.spot, [[-1, 1, 2, 3, 4, 5, 6, 7, 8, 9]])


def test_a_spot_of_another_shape_is_dropped() -> None:
    sight = true_sight()
    sight.shapes[0, 3] *= 1.5
    start = match(sight, CONSTELLATION, np.zeros(1, int), R[None], T[None], 8.0)
    assert settle(sight, CONSTELLATION, start).spot[0, 3] == -1


def test_spots_all_broadened_alike_are_kept() -> None:
    sight = true_sight()
    sight.shapes[...] += 15 * np.eye(2)
    start = match(sight, CONSTELLATION, np.zeros(1, int), R[None], T[None], 8.0)
    assert (settle(sight, CONSTELLATION, start).spot >= 0).all()


def test_discs_that_face_away_are_not_matched() -> None:
    # A flat pen seen from behind has its LEDs where a mirrored one would have them.
    away = R @ np.diag([-1.0, 1.0, -1.0])
    found = match(
        true_sight(), CONSTELLATION, np.zeros(1, int), away[None], T[None], 1e4
    )
    assert (found.spot == -1).all()


def test_ten_times_the_noise_is_ten_to_the_surplus_times_as_likely_by_chance() -> None:
    logs = []
    for noise in (0.01, 0.1):
        sight = true_sight(noise=noise)
        start = match(sight, CONSTELLATION, np.zeros(1, int), R[None], T[None], 8.0)
        logs.append(log_false_alarms(sight, settle(sight, CONSTELLATION, start))[0])
    assert logs[1] - logs[0] == pytest.approx(2 * 10 - 6, abs=0.1)
