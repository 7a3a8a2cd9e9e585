"""The diameter of the discs, by the areas of their images."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lightpen.arrays import FloatArray
from lightpen.detection.observations import Observations, observe_centers
from lightpen.estimation.calibrate import Calibration, calibrate
from lightpen.estimation.disc_diameter import MIN_READINGS, read_diameter
from lightpen.estimation.linearised import BundleState
from lightpen.estimation.report import warnings_of
from lightpen.estimation.verdict import Grade, judge
from lightpen.formats.observation_files import Centers
from lightpen.model.ellipse import disc_images
from lightpen.model.limits import SwingLimits
from lightpen.model.rig import rig_of
from lightpen.simulator.swings import (
    leds_in_camera,
    paper_camera,
    paper_pen,
    simulate_centers,
    swing_poses,
)

CAMERA = paper_camera()
PEN = replace(paper_pen(), led_sigma=0.002)
RIM = 2.2  # px, of a sharp image
SWING = swing_poses(40, np.random.default_rng(3))


def true_areas() -> FloatArray:
    leds, normals = leds_in_camera(PEN, SWING.rotations, SWING.translations)
    shapes = disc_images(CAMERA, leds, normals, PEN.diameter / 2).shapes
    areas: FloatArray = 4 * np.pi * np.sqrt(np.linalg.det(shapes))
    return areas


def state_with(diameter: float) -> BundleState:
    pen = replace(PEN, diameter=diameter)
    return BundleState(
        rig_of(CAMERA), pen, SWING.tip_pen, SWING.cone_cam, SWING.rotations
    )


def observed(areas: FloatArray) -> Observations:
    rng = np.random.default_rng(4)
    pixels = simulate_centers(
        CAMERA, PEN, SWING.rotations, SWING.translations, 0.03, rng
    )
    centers = Centers(np.arange(len(SWING)), pixels, Path("simulated"))
    seen = observe_centers(centers, CAMERA, PEN)
    return replace(seen, areas=areas, edge_widths=np.full(len(SWING), RIM))


def calibrated(said: float, areas: FloatArray) -> Calibration:
    return calibrate(CAMERA, replace(PEN, diameter=said), observed(areas))


@pytest.mark.parametrize("said", [9.0, 10.0, 13.0])
def test_exact_areas_give_the_exact_diameter_whatever_is_said(said: float) -> None:
    widths = np.full((len(SWING), 1), RIM)
    reading = read_diameter(state_with(said), true_areas()[:, None], widths)

    assert reading is not None
    # An area goes with the diameter squared but for the disc's own perspective.
    assert reading.value == pytest.approx(PEN.diameter, rel=1e-5)


def test_a_rim_that_all_leds_have_displaced_is_within_the_uncertainty() -> None:
    radii = np.sqrt(true_areas() / np.pi) + 0.05 * RIM
    widths = np.full((len(SWING), 1), RIM)
    reading = read_diameter(state_with(10.0), np.pi * radii[:, None] ** 2, widths)

    assert reading is not None
    assert abs(reading.value - PEN.diameter) <= 1.1 * reading.sigma


def test_an_led_that_looks_small_does_not_pull_the_diameter() -> None:
    areas = true_areas()
    areas[:, 3] *= 0.3
    widths = np.full((len(SWING), 1), RIM)
    reading = read_diameter(state_with(10.0), areas[:, None], widths)

    assert reading is not None
    assert reading.value == pytest.approx(PEN.diameter, rel=1e-6)


def test_few_areas_tell_nothing() -> None:
    areas = np.full((len(SWING), 1, PEN.n_leds), np.nan)
    areas.flat[: MIN_READINGS - 1] = 1000.0
    widths = np.full((len(SWING), 1), RIM)

    assert read_diameter(state_with(10.0), areas, widths) is None


@pytest.mark.parametrize("said", [9.0, 11.0, 13.0])
def test_a_wrong_diameter_is_put_right_and_named(said: float) -> None:
    result = calibrated(said, true_areas())

    assert result.bundle.state.pen.diameter == pytest.approx(10.0, rel=0.01)
    right = calibrated(10.0, true_areas())
    moved = np.linalg.norm(result.joint.tip_pen - right.joint.tip_pen)
    assert moved < 0.0005  # of the 14 um that 13 mm make
    (contradiction,) = result.contradictions
    assert contradiction.of_pen
    assert "contradict the LED file: they want the diameter of the discs" in str(
        contradiction.sentence
    )
    assert contradiction.sentence in warnings_of(result)
    assert judge(result, SwingLimits()).grade is Grade.CHECK


def test_a_right_diameter_is_not_contradicted_by_discs_that_look_larger() -> None:
    result = calibrated(10.0, 1.01 * true_areas())
    assert not result.contradictions


def test_centres_alone_say_nothing_against_a_diameter() -> None:
    nothing = np.full((len(SWING), PEN.n_leds), np.nan)
    result = calibrated(13.0, nothing)

    assert result.priors.reading is None
    assert not result.contradictions
