"""A camera that moves during the swing, and the lamps that witness it."""

from dataclasses import replace

import numpy as np
import pytest
from tests.simulated_centers import observe_pixels, simulate_centers

from lightpen.arrays import FloatArray
from lightpen.detection.fixed_lamps import lamps_among
from lightpen.detection.observations import Observations, leave_out
from lightpen.detection.reasons import Reason
from lightpen.errors import CalibrationError
from lightpen.estimation.calibrate import Calibration, calibrate
from lightpen.estimation.contact.single_images import (
    CameraPath,
    follow_lamps,
    pose_steadily,
    steadied,
)
from lightpen.estimation.reports.report_warnings import warnings_of
from lightpen.estimation.reports.verdict import Grade, NextStep, judge
from lightpen.messages import Code
from lightpen.model.limits import SwingLimits
from lightpen.model.rigid import rotation_from_vector
from lightpen_extensions.simulator.swings import paper_camera, paper_pen, swing_poses

CAMERA, PEN = paper_camera(), paper_pen()
N_IMAGES = 80
TIME = np.linspace(0, 1, N_IMAGES)
LAMPS = np.array([[1100.0, 900.0], [1300.0, 1100.0]])
SIGMA = 0.03  # px
SWING = swing_poses(N_IMAGES, np.random.default_rng(5))


def lamps_along(way: FloatArray, noise: float = 0.02) -> FloatArray:
    rng = np.random.default_rng(6)
    return LAMPS + way[:, None] + noise * rng.standard_normal((len(way), 2, 2))


def seen_along(pen_way: FloatArray) -> Observations:
    rng = np.random.default_rng(7)
    poses = SWING.rotations, SWING.translations
    pixels = simulate_centers(CAMERA, PEN, *poses, SIGMA, rng) + pen_way[:, None]
    return observe_pixels(pixels, CAMERA, PEN)


def solved(pen_way: FloatArray, lamp_way: FloatArray) -> Calibration:
    seen = replace(seen_along(pen_way), lamps=lamps_along(lamp_way))
    return calibrate(CAMERA, PEN, seen)


def errors_in_u(calibration: Calibration) -> FloatArray:
    off = calibration.joint.tip_pen - SWING.tip_pen
    return np.abs(off) / calibration.budget.expanded_uncertainty[:3]


STILL = np.zeros((N_IMAGES, 2))
EVEN = np.outer(TIME, [1.0, -0.6])
CURVE = np.outer(np.sin(7 * TIME), [1.5, 0.8])
BUMP = np.outer(TIME > 0.4, [0.8, 0.3])


def test_noise_is_no_way() -> None:
    path = follow_lamps(lamps_along(STILL))
    assert path is not None
    assert path.moved == 0
    # Two lamps, each with noise of 0.02 px.
    np.testing.assert_allclose(path.noise, 0.02 / np.sqrt(2), rtol=0.2)
    np.testing.assert_allclose(path.lamps, LAMPS, atol=0.01)


@pytest.mark.parametrize(
    ("way", "left"),
    [(EVEN, 0.6), (CURVE, 0.8), (BUMP, 1.1)],
    ids=["even", "curve", "bump"],
)
def test_the_way_of_the_lamps_is_freed_of_noise(way: FloatArray, left: float) -> None:
    path = follow_lamps(lamps_along(way))
    assert path is not None
    off = path.shifts - (way - way.mean(axis=0))
    assert np.sqrt(np.mean(off**2)) < left * 0.02 / np.sqrt(2)
    farthest = np.linalg.norm(way[:, None] - way, axis=2).max()
    assert path.moved == pytest.approx(farthest, rel=0.1)


def test_images_that_do_not_show_a_lamp_are_bridged() -> None:
    lamps = lamps_along(EVEN)
    lamps[::7] = np.nan
    path = follow_lamps(lamps)
    assert path is not None
    np.testing.assert_allclose(path.shifts, EVEN - EVEN.mean(axis=0), atol=0.05)


def test_images_without_the_pen_do_not_tell_the_way() -> None:
    """A swing that is captured does not keep them, and gives the same tip."""
    dark = np.arange(0, N_IMAGES, 4)
    lamps = lamps_along(CURVE)
    lamps[dark] += 30.0
    seen = leave_out(
        replace(seen_along(CURVE), lamps=lamps), dict.fromkeys(dark, Reason.EMPTY)
    )
    path = pose_steadily(CAMERA, PEN, seen).path
    kept = follow_lamps(np.delete(lamps, dark, axis=0))
    assert path is not None
    assert kept is not None
    assert path.is_followed
    np.testing.assert_array_equal(np.delete(path.shifts, dark, axis=0), kept.shifts)
    assert path.moved == kept.moved


