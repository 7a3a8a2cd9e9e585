import json
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from tests.simulated_disturbances import Finger, Glare, hidden_fraction, moving_poses
from tests.simulated_lights import Backlight, Defocus, Lamp
from tests.simulated_outlines import measure_insides
from tests.simulated_plans import still_view

from lightpen.arrays import FloatArray
from lightpen.model.camera import Camera
from lightpen_extensions.simulator.render import (
    Light,
    Optics,
    View,
    Window,
    disc_contours,
    led_levels,
    render_view,
)
from lightpen_extensions.simulator.scenes import Sensor
from lightpen_extensions.simulator.swings import (
    PAPER_TIP,
    leds_in_camera,
    paper_camera,
    paper_pen,
    swing_poses,
)

CAMERA = paper_camera()
PEN = paper_pen()
SWING = swing_poses(1, np.random.default_rng(4))
VIEW = still_view(PEN, SWING.rotations[0], SWING.translations[0])
LEDS, NORMALS = leds_in_camera(PEN, SWING.rotations[0], SWING.translations[0])
DARK = replace(VIEW, gains=np.zeros(10))
SMALL = Camera(width=200, height=160, fx=400, fy=400, cx=100, cy=80)


def centroid(light: Light, window: Window) -> FloatArray:
    levels = light.levels[window.slices].astype(np.float64)
    rows, columns = np.indices(levels.shape)
    total = levels.sum()
    return np.array(
        [
            window.left + (columns * levels).sum() / total,
            window.top + (rows * levels).sum() / total,
        ]
    )


@pytest.mark.parametrize("frame", [0, 17])
def test_shared_image_is_this_render_plus_its_noise(
    shared_data: Path, frame: int
) -> None:
    truth = json.loads((shared_data / "swing-clean/truth.json").read_text())
    entry = truth["frames"][frame]
    data = (shared_data / "swing-clean" / entry["file"]).read_bytes()
    image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    assert image is not None
    pen = replace(PEN, leds=np.array(truth["pen"]["leds"]))
    view = View(
        np.array([entry["R"]]),
        np.array([entry["T"]]),
        np.array(truth["pen"]["radiance_gain"]),
    )
    levels = render_view(CAMERA, pen, view, Optics()).levels
    sensor = Sensor()
    lit = levels > 0.01
    charges = levels[lit] * sensor.full_well
    residuals = image[lit] - (charges + sensor.offset) / sensor.electrons_per_dn
    variances = (charges + sensor.read_noise**2) / sensor.electrons_per_dn**2 + 1 / 12
    normalised = residuals / np.sqrt(variances)
    # 16 000 pixels: standard deviation 0.008 of the mean, 0.006 of the spread.
    assert normalised.mean() == pytest.approx(0, abs=0.03)
    assert normalised.std() == pytest.approx(1, abs=0.025)
    contour = levels[lit] < 0.7
    assert normalised[contour].std() == pytest.approx(1, abs=0.06)


def test_level_of_an_led_follows_gain_and_viewing_angle() -> None:
    gains = np.linspace(0.5, 1, 10)
    optics = Optics(peak=0.6, cos_power=2.0, exposure=1.2)
    light = render_view(CAMERA, PEN, replace(VIEW, gains=gains), optics)
    cosines = -np.sum(LEDS * NORMALS, axis=1) / np.linalg.norm(LEDS, axis=1)
    columns, rows = np.rint(CAMERA.project(LEDS)).astype(int).T
    np.testing.assert_allclose(
        light.levels[rows, columns], 0.72 * gains * cosines**2, rtol=1e-4
    )


def test_led_that_faces_away_is_dark() -> None:
    away = replace(PEN, normals=-PEN.normals)
    assert not render_view(CAMERA, away, VIEW, Optics()).windows
    assert not led_levels(LEDS, -NORMALS, Optics()).any()


def test_missing_led_leaves_the_others_as_they_are() -> None:
    gains = np.ones(10)
    gains[3] = 0
    all_lit = render_view(CAMERA, PEN, VIEW, Optics())
    one_off = render_view(CAMERA, PEN, replace(VIEW, gains=gains), Optics())
    assert len(one_off.windows) == 9
    changed = np.argwhere(np.abs(all_lit.levels - one_off.levels) > 1e-3)
    missing = CAMERA.project(LEDS)[3]
    assert np.linalg.norm(changed[:, ::-1] - missing, axis=1).max() < 30


def test_light_beyond_the_border_is_cut_off() -> None:
    lamp = Lamp(np.array([1.0, 80.0]), (10.0, 10.0), level=1.0)
    outside = Lamp(np.array([-90.0, 80.0]), (10.0, 10.0), level=1.0)
    view = replace(DARK, others=(lamp, outside))
    light = render_view(SMALL, PEN, view, Optics())
    assert light.levels.shape == (160, 200)
    assert len(light.windows) == 1
    # The pixels begin at x = -0.5: the half disc and a strip of 1.5 px.
    assert light.levels.sum() == pytest.approx(np.pi * 50 + 1.5 * 20, abs=1.0)


