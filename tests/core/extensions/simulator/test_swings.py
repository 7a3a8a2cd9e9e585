import json
from dataclasses import replace
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from tests.simulated_centers import simulate_centers
from tests.simulated_disturbances import slip_tip
from tests.simulated_pens import SAMPLE_PENS
from tests.simulated_swings import SwingKind, swing_of_kind

from lightpen.model.ellipse import ellipse_centers
from lightpen_extensions.simulator.swings import (
    MIN_GAP,
    PAPER_CONE,
    PAPER_TIP,
    Postures,
    edge_gaps,
    faces_camera,
    leds_in_camera,
    paper_camera,
    paper_pen,
    perturbed_pen,
    swing_from_postures,
    swing_poses,
)

CAMERA = paper_camera()
PEN = paper_pen()


@pytest.mark.parametrize("kind", get_args(SwingKind))
def test_tip_stays_in_the_cone(kind: SwingKind) -> None:
    swing = swing_of_kind(40, np.random.default_rng(1), kind)
    tips = swing.rotations @ PAPER_TIP + swing.translations
    np.testing.assert_allclose(tips, np.tile(PAPER_CONE, (40, 1)), atol=1e-9)
    assert not swing.slipped.any()


@pytest.mark.parametrize("name", SAMPLE_PENS)
def test_every_led_is_whole_and_clear_in_a_careful_swing(name: str) -> None:
    pen = SAMPLE_PENS[name]()
    rng = np.random.default_rng(2)
    swing = swing_poses(60, rng, pen=pen)
    leds, normals = leds_in_camera(pen, swing.rotations, swing.translations)
    pixels = CAMERA.project(leds)
    assert faces_camera(leds, normals).all()
    assert pixels.min() > 25
    assert (pixels < np.array([CAMERA.width, CAMERA.height]) - 25).all()
    gaps = edge_gaps(CAMERA, pen, swing.rotations, swing.translations)
    assert gaps.min() >= MIN_GAP


@pytest.mark.slow
def test_cone_out_of_sight_is_refused() -> None:
    far_aside = PAPER_CONE + np.array([500.0, 0, 0])
    with pytest.raises(ValueError, match="cone_cam"):
        swing_poses(5, np.random.default_rng(1), cone_cam=far_aside)


def test_postures_of_the_shared_set_give_its_poses_and_centers(
    shared_data: Path,
) -> None:
    truth = json.loads((shared_data / "swing-clean/truth.json").read_text())
    frames = truth["frames"]
    keys = ("tilt_deg", "tilt_dir_deg", "roll_deg")
    angles = np.radians([[frame["posture"][k] for frame in frames] for k in keys])
    swing = swing_from_postures(Postures(*angles))
    pen = replace(PEN, leds=np.array(truth["pen"]["leds"]))
    # The truth is written with 1e-6 degrees and 1e-6 px.
    np.testing.assert_allclose(
        swing.rotations, [frame["R"] for frame in frames], atol=3e-8
    )
    centers = simulate_centers(
        CAMERA, pen, swing.rotations, swing.translations, 0, np.random.default_rng(1)
    )
    expected = [[led["ellipse_center"] for led in frame["leds"]] for frame in frames]
    np.testing.assert_allclose(centers, expected, atol=2e-5)
    np.testing.assert_allclose(
        edge_gaps(CAMERA, pen, swing.rotations, swing.translations),
        [frame["min_gap_px"] for frame in frames],
        atol=1e-3,
    )


def test_slip_moves_the_tip_by_its_distance_and_nothing_else() -> None:
    rng = np.random.default_rng(5)
    swing = swing_poses(10, rng)
    frames = np.arange(10) % 3 == 0
    slipped = slip_tip(swing, frames, np.linspace(0.2, 2, 10), rng)
    distances = np.linalg.norm(slipped.tips_cam - PAPER_CONE, axis=1)
    np.testing.assert_allclose(distances[frames], np.linspace(0.2, 2, 10)[frames])
    np.testing.assert_array_equal(slipped.slipped, frames)
    tips = slipped.rotations @ PAPER_TIP + slipped.translations
    np.testing.assert_allclose(tips, slipped.tips_cam, atol=1e-9)
    np.testing.assert_array_equal(slipped.rotations, swing.rotations)


def test_centers_scatter_about_the_ellipse_centers() -> None:
    swing = swing_poses(500, np.random.default_rng(6))
    leds, normals = leds_in_camera(PEN, swing.rotations, swing.translations)
    exact = ellipse_centers(CAMERA, leds, normals, PEN.diameter / 2)
    rng = np.random.default_rng(7)
    noisy = simulate_centers(
        CAMERA, PEN, swing.rotations, swing.translations, 0.05, rng
    )
    errors = noisy - exact
    # 10 000 draws: relative standard deviation 0.7 % of sigma, 1 % of it in the mean.
    assert errors.std() == pytest.approx(0.05, rel=0.03)
    assert abs(errors.mean()) < 0.002


def test_leds_that_face_away_are_missing() -> None:
    away = replace(PEN, normals=-PEN.normals)
    swing = swing_poses(3, np.random.default_rng(1))
    centers = simulate_centers(
        CAMERA, away, swing.rotations, swing.translations, 0, np.random.default_rng(1)
    )
    assert np.isnan(centers).all()


def test_leds_outside_the_image_are_missing() -> None:
    swing = swing_poses(3, np.random.default_rng(1))
    aside = swing.translations + np.array([300.0, 0, 0])
    centers = simulate_centers(
        CAMERA, PEN, swing.rotations, aside, 0, np.random.default_rng(1)
    )
    leds, _ = leds_in_camera(PEN, swing.rotations, aside)
    outside = CAMERA.project(leds)[..., 0] > CAMERA.width
    assert outside.any()
    assert np.isnan(centers[outside]).all()


def test_perturbed_pen_scatters_about_the_design() -> None:
    rng = np.random.default_rng(9)
    offsets = np.stack(
        [perturbed_pen(PEN, 0.01, rng).leds - PEN.leds for _ in range(200)]
    )
    # 6000 draws: 1 % standard deviation.
    assert offsets.std() == pytest.approx(0.01, rel=0.04)
