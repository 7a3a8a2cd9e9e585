"""The diameter of the discs, by the areas of their images."""

from dataclasses import replace

import numpy as np
import pytest
from tests.simulated_centers import observe_pixels, simulate_centers
from tests.simulated_pens import fanned_pen

from lightpen.arrays import FloatArray
from lightpen.detection.observations import Observations
from lightpen.estimation.bundle.linearised import BundleState
from lightpen.estimation.bundle.priors import MIN_READINGS, SHARP_EDGE, read_diameter
from lightpen.estimation.calibrate import Calibration, calibrate
from lightpen.estimation.reports.report_warnings import warnings_of
from lightpen.estimation.reports.verdict import Grade, judge
from lightpen.estimation.uncertainty.budget import ContributionName
from lightpen.model.ellipse import disc_images
from lightpen.model.limits import SwingLimits
from lightpen.model.pen import Pen
from lightpen.model.rigid import rig_of
from lightpen_extensions.simulator.swings import (
    leds_in_camera,
    paper_camera,
    paper_pen,
    swing_poses,
)

CAMERA = paper_camera()
PEN = replace(paper_pen(), led_sigma=0.002)
RIM = 2.2  # px, of a sharp image
SWING = swing_poses(40, np.random.default_rng(3))


def true_areas(pen: Pen = PEN) -> FloatArray:
    leds, normals = leds_in_camera(pen, SWING.rotations, SWING.translations)
    shapes = disc_images(CAMERA, leds, normals, pen.diameter / 2).shapes
    areas: FloatArray = 4 * np.pi * np.sqrt(np.linalg.det(shapes))
    return areas


def state_with(diameter: float) -> BundleState:
    pen = replace(PEN, diameter=diameter)
    return BundleState(
        rig_of(CAMERA), pen, SWING.tip_pen, SWING.cone_cam, SWING.rotations
    )


def observed(
    areas: FloatArray, pen: Pen = PEN, rim: float = RIM, seed: int = 4
) -> Observations:
    rng = np.random.default_rng(seed)
    pixels = simulate_centers(
        CAMERA, pen, SWING.rotations, SWING.translations, 0.03, rng
    )
    seen = observe_pixels(pixels, CAMERA, pen)
    return replace(seen, areas=areas, edge_widths=np.full(len(SWING), rim))


def calibrated(said: float, areas: FloatArray) -> Calibration:
    return calibrate(CAMERA, replace(PEN, diameter=said), observed(areas))


@pytest.mark.parametrize("said", [9.0, 10.0, 13.0])
def test_exact_areas_give_the_exact_diameter_whatever_is_reported(said: float) -> None:
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


def test_areas_that_scatter_make_the_diameter_less_certain() -> None:
    areas = true_areas()
    areas[:, ::2] *= 1.1**2
    areas[:, 1::2] *= 0.9**2
    widths = np.full((len(SWING), 1), RIM)
    reading = read_diameter(state_with(10.0), areas[:, None], widths)

    assert reading is not None
    assert reading.sigma > 0.1 * PEN.diameter


@pytest.mark.parametrize("n_known", [MIN_READINGS - 1, MIN_READINGS])
def test_few_areas_tell_nothing(n_known: int) -> None:
    areas = np.full((len(SWING), 1, PEN.n_leds), np.nan)
    areas.flat[:n_known] = 1000.0
    widths = np.full((len(SWING), 1), RIM)

    reading = read_diameter(state_with(10.0), areas, widths)
    assert (reading is None) == (n_known < 20)


def test_the_uncertainty_of_the_diameter_is_made_of_edge_scatter_and_dome() -> None:
    """One of two edges is sharp, and tells nothing of a dome."""
    swing = np.arange(len(SWING))
    areas = true_areas() * np.where(swing % 4 < 2, 1.01, 0.99)[:, None] ** 2
    widths = np.where(swing % 2, 6.0, 1.2)
    areas[2, 0], widths[0] = np.nan, np.nan
    reading = read_diameter(state_with(10.0), areas[:, None], widths[:, None])

    known = np.isfinite(areas) & np.isfinite(widths)[:, None]
    width = np.broadcast_to(widths[:, None], areas.shape)[known]
    diameter = 2 * np.sqrt(areas[known] / np.pi)  # px
    value = np.median(10.0 * np.sqrt(areas[known] / true_areas()[known]))
    read = 10.0 * np.sqrt(areas[known] / true_areas()[known])
    scatter = np.median(np.abs(read - value)) / 0.674490  # of a normal variable
    edge = 0.05 * value * np.median(2 * width / diameter)
    domes = np.where(width > 1.35, (width - 1.35) / diameter**2, 0.0)
    assert reading is not None
    assert reading.value == pytest.approx(value)
    assert reading.sigma == pytest.approx(np.hypot(edge, scatter), rel=1e-5)
    shift = 0.17 * value * np.median(domes) / np.sqrt(3)
    assert reading.shift == pytest.approx(shift)


