"""A displaced LED leaves two frames, and both tips are reported."""

from dataclasses import replace

import numpy as np
import pytest
from tests.simulated_centers import calibrate_pixels

from lightpen.arrays import FloatArray
from lightpen.estimation.bundle.bundle import Bundle, fit_bundle
from lightpen.estimation.bundle.image_fields import seat_modes_of
from lightpen.estimation.bundle.led_quality import LedQuality, tip_frames
from lightpen.estimation.bundle.linearised import BundleState
from lightpen.estimation.bundle.priors import priors_of
from lightpen.estimation.reports.summary import calibration_text
from lightpen.estimation.reports.verdict import judge
from lightpen.model.limits import USUAL, SwingLimits
from lightpen.model.rigid import fit_rigid, rig_of
from lightpen_extensions.simulator.swings import (
    paper_camera,
    paper_pen,
    simulate_centers,
    swing_poses,
)

CAMERA, PEN = paper_camera(), paper_pen()
MOVED = np.array([0.3, 0.0, 0.2])  # mm, of LED 9 since its file was made


def test_a_displaced_led_leaves_two_frames() -> None:
    rng = np.random.default_rng(262)
    swing = swing_poses(60, rng)
    leds = PEN.leds.copy()
    leds[8] += MOVED
    true = replace(PEN, leds=leds)
    pixels = simulate_centers(
        CAMERA, true, swing.rotations, swing.translations, 0.02, rng
    )
    found = calibrate_pixels(pixels, CAMERA, PEN)
    assert found.leds.displaced == (9,)
    frames = found.tip_frames
    assert frames is not None
    U = found.budget.expanded_uncertainty[:3]
    assert frames.is_of_file
    assert (np.abs(frames.of_file - swing.tip_pen) < U).all()
    R, t = fit_rigid(leds, PEN.leds)
    assert (np.abs(frames.of_all - (R @ swing.tip_pen + t)) < U).all()
    assert np.linalg.norm(frames.of_all - frames.of_file) > 0.015
    text = calibration_text(found, None, judge(found, SwingLimits()))
    assert "Result and U refer to the former." in text
    assert " ".join(f"{value:.4f}" for value in frames.of_all) in text


@pytest.fixture(scope="module")
def bundle() -> Bundle:
    rng = np.random.default_rng(1)
    swing, rig = swing_poses(15, rng), rig_of(CAMERA)
    poses = swing.rotations, swing.translations
    pixels = simulate_centers(CAMERA, PEN, *poses, 0.02, rng)[:, None]
    state = BundleState(rig, PEN, swing.tip_pen, swing.cone_cam, swing.rotations)
    modes = seat_modes_of(swing.rotations)
    return fit_bundle(pixels, state, priors_of(rig, PEN, USUAL), modes, 1.0)


def with_leds(bundle: Bundle, leds: FloatArray) -> Bundle:
    """Return the fit with other LEDs."""
    pen = replace(bundle.state.pen, leds=leds)
    return replace(bundle, state=replace(bundle.state, pen=pen))


def quality(*displaced: int, n_used: int = 15) -> LedQuality:
    """Return the quality of LEDs, with the numbers of displaced ones, from 1."""
    some = np.array(displaced, dtype=int) - 1
    used, moves = np.full(PEN.n_leds, 15), np.zeros((PEN.n_leds, 3))
    used[some], moves[some] = n_used, MOVED
    return LedQuality(
        n_seen=np.full(PEN.n_leds, 15),
        n_used=used,
        rms=np.zeros(PEN.n_leds),
        mean=np.zeros((PEN.n_leds, 2)),
        displacement=moves,
        displaced=displaced,
    )


TIP = np.array([1.0, -90.0, -25.0])
OFF = PEN.leds + MOVED * (np.arange(PEN.n_leds) == 8)[:, None]


@pytest.mark.parametrize("is_fitted", [True, False])
def test_the_frame_of_the_file_is_that_in_which_the_others_fit_it(
    bundle: Bundle, is_fitted: bool
) -> None:
    """An LED left out of most images stands where its displacement says."""
    fitted = with_leds(bundle, OFF if is_fitted else PEN.leds)
    frames = tip_frames(fitted, quality(9, n_used=15 if is_fitted else 7), TIP)

    R, t = fit_rigid(OFF, PEN.leds)
    assert frames is not None
    np.testing.assert_allclose(frames.of_file, TIP, atol=1e-9)
    np.testing.assert_allclose(frames.of_all, R @ TIP + t, atol=1e-9)
    assert frames.is_of_file
    assert np.linalg.norm(frames.of_all - TIP) > 0.01


def test_a_tip_in_the_frame_of_all_leds_is_said_to_be(bundle: Bundle) -> None:
    R, t = fit_rigid(OFF, PEN.leds)
    fitted = with_leds(bundle, OFF @ R.T + t)

    frames = tip_frames(fitted, quality(9, n_used=8), TIP)

    assert frames is not None
    np.testing.assert_allclose(frames.of_all, TIP, atol=1e-9)
    np.testing.assert_allclose(frames.of_file, R.T @ (TIP - t), atol=1e-9)
    assert not frames.is_of_file


def test_a_frame_needs_four_leds_and_one_that_is_displaced(bundle: Bundle) -> None:
    assert tip_frames(bundle, quality(), TIP) is None
    assert tip_frames(bundle, quality(1, 2, 3, 7, 8, 9), TIP) is not None
    assert tip_frames(bundle, quality(1, 2, 3, 7, 8, 9, 10), TIP) is None