def test_without_lamps_there_is_no_way() -> None:
    assert follow_lamps(np.zeros((N_IMAGES, 0, 2))) is None


@pytest.mark.parametrize("way", [EVEN, BUMP], ids=["even", "bump"])
def test_the_way_of_a_camera_is_taken_out_and_reported(way: FloatArray) -> None:
    calibration = solved(way, way)
    path = calibration.cameras[0].path
    assert path is not None
    assert path.is_followed
    assert calibration.used.all()
    assert errors_in_u(calibration).max() < 1.2
    # 0.0143 mm of it are left to stylus, sag and foot of the camera.
    assert calibration.budget.weakest_uncertainty < 0.02
    codes = {str(each.code) for each in warnings_of(calibration)}
    assert "warning.camera-moved" in codes
    verdict = judge(calibration, SwingLimits())
    assert verdict.grade is Grade.CHECK
    assert verdict.reason.code == Code.CAMERA_MOVED
    assert verdict.next_step is NextStep.CLAMP


@pytest.mark.parametrize("bump", [12.0, 60.0])
def test_a_hard_bump_of_the_camera_is_reported_in_pixels(bump: float) -> None:
    turn = rotation_from_vector(np.array([0.0, bump / CAMERA.fx, 0.0]))
    is_after = (TIME > 0.6)[:, None]
    poses = (
        np.where(is_after[..., None], turn @ SWING.rotations, SWING.rotations),
        np.where(is_after, SWING.translations @ turn.T, SWING.translations),
    )
    rng = np.random.default_rng(7)
    pixels = simulate_centers(CAMERA, PEN, *poses, SIGMA, rng)
    rays = np.column_stack([CAMERA.unproject(LAMPS), np.ones(2)])
    shown = np.where(is_after[..., None], CAMERA.project(rays @ turn.T), LAMPS)
    noisy = shown + 0.02 * rng.standard_normal(shown.shape)
    seen = observe_pixels(pixels, CAMERA, PEN)
    lamps = lamps_among(np.zeros((N_IMAGES, 0, 2)), list(noisy))
    calibration = calibrate(CAMERA, PEN, replace(seen, lamps=lamps))
    reported = [str(each) for each in warnings_of(calibration)]

    assert f"fixed lamps in view and the pen shifted by {bump:.0f}." in " ".join(
        reported
    )
    assert judge(calibration, SwingLimits()).reason.code == Code.CAMERA_MOVED
    assert calibration.used.all()
    assert errors_in_u(calibration).max() < 1.2


def test_a_way_without_a_lamp_is_refused_and_with_one_it_is_not() -> None:
    with pytest.raises(CalibrationError, match="times the image noise"):
        calibrate(CAMERA, PEN, seen_along(CURVE))
    calibration = solved(CURVE, CURVE)
    assert calibration.used.all()
    assert errors_in_u(calibration).max() < 1.2


@pytest.mark.parametrize("times", [3.0, 50.0])
def test_images_that_slipped_with_a_lamp_do_not_tell_that_the_camera_moved(
    times: float,
) -> None:
    slipped = np.outer(TIME > 0.8, [1.0, 0.0])
    seen = replace(seen_along(times * slipped), lamps=lamps_along(slipped))

    path = pose_steadily(CAMERA, PEN, seen).path

    assert path is not None
    assert path.moved > 0.9
    assert not path.is_followed


def test_a_lamp_that_moves_by_itself_changes_nothing() -> None:
    calibration = solved(STILL, EVEN)
    alone = calibrate(CAMERA, PEN, seen_along(STILL))
    path = calibration.cameras[0].path
    assert path is not None
    assert path.moved > 1
    assert not path.is_followed
    np.testing.assert_allclose(
        calibration.joint.tip_pen, alone.joint.tip_pen, atol=1e-3
    )
    codes = [str(each.code) for each in warnings_of(calibration)]
    assert codes == ["warning.lamp-moved"]