@pytest.mark.parametrize("radius", [2.5, 6.0])
def test_defocus_spreads_the_light_and_keeps_its_amount_and_center(
    radius: float,
) -> None:
    lamp = Lamp(np.array([90.3, 70.8]), (20.0, 15.0), level=1.0)
    view = replace(DARK, others=(lamp,))
    sharp = render_view(SMALL, PEN, view, Optics())
    blurred = replace(view, others=(lamp, Defocus(radius)))
    soft = render_view(SMALL, PEN, blurred, Optics())
    assert soft.levels.sum() == pytest.approx(sharp.levels.sum(), rel=1e-5)
    np.testing.assert_allclose(centroid(soft, soft.windows[-1]), lamp.center, atol=3e-4)
    edge = soft.levels[71, 102:120]
    assert (edge[(edge > 0.1) & (edge < 0.9)]).size >= radius


def test_finger_hides_what_is_behind_it() -> None:
    lamp = Lamp(np.array([100.0, 80.0]), (20.0, 20.0), level=1.0)
    # Its long lower side runs through the lamp's centre.
    finger = Finger(np.array([-50.0, 60.0]), np.array([250.0, 60.0]), 20.0)
    view = replace(DARK, others=(lamp,))
    shown = render_view(SMALL, PEN, replace(view, others=(lamp, finger)), Optics())
    free = render_view(SMALL, PEN, view, Optics())
    assert shown.levels[66, 100] < 1e-3
    assert shown.levels[94, 100] == pytest.approx(1, abs=1e-3)
    assert shown.levels.sum() == pytest.approx(free.levels.sum() / 2, rel=0.03)


def test_hidden_fraction_is_the_covered_share_of_the_area() -> None:
    angles = np.linspace(0, 2 * np.pi, 200, endpoint=False)
    circle = np.array([100.3, 80.6]) + 20 * np.stack(
        [np.cos(angles), np.sin(angles)], axis=-1
    )
    half = Finger(np.array([-50.0, 60.6]), np.array([250.0, 60.6]), 20.0)
    all_over = Finger(np.array([90.0, 80.0]), np.array([110.0, 80.0]), 40.0)
    assert hidden_fraction(SMALL, circle, ()) == 0
    assert hidden_fraction(SMALL, circle, (half,)) == pytest.approx(0.5, abs=0.005)
    assert hidden_fraction(SMALL, circle, (half, all_over)) == 1
    at_border = circle - np.array([100.8, 0])
    assert hidden_fraction(SMALL, at_border, ()) == pytest.approx(0.5, abs=0.005)


def test_glare_has_its_level_inside_and_soft_edges() -> None:
    square = np.array([[50.0, 40.0], [150, 40], [150, 120], [50, 120]])
    view = replace(DARK, others=(Glare(square, level=0.6, softness=4.0),))
    levels = render_view(SMALL, PEN, view, Optics(exposure=2.0)).levels
    assert levels[80, 100] == pytest.approx(1.2, abs=1e-4)
    assert levels[80, 50] == pytest.approx(0.6, abs=0.06)
    assert levels[80, 30] < 1e-3


def test_window_larger_than_the_image_is_bright_up_to_the_border() -> None:
    square = np.array([[-500.0, -500.0], [900, -500], [900, 900], [-500, 900]])
    view = replace(DARK, others=(Glare(square, level=0.5, softness=3.0),))
    levels = render_view(SMALL, PEN, view, Optics()).levels
    np.testing.assert_allclose(levels, 0.5, atol=1e-5)


def test_moving_pen_keeps_its_tip_and_blurs_its_leds() -> None:
    R, t = SWING.rotations[0], SWING.translations[0]
    rotations, translations = moving_poses(R, t, PAPER_TIP, np.array([0, 0, 0.02]), 20)
    tips = rotations @ PAPER_TIP + translations
    np.testing.assert_allclose(tips, np.tile(SWING.tips_cam[0], (20, 1)), atol=1e-9)
    moving = View(rotations, translations, np.eye(10)[3])
    blurred = render_view(CAMERA, PEN, moving, Optics())
    still = render_view(CAMERA, PEN, replace(VIEW, gains=np.eye(10)[3]), Optics())
    assert blurred.levels.sum() == pytest.approx(still.levels.sum(), rel=2e-3)
    assert blurred.windows[0].right - blurred.windows[0].left > 15 + (
        still.windows[0].right - still.windows[0].left
    )
    # The path is an arc: its middle is off the chord by 0.05 px.
    np.testing.assert_allclose(
        centroid(blurred, blurred.windows[0]),
        centroid(still, still.windows[0]),
        atol=0.05,
    )


def test_rendered_centroids_are_those_of_the_exact_discs() -> None:
    contours = disc_contours(CAMERA, LEDS[None], NORMALS[None], PEN.diameter / 2, 0.8)
    exact = measure_insides(contours)
    for led in range(10):
        light = render_view(CAMERA, PEN, replace(VIEW, gains=np.eye(10)[led]), Optics())
        np.testing.assert_allclose(
            centroid(light, light.windows[0]), exact.centroids[led], atol=5e-4
        )


def test_light_from_behind_grows_across_the_image() -> None:
    view = replace(DARK, others=(Backlight(0.3, (0.2, -0.1)),))
    light = render_view(SMALL, PEN, view, Optics(exposure=2.0))
    assert light.windows == (Window(0, 160, 0, 200),)
    assert light.levels[:, 0].mean() == pytest.approx(0.4, abs=0.002)
    assert light.levels[:, -1].mean() == pytest.approx(0.8, abs=0.002)
    assert light.levels[0].mean() - light.levels[-1].mean() == pytest.approx(
        0.2, abs=0.002
    )


def test_blur_too_sharp_for_the_method_is_refused() -> None:
    with pytest.raises(ValueError, match="psf_sigma"):
        Optics(psf_sigma=0.1)
