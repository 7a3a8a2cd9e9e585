from dataclasses import replace

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.detection.pose import Poses, fit_poses
from lightpen.pen_check.match import find_unknown_leds
from lightpen_extensions.simulator.swings import (
    paper_camera,
    paper_pen,
    simulate_centers,
    swing_poses,
)

CAMERA = paper_camera()
PEN = paper_pen()
POINTS = np.array([[10.0, 140.0, -12.0], [-40.0, 55.0, 6.0]])


def seen(points: FloatArray, n_views: int = 10) -> tuple[Poses, list[FloatArray]]:
    """Return the poses of a pen, and the spots of further lights on it."""
    rng = np.random.default_rng(5)
    swing = swing_poses(n_views, rng)
    R, t = swing.rotations, swing.translations
    pixels = simulate_centers(CAMERA, PEN, R, t, 0.05, rng)
    lights = replace(PEN, leds=points, normals=np.tile([0.0, 0, 1], (len(points), 1)))
    others = simulate_centers(CAMERA, lights, R, t, 0.05, rng)
    return fit_poses(CAMERA, PEN, pixels, R, t), [rng.permutation(o) for o in others]


def test_lights_on_the_pen_are_found_with_their_spots() -> None:
    poses, spots = seen(POINTS)

    unknown = find_unknown_leds(CAMERA, poses, spots)

    order = np.argsort(unknown.points[:, 1])[::-1]
    np.testing.assert_allclose(unknown.points[order], POINTS, atol=0.1)
    assert unknown.pixels.shape == (10, 2, 2)
    assert np.isfinite(unknown.pixels).all()


def test_a_light_in_less_than_half_of_the_views_is_none() -> None:
    poses, spots = seen(POINTS[:1])
    some = [each[: i % 2] for i, each in enumerate(spots)]

    assert len(find_unknown_leds(CAMERA, poses, some).points) == 0


def test_a_lamp_that_stands_still_is_no_light_on_the_pen() -> None:
    poses, _ = seen(POINTS)
    lamp = [np.array([[400.0, 300.0]]) for _ in range(10)]

    assert len(find_unknown_leds(CAMERA, poses, lamp).points) == 0


def test_too_few_views_tell_nothing() -> None:
    poses, spots = seen(POINTS, n_views=2)

    assert len(find_unknown_leds(CAMERA, poses, spots).points) == 0


def test_without_spots_left_over_there_are_none() -> None:
    poses, _ = seen(POINTS)

    unknown = find_unknown_leds(CAMERA, poses, [np.zeros((0, 2))] * 10)

    assert unknown.points.shape == (0, 3)
    assert unknown.pixels.shape == (10, 0, 2)