@pytest.mark.parametrize(("share", "is_followed"), [(0.46, False), (0.54, True)])
def test_a_camera_moved_if_the_pen_shifts_by_half_as_much_as_the_lamps(
    share: float, is_followed: bool
) -> None:
    seen = replace(seen_along(share * EVEN), lamps=lamps_along(EVEN))
    path = pose_steadily(CAMERA, PEN, seen).path

    assert path is not None
    assert path.is_followed == is_followed


@pytest.mark.parametrize(("slip", "is_followed"), [(0.24, True), (0.32, False)])
def test_what_lies_beyond_three_usual_distances_and_the_lamps_is_a_slip(
    slip: float, is_followed: bool
) -> None:
    """The usual distance is 0.0074 mm, and the way of the lamps 0.028 mm."""
    late = np.outer(TIME > 0.8, [1.0, 0.0])
    seen = replace(seen_along(slip * late), lamps=lamps_along(0.1 * late))
    path = pose_steadily(CAMERA, PEN, seen).path

    assert path is not None
    assert path.is_followed == is_followed


def test_ten_images_are_needed_to_follow_a_lamp() -> None:
    assert follow_lamps(lamps_along(EVEN)[:9]) is None
    assert follow_lamps(lamps_along(EVEN)[:10]) is not None


def test_exact_lamps_that_stand_still_have_no_noise() -> None:
    path = follow_lamps(lamps_along(STILL, 0.0))

    assert path is not None
    assert path.moved == 0
    assert path.noise == pytest.approx(1e-6)


def test_the_motion_of_a_camera_is_taken_out_as_its_turn() -> None:
    """Images of a camera that turns show what one that stands still would."""
    turns = rotation_from_vector(np.outer(np.sin(3 * TIME), [2e-3, -3e-3, 0.0]))
    poses = turns @ SWING.rotations, np.einsum("nij,nj->ni", turns, SWING.translations)
    rng = np.random.default_rng(7)
    pixels = simulate_centers(CAMERA, PEN, *poses, 0.0, rng)
    lamps = np.stack(
        [
            CAMERA.project(np.einsum("nij,j->ni", turns, np.append(ray, 1.0)))
            for ray in CAMERA.unproject(LAMPS)
        ],
        axis=1,
    )
    seen = replace(observe_pixels(pixels, CAMERA, PEN), lamps=lamps)
    steady = pose_steadily(CAMERA, PEN, seen)

    still = simulate_centers(CAMERA, PEN, SWING.rotations, SWING.translations, 0.0, rng)
    assert steady.path is not None
    assert steady.path.is_followed
    # But for a turn that all images share; a turn moves the edges a little more.
    off = steady.observations.pixels - still
    off -= off.mean(axis=0)
    moved = np.abs(pixels - pixels.mean(axis=0) - still + still.mean(axis=0)).max()
    assert moved > 5.0
    assert np.abs(off).max() < 0.15
    np.testing.assert_array_equal(
        steady.observations.pixels, steady.observations.seen_pixels
    )


def test_each_led_is_turned_back_by_what_the_middle_of_the_lamps_shows() -> None:
    lamps = np.array([[200.0, 1900.0], [500.0, 1500.0], [800.0, 1800.0]])
    turns = rotation_from_vector(np.outer(np.sin(3 * TIME), [2e-4, -3e-4, 0.0]))

    def turned(pixels: FloatArray) -> FloatArray:
        rays = np.dstack([CAMERA.unproject(pixels), np.ones(pixels.shape[:-1])])
        return CAMERA.project(rays @ np.swapaxes(turns, 1, 2))

    middle = np.tile(lamps.mean(axis=0), (N_IMAGES, 1, 1))
    path = CameraPath(lamps, (turned(middle) - middle)[:, 0], 0.02, is_followed=True)
    still = seen_along(STILL)
    still.pixels[3, 4] = still.seen_pixels[3, 4] = np.nan
    moving = replace(
        still, pixels=turned(still.pixels), seen_pixels=turned(still.seen_pixels)
    )
    found = steadied(CAMERA, moving, path)

    assert np.nanmax(np.abs(moving.pixels - still.pixels)) > 0.5
    # Less what is of second order in the turn.
    np.testing.assert_allclose(found.pixels, still.pixels, atol=3e-3)
    np.testing.assert_array_equal(found.pixels, found.seen_pixels)
    assert steadied(CAMERA, moving, replace(path, is_followed=False)) is moving
    assert steadied(CAMERA, moving, None) is moving
