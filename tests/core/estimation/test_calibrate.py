"""A whole calibration from LED centres: the tip, what was left out, what is refused."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.simulated_centers import simulate_centers
from tests.simulated_disturbances import slip_tip
from tests.simulated_swings import SwingKind, swing_of_kind

from lightpen.arrays import FloatArray
from lightpen.detection.observations import observe_centers
from lightpen.detection.reasons import Reason
from lightpen.errors import CalibrationError
from lightpen.estimation.calibrate import Calibration, calibrate
from lightpen.formats.observation_files import Centers
from lightpen.model.pen import Pen
from lightpen_extensions.simulator.swings import Swing, paper_camera, paper_pen

CAMERA = paper_camera()
PEN = paper_pen()


def centers(of: Swing, sigma: float, seed: int = 1) -> FloatArray:
    rng = np.random.default_rng(seed)
    return simulate_centers(CAMERA, PEN, of.rotations, of.translations, sigma, rng)


def calibration(pixels: FloatArray, pen: Pen = PEN) -> Calibration:
    frames = np.arange(len(pixels)) + 1
    given = Centers(frames, pixels, Path("centers.csv"))
    return calibrate(CAMERA, pen, observe_centers(given, CAMERA, pen))


def swing(n_frames: int = 60, kind: SwingKind = "field", seed: int = 0) -> Swing:
    return swing_of_kind(n_frames, np.random.default_rng(seed), kind)


def test_exact_centres_give_the_exact_tip_by_the_joint_fit() -> None:
    truth = swing()
    result = calibration(centers(truth, 0.0))

    np.testing.assert_allclose(result.joint.tip_pen, truth.tip_pen, atol=1e-6)
    np.testing.assert_allclose(result.joint.cone_cam, truth.cone_cam, atol=1e-5)
    assert result.used.all()


def test_projected_centres_cost_the_papers_method_some_micrometres() -> None:
    """The paper takes ellipse centres for projected ones, METHODS of this error."""
    truth = swing(200)
    result = calibration(centers(truth, 0.0))
    error = result.two_stage.tip_pen - truth.tip_pen

    assert 0.01 < np.linalg.norm(error) < 0.05


def test_slipped_images_are_left_out_with_their_reason() -> None:
    rng = np.random.default_rng(2)
    slipped = np.arange(100) % 33 == 5
    truth = slip_tip(swing(100), slipped, 0.3, rng)
    result = calibration(centers(truth, 0.02))

    np.testing.assert_array_equal(~result.used, slipped)
    assert {r for r in result.reasons if r} == {Reason.SLIPPED}
    distance = np.linalg.norm(result.tips_cam[slipped] - result.joint.cone_cam, axis=1)
    np.testing.assert_allclose(distance, 0.3, atol=0.15)


def test_images_whose_leds_do_not_fit_are_left_out_with_their_reason() -> None:
    pixels = centers(swing(), 0.02)
    pixels[4] = np.random.default_rng(3).uniform(0, 2000, pixels[4].shape)
    result = calibration(pixels)

    assert result.reasons[4] is Reason.MISFIT
    assert result.used.sum() == 59


def test_an_image_of_which_half_the_leds_do_not_fit_is_left_out() -> None:
    pixels = centers(swing(), 0.02)
    pixels[4, :5] += np.random.default_rng(4).uniform(0.5, 1, (5, 2))
    result = calibration(pixels)

    assert result.reasons[4] is Reason.MISFIT
    assert result.used.sum() == 59


def test_a_tip_slightly_off_in_a_smeared_image_is_no_slip() -> None:
    off = np.zeros((60, 3))
    off[[5, 15, 25], 0] = [0.1, 0.1, 0.4]
    truth = swing()
    moved = replace(truth, translations=truth.translations + off)
    frames = np.arange(60) + 1
    given = Centers(frames, centers(moved, 0.02), Path("centers.csv"))
    smeared = np.isin(np.arange(60), [5, 25, 35])
    observations = replace(
        observe_centers(given, CAMERA, PEN), edge_widths=np.where(smeared, 4.0, 2.0)
    )

    result = calibrate(CAMERA, PEN, observations)

    reported = {i: reason for i, reason in enumerate(result.reasons) if reason}
    assert reported == {5: Reason.BLURRED, 15: Reason.SLIPPED, 25: Reason.SLIPPED}


def test_the_rms_is_that_in_the_fit_and_of_a_dropped_image_about_its_own_pose() -> None:
    truth = slip_tip(swing(), np.arange(60) == 7, 2.0, np.random.default_rng(5))
    result = calibration(centers(truth, 0.02))

    used = np.arange(60) != 7
    np.testing.assert_array_equal(result.rms[used], result.joint.image_rms)
    assert result.reasons[7] is Reason.SLIPPED
    assert result.rms[7] < 0.05  # in the fit it would be 8 px


def test_an_led_left_out_in_one_image_is_reported() -> None:
    pixels = centers(swing(), 0.02)
    pixels[7, 3] += 2.0
    result = calibration(pixels)

    assert not result.cameras[0].leds_used[7, 3]
    assert result.cameras[0].leds_used.sum() == 60 * 10 - 1


def test_seated_operator_swings_calibrate() -> None:
    truth = swing(300, "operator")
    result = calibration(centers(truth, 0.03))
    error = np.abs(result.joint.tip_pen - truth.tip_pen)

    assert (error < 1.5 * result.budget.expanded_uncertainty[:3]).all()


@pytest.mark.parametrize(
    ("kind", "message"), [("one-axis", "one axis"), ("upright", "hardly moved")]
)
def test_degenerate_swings_are_refused(kind: SwingKind, message: str) -> None:
    with pytest.raises(CalibrationError, match=message):
        calibration(centers(swing(100, kind), 0.02))


def test_five_images_are_refused_with_what_is_needed() -> None:
    with pytest.raises(CalibrationError, match=r"5 of 5 images .* at least 6"):
        calibration(centers(swing(5), 0.02))


def test_what_was_left_out_is_counted_when_too_few_images_remain() -> None:
    pixels = centers(swing(8), 0.02)
    pixels[:4, 3:] = np.nan

    with pytest.raises(CalibrationError, match="4 too few LEDs"):
        calibration(pixels)


@pytest.mark.parametrize(
    ("noise", "words"),
    [
        (0.02, "times the image noise"),
        # The files are more likely at fault.
        (0.5, "LED positions and images disagree: 0.47 px"),
    ],
)
def test_a_tip_that_was_not_in_the_cone_is_refused(noise: float, words: str) -> None:
    truth = swing(60)
    angles = np.linspace(0, 2 * np.pi, 60)
    circle = 30 * np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    moving = replace(truth, translations=truth.translations + circle)

    with pytest.raises(CalibrationError, match=words):
        calibration(centers(moving, noise))


def test_a_pen_file_of_another_pen_is_refused() -> None:
    other = replace(PEN, leds=PEN.leds * [1.3, 0.8, 1.5] + [0, 5, 0])

    with pytest.raises(CalibrationError, match="LED positions and images disagree:"):
        calibration(centers(swing(), 0.02), other)


def test_a_scaled_camera_shows_in_the_cone_not_in_silence() -> None:
    truth = swing(200)
    result = calibration(centers(truth, 0.02))

    error = np.abs(result.joint.cone_cam - truth.cone_cam)
    assert (error < 2 * result.budget.expanded_uncertainty[3:]).all()
