"""Parts of the LEDs predict the others: what residuals hide shows, noise does not."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from tests.simulated_centers import calibrate_pixels, simulate_centers
from tests.simulated_rigs import from_first, row_of_cameras

from lightpen.arrays import FloatArray
from lightpen.estimation.bundle.consistency_test import SelfCheck, check_prediction
from lightpen.estimation.bundle.linearised import BundleState, views_at
from lightpen.estimation.calibrate import Calibration
from lightpen.estimation.reports.report_warnings import warnings_of
from lightpen.estimation.reports.summary import calibration_text
from lightpen.estimation.reports.verdict import judge
from lightpen.model.limits import SwingLimits
from lightpen.model.rigid import nearest_rotation, vector_from_rotation
from lightpen_extensions.simulator.swings import (
    Swing,
    paper_camera,
    paper_pen,
    seen_from,
    swing_poses,
)

CAMERA, PEN = paper_camera(), paper_pen()
N_IMAGES, NOISE = 100, 0.03


def of_swing(seed: int) -> tuple[Swing, FloatArray]:
    rng = np.random.default_rng([261, seed])
    swing = swing_poses(N_IMAGES, rng)
    pixels = simulate_centers(
        CAMERA, PEN, swing.rotations, swing.translations, NOISE, rng
    )
    return swing, pixels


@cache
def good() -> tuple[Swing, FloatArray, Calibration]:
    swing, pixels = of_swing(0)
    return swing, pixels, calibrated(pixels)


def calibrated(pixels: FloatArray) -> Calibration:
    return calibrate_pixels(pixels, CAMERA, PEN)


def checked(state: BundleState, pixels: FloatArray) -> tuple[SelfCheck, float]:
    """Return the check of a state, and the residuals of each image's own pose, px."""
    (view,) = views_at(state, pixels[:, None])
    used = np.isfinite(pixels[:, None, :, 0])
    residuals = view.residuals[:, None]
    found = check_prediction(state, residuals, used, np.ones(used.shape[1:]))
    assert found is not None
    J = np.concatenate([view.turn, view.cone], axis=-1).reshape(len(pixels), -1, 6)
    r = view.residuals.reshape(len(pixels), -1, 1)
    left = r - J @ (np.linalg.pinv(J) @ r)
    return found, float(np.sqrt(np.sum(left**2) / (left.size - 6 * len(left))))


def wandering(swing: Swing) -> FloatArray:
    """Return shifts of each LED's image by the lean, each its own way, px."""
    lean = swing.rotations[:, :, 1] - swing.rotations[:, :, 1].mean(axis=0)
    ways = np.random.default_rng(4).normal(0, 0.06, (PEN.n_leds, 3, 2))
    return np.asarray(np.einsum("ni,lij->nlj", lean, ways))


def test_noise_alone_passes() -> None:
    check = good()[2].self_check
    assert check is not None
    assert 0.8 < check.value < check.limit < 1.25


def test_noise_alone_exceeds_the_limit_rarely() -> None:
    _, _, calibration = good()
    state, rng = calibration.bundle.state, np.random.default_rng(5)
    used = np.ones((N_IMAGES, 1, PEN.n_leds), dtype=bool)
    noise = np.ones((1, PEN.n_leds))
    drawn = [
        check_prediction(state, rng.normal(0, 0.1, (*used.shape, 2)), used, noise)
        for _ in range(40)
    ]
    values = [each.value for each in drawn if each is not None]
    assert np.mean(values) == pytest.approx(1.0, abs=0.04)
    assert sum(not each.is_passed for each in drawn if each is not None) <= 4


def test_leds_that_wander_with_the_lean_are_reported() -> None:
    swing, pixels, _ = good()
    found = calibrated(pixels + wandering(swing))
    assert found.self_check is not None
    assert not found.self_check.is_passed
    codes = [each.code for each in warnings_of(found)]
    assert "warning.self-check" in codes
    text = calibration_text(found, None, judge(found, SwingLimits()))
    assert "Self-check" in text


def test_a_wrong_led_file_shows_that_residuals_hide() -> None:
    _, pixels, calibration = good()
    off = np.random.default_rng(6).normal(0, 0.004, PEN.leds.shape)
    state = calibration.bundle.state
    wrong = replace(state, pen=replace(state.pen, leds=state.pen.leds + off))
    (right, rms), (found, rms_wrong) = (checked(s, pixels) for s in (state, wrong))
    assert right.is_passed
    assert not found.is_passed
    assert rms_wrong < 1.2 * rms


def test_a_wrong_camera_file_shows_that_residuals_hide() -> None:
    _, pixels, calibration = good()
    state = calibration.bundle.state
    camera = state.rig.cameras[0]
    distortion = camera.distortion.copy()
    distortion[0] += 0.01
    off = replace(camera, distortion=distortion)
    found, rms = checked(replace(state, rig=replace(state.rig, cameras=(off,))), pixels)
    assert not found.is_passed
    assert rms < 1.2 * NOISE