@pytest.mark.parametrize("said", [pytest.param(9.0, marks=pytest.mark.slow), 13.0])
def test_a_wrong_diameter_is_put_right_and_named(said: float) -> None:
    result = calibrated(said, true_areas())

    assert result.bundle.state.pen.diameter == pytest.approx(10.0, rel=0.01)
    right = calibrated(10.0, true_areas())
    moved = np.linalg.norm(result.joint.tip_pen - right.joint.tip_pen)
    assert moved < 0.0005  # of the 14 um that 13 mm make
    (contradiction,) = result.contradictions
    assert contradiction.of_pen
    assert "contradict the LED file: diameter of the discs 10 " in str(
        contradiction.message
    )
    assert contradiction.message in warnings_of(result)
    assert judge(result, SwingLimits()).grade is Grade.CHECK


def test_a_right_diameter_is_not_contradicted_by_discs_that_look_larger() -> None:
    result = calibrated(10.0, 1.01 * true_areas())
    assert not result.contradictions


BLURRED = 6.6  # px


def by_leds(result: Calibration) -> FloatArray:
    """Return what the LEDs add to the variance of the tip, (3,), mm^2."""
    found = (s for s in result.budget.shares if s.name is ContributionName.LEDS)
    return sum((s.standard_uncertainty**2 for s in found), np.zeros(3))


@pytest.mark.parametrize("pen", [PEN, fanned_pen()], ids=["flat", "fanned"])
def test_leds_that_seem_to_stand_behind_their_discs_move_the_tip_as_counted(
    pen: Pen,
) -> None:
    areas = true_areas(pen)
    even = observed(areas, pen, BLURRED, seed=10)
    counted, sharp = (
        calibrate(CAMERA, pen, replace(even, edge_widths=widths))
        for widths in (even.edge_widths, np.full(len(SWING), SHARP_EDGE))
    )
    reading = counted.priors.reading
    assert reading is not None
    # By a tenth of it, to which all sizes of other errors stay the same.
    behind = replace(pen, leds=pen.leds - 0.1 * reading.shift * pen.normals)
    moved = calibrate(
        CAMERA, pen, replace(observed(areas, behind, seed=10), areas=areas)
    )

    np.testing.assert_allclose(
        np.sqrt(np.maximum(by_leds(counted) - by_leds(sharp), 0.0)),
        10 * np.abs(moved.joint.tip_pen - sharp.joint.tip_pen),
        atol=1e-4,
    )


@pytest.mark.parametrize(
    ("disc", "rim", "behind"), [(43, 6.6, 5.0), (43, 2.4, 1.1), (21, 2.4, 2.2)]
)
def test_a_dome_as_rendered_is_within_what_is_counted(
    disc: float, rim: float, behind: float
) -> None:
    areas = np.full((len(SWING), 1, PEN.n_leds), np.pi * (disc / 2) ** 2)
    widths = np.full((len(SWING), 1), rim)
    said = 10.0 * disc / 43
    reading = read_diameter(state_with(said), areas, widths)

    assert reading is not None
    assert reading.value == pytest.approx(10.0 * disc / 43, rel=0.05)
    # Even faces and domes are the ends of what is taken for as likely.
    assert 1e3 * np.sqrt(3.0) * reading.shift == pytest.approx(behind, rel=0.15)


def test_centres_alone_say_nothing_against_a_diameter() -> None:
    nothing = np.full((len(SWING), PEN.n_leds), np.nan)
    result = calibrated(13.0, nothing)

    assert result.priors.reading is None
    assert not result.contradictions
