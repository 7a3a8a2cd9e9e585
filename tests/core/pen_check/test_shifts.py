from dataclasses import replace

import numpy as np
import pytest

from lightpen.arrays import FloatArray
from lightpen.pen_check.shifts import find_shifts
from lightpen_extensions.simulator.scenes import six_led_pen
from lightpen_extensions.simulator.swings import (
    paper_camera,
    paper_pen,
    simulate_centers,
    swing_poses,
)

CAMERA = paper_camera()
PEN = paper_pen()


def views(
    leds: FloatArray, n_views: int = 12, sigma: float = 0.05
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return centres, px, and poses of a pen whose LEDs really are there."""
    rng = np.random.default_rng(2)
    swing = swing_poses(n_views, rng)
    pen = replace(PEN, leds=leds)
    R, t = swing.rotations, swing.translations
    return simulate_centers(CAMERA, pen, R, t, sigma, rng), R, t


def test_the_shift_agrees_with_its_standard_deviation() -> None:
    leds = PEN.leds.copy()
    by = np.array([0.2, -0.3, 0.15])
    leds[4] += by

    (shift,) = find_shifts(CAMERA, PEN, *views(leds))

    assert shift.led == 5
    assert np.linalg.norm(shift.by - by) < 4 * shift.sigma
    assert shift.sigma < 0.05


def test_the_deviation_falls_with_more_views() -> None:
    leds = PEN.leds.copy()
    leds[4] += [0.5, 0.0, 0.0]

    sigmas = [find_shifts(CAMERA, PEN, *views(leds, n))[0].sigma for n in (10, 40)]

    assert sigmas[0] / sigmas[1] == pytest.approx(2, rel=0.35)  # postures differ


def test_leds_in_place_are_left_alone() -> None:
    assert find_shifts(CAMERA, PEN, *views(PEN.leds)) == ()


@pytest.mark.parametrize("seed", [0, 2, 3])
def test_a_shift_that_two_leds_would_explain_is_reported_with_both(seed: int) -> None:
    # Four LEDs in a plane hold the two behind it together, hardly each alone.
    pen = six_led_pen()
    rng = np.random.default_rng(seed)
    swing = swing_poses(8, rng, pen=pen)
    R, t = swing.rotations, swing.translations
    leds = pen.leds.copy()
    leds[5] += [0.0, 4.0, 0.0]
    pixels = simulate_centers(CAMERA, replace(pen, leds=leds), R, t, 0.05, rng)

    (shift,) = find_shifts(CAMERA, pen, pixels, R, t)

    assert {shift.led, shift.rival} == {5, 6}


def test_leds_that_are_not_seen_do_not_count() -> None:
    leds = PEN.leds.copy()
    leds[4] += [0.5, 0.0, 0.0]
    pixels, R, t = views(leds)
    pixels[:, 0] = np.nan

    (shift,) = find_shifts(CAMERA, PEN, pixels, R, t)

    assert shift.led == 5
