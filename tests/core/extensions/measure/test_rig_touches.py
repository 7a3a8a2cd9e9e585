"""Touches before two cameras: one pose by both, and what is known of their places."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from tests.accepted_tip import seen_by

from lightpen.arrays import FloatArray
from lightpen.detection.rig_observations import fit_rig_poses
from lightpen.estimation.uncertainty.instrument import Instrument, parameters_of
from lightpen.model.rigid import Rig, rig_of, rotation_from_vector
from lightpen_extensions.measure.probing.instruments import (
    instrument_of_files,
    with_rig,
)
from lightpen_extensions.measure.tasks.probed_point import (
    SEATING,
    ProbedPoint,
    ProbingFrame,
    StillFrames,
    measure_touches,
    point_sensitivities,
)
from lightpen_extensions.simulator.scenes import beside
from lightpen_extensions.simulator.swings import (
    PAPER_CONE,
    PAPER_TIP,
    paper_camera,
    paper_pen,
    swing_poses,
)

CHI_SQUARE_95 = 7.815  # three degrees of freedom
SIGMA = 0.01  # px
FOLLOWS = 0.15  # of a derivative, by which weights that follow the residuals change it


@pytest.fixture(scope="module")
def by_two() -> Instrument:
    pen = replace(paper_pen(), led_sigma=0.002)
    return instrument_of_files(
        beside(paper_camera(), PAPER_CONE), pen, PAPER_TIP, 1e-6 * np.eye(3), SIGMA
    )


def touched(
    instrument: Instrument, pixels: Sequence[FloatArray], R: FloatArray, t: FloatArray
) -> tuple[ProbedPoint, ...]:
    frames = enumerate(np.stack(pixels, axis=1))
    return measure_touches(
        instrument,
        [StillFrames((ProbingFrame(str(i), seen, R[i], t[i]),)) for i, seen in frames],
    )


def test_two_cameras_tell_the_depth_of_a_touch_far_better_than_one(
    by_two: Instrument,
) -> None:
    rng = np.random.default_rng(1)
    swing = swing_poses(60, rng)
    poses = swing.rotations, swing.translations
    seen = seen_by(by_two.rig, by_two.pen, *poses, rng)
    alone = with_rig(by_two, rig_of(by_two.camera))
    depths = [
        np.std([touch.point_cam[2] for touch in touches])
        for touches in (touched(alone, seen[:1], *poses), touched(by_two, seen, *poses))
    ]
    assert depths[0] > 2.5 * depths[1]


def test_a_point_follows_where_the_second_camera_stands(by_two: Instrument) -> None:
    rng = np.random.default_rng(2)
    swing = swing_poses(1, rng)
    pose = swing.rotations, swing.translations
    pixels = np.stack(seen_by(by_two.rig, by_two.pen, *pose, rng, 0.1), axis=1)
    (derivative,) = point_sensitivities(
        by_two, fit_rig_poses(by_two.rig, by_two.pen, pixels, *pose)
    )
    place = by_two.parameters.extrinsics.start
    by_intrinsics = by_two.parameters.cameras[1].start

    def point(rig: Rig) -> FloatArray:
        poses = fit_rig_poses(rig, by_two.pen, pixels, *pose)
        return np.asarray(poses.rotations[0] @ PAPER_TIP + poses.translations[0])

    for k, step in ((1, 1e-6), (3, 1e-3), (5, 1e-3)):
        difference = point(moved(by_two.rig, k, step)) - point(
            moved(by_two.rig, k, -step)
        )
        size = float(np.abs(difference).max()) / (2 * step)
        np.testing.assert_allclose(
            derivative[:, place + k], difference / (2 * step), atol=FOLLOWS * size
        )
    first, second = by_two.rig.cameras
    ends = [
        point(replace(by_two.rig, cameras=(first, replace(second, fx=second.fx + fx))))
        for fx in (0.1, -0.1)
    ]
    by_fx = (ends[0] - ends[1]) / 0.2
    size = float(np.abs(by_fx).max())
    np.testing.assert_allclose(derivative[:, by_intrinsics], by_fx, atol=FOLLOWS * size)


def test_a_point_follows_a_third_camera_like_a_second_one_in_its_place() -> None:
    two, pen = beside(paper_camera(), PAPER_CONE), paper_pen()
    twice = [0, 1, 1]
    rig = replace(
        two,
        cameras=tuple(two.cameras[i] for i in twice),
        rotations=two.rotations[twice],
        translations=two.translations[twice],
        covariance=1e-6 * np.eye(12),
        names=("left", "right", "right again"),
    )
    by_three = instrument_of_files(rig, pen, PAPER_TIP, 1e-6 * np.eye(3), SIGMA)
    swing = swing_poses(2, np.random.default_rng(4))
    poses = swing.rotations, swing.translations
    pixels = np.stack(seen_by(rig, pen, *poses, np.random.default_rng(5), 0.0), axis=1)

    derivatives = point_sensitivities(by_three, fit_rig_poses(rig, pen, pixels, *poses))

    place = by_three.parameters.extrinsics.start
    second, third = (
        derivatives[..., place : place + 12].reshape(2, 3, 2, 6).swapaxes(0, 2)
    )
    np.testing.assert_allclose(third, second, rtol=1e-6)
    assert np.abs(second).min() > 0


def moved(rig: Rig, k: int, step: float) -> Rig:
    """Return a rig whose second camera is moved by one parameter of its place."""
    change = np.zeros(6)
    change[k] = step
    turns = np.stack([np.eye(3), rotation_from_vector(change[:3])])
    shifts = np.stack([np.zeros(3), change[3:]])
    return replace(
        rig, rotations=turns @ rig.rotations, translations=rig.translations + shifts
    )


@pytest.mark.slow
def test_ellipsoids_hold_the_point_as_often_as_they_say(by_two: Instrument) -> None:
    """Of rigs as a swing leaves them; 400 trials have a deviation of 1.1 %."""
    rng = np.random.default_rng(3)
    deviations = np.repeat([2e-6, 0.002], 3)  # rad and mm
    exact = replace(by_two, covariance=np.zeros_like(by_two.covariance))
    at = parameters_of(by_two.rig, by_two.pen)
    exact.covariance[at.extrinsics, at.extrinsics] = np.diag(deviations**2)
    inside = []
    for _ in range(400):
        true = by_two.rig
        for k, sigma in enumerate(deviations):
            true = moved(true, k, sigma * rng.standard_normal())
        swing = swing_poses(1, rng)
        pose = swing.rotations, swing.translations
        (touch,) = touched(exact, seen_by(true, by_two.pen, *pose, rng, SIGMA), *pose)
        cone = pose[0][0] @ PAPER_TIP + pose[1][0] + SEATING * rng.standard_normal(3)
        error = touch.point_cam - cone
        covariance = touch.covariance(exact)
        inside.append(error @ np.linalg.solve(covariance, error) < CHI_SQUARE_95)
    assert 0.91 < np.mean(inside) < 0.99


def test_before_a_single_camera_the_instrument_of_a_rig_knows_it_by_its_file(
    by_two: Instrument,
) -> None:
    alone = with_rig(by_two, rig_of(by_two.camera))
    at, old = alone.parameters, by_two.parameters

    assert alone.covariance.shape == (at.number, at.number)
    np.testing.assert_array_equal(
        alone.covariance[at.leds, at.leds], by_two.covariance[old.leds, old.leds]
    )
    assert at.extrinsics.start == at.extrinsics.stop