def test_a_pen_that_sags_shows_that_residuals_hide() -> None:
    swing, pixels, calibration = good()
    R = swing.rotations
    down = R[:, 1].copy()  # in the pen's frame, the camera's v axis
    down[:, 1] = 0.0
    heights = PEN.leds[:, 1] - PEN.leds[:, 1].min()
    bend = 0.06 * (heights / heights.max()) ** 2
    moves = np.einsum("nij,nj,l->nli", R, down, bend)
    (view,) = views_at(calibration.bundle.state, pixels[:, None])
    shifts = np.einsum("nlik,nlk->nli", view.cone, moves)
    found, rms = checked(calibration.bundle.state, pixels + shifts)
    assert not found.is_passed
    assert rms < 1.2 * NOISE


def test_a_lens_field_shows_that_residuals_hide() -> None:
    _, pixels, calibration = good()
    u, v = pixels[..., 0] / 260.0, pixels[..., 1] / 330.0
    field = 0.03 * np.sqrt(2) * np.stack([np.sin(u + 0.7 * v), np.cos(v - u)], axis=-1)
    found, rms = checked(calibration.bundle.state, pixels + field)
    assert not found.is_passed
    assert rms < 1.2 * NOISE


def test_images_that_lack_an_led_take_no_part() -> None:
    _, pixels, calibration = good()
    state, is_whole = calibration.bundle.state, np.arange(N_IMAGES) % 10 > 0
    hidden = np.where(
        is_whole[:, None, None] | (np.arange(PEN.n_leds) != 2)[:, None], pixels, np.nan
    )
    used = np.isfinite(hidden[:, None, :, 0])
    (view,) = views_at(state, hidden[:, None])
    residuals, noise = view.residuals[:, None], np.ones(used.shape[1:])

    whole = replace(state, rotations=state.rotations[is_whole])
    found = check_prediction(state, residuals, used, noise)
    assert found == check_prediction(whole, residuals[is_whole], used[is_whole], noise)
    assert found is not None


def test_few_images_are_not_checked() -> None:
    _, pixels, _ = good()
    assert calibrated(pixels[:20]).self_check is None


def test_the_value_is_the_ratio_of_what_the_posture_explains_to_the_rest() -> None:
    """Written out image by image, for LEDs of two cameras and noise that differs."""
    rng = np.random.default_rng(7)
    row = row_of_cameras(2, 1000.0)
    rig, n_images, n_leds = from_first(row), 40, 7
    some = [0, 4, 7, 1, 5, 8, 2, 9]  # no four of them in a line
    pen = replace(PEN, leds=PEN.leds[some], normals=PEN.normals[some])
    swing = seen_from(swing_poses(n_images, rng), row.rotations[0], row.translations[0])
    state = BundleState(rig, pen, swing.tip_pen, swing.cone_cam, swing.rotations)
    noise = rng.uniform(0.5, 2.0, (n_images, 2, len(some)))
    residuals = 0.03 * noise[..., None] * rng.standard_normal((*noise.shape, 2))
    used = np.ones(noise.shape, bool)
    used[3:9, 1, 2] = used[:, 0, 5] = False
    used[35:, :, 6] = False  # so these images take no part
    used[27:, :, 7] = False  # and this LED
    residuals[~used] = np.nan

    found = check_prediction(state, residuals, used, noise, 1.3)

    views = views_at(state, residuals)
    J = np.stack([np.concatenate([v.turn, v.cone], axis=-1) for v in views], axis=1)
    whole = np.arange(35)
    R = swing.rotations[whole]
    turns = vector_from_rotation(nearest_rotation(R.mean(axis=0)).T @ R)
    x, y, z = turns.T
    basis = np.stack([x**0, x, y, z, x * x, x * y, x * z, y * y, y * z, z * z], axis=1)
    errors: list[list[FloatArray]] = []
    for first in range(n_leds):
        half = (first + np.arange(4)) % n_leds
        of_images = []
        for i in whole:
            seen = used[i, :, :n_leds, None]
            weight = np.where(seen, 1 / noise[i, :, :n_leds, None], 0.0)
            r = np.nan_to_num(residuals[i, :, :n_leds]) * weight
            A = J[i, :, :n_leds] * weight[..., None]
            P = np.linalg.inv(np.einsum("clik,clim->km", A[:, half], A[:, half]))
            pose = P @ np.einsum("clik,cli->k", A[:, half], r[:, half])
            spread = np.sqrt(1 + np.einsum("clik,km,clim->cli", A, P, A))
            off = np.where(seen, (r - A @ pose) / spread, 0.0)
            of_images.append(np.delete(off, half, axis=1).ravel())
        errors.append(of_images)
    flat = np.concatenate(np.array(errors), axis=1)
    left = flat - basis @ np.linalg.lstsq(basis, flat, rcond=None)[0]
    by_posture, rest = np.sum(flat**2) - np.sum(left**2), np.sum(left**2)
    assert found is not None
    assert found.value == pytest.approx(
        np.sqrt(by_posture / 10 / (rest / (35 - 10))), rel=1e-4
    )
    # An image has 13 LEDs of both cameras, and a pose of six numbers.
    n_free = 10 * (2 * 13 - 6)
    spread_of_f = 2.3263 * np.sqrt(2 / n_free)
    assert found.limit == pytest.approx(np.sqrt(1.3 * (1 + spread_of_f)), rel=1e-4)
