"""The verdict: good, to be looked at, or to be repeated, with the reason."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lightpen.arrays import FloatArray
from lightpen.calibrate import Calibration, calibrate
from lightpen.formats.observation_files import Centers
from lightpen.observe import observe_centers
from lightpen.session.messages import Code
from lightpen.session.swing_state import SwingLimits
from lightpen.session.verdict import Grade, judge
from lightpen.simulator.postures import Postures
from lightpen.simulator.swings import (
    Swing,
    paper_camera,
    paper_pen,
    simulate_centers,
    swing_from_postures,
    swing_poses,
)
from lightpen.uncertainty import Halves

CAMERA, PEN = paper_camera(), paper_pen()


def calibrated(swing: Swing, sigma: float = 0.05) -> Calibration:
    rng = np.random.default_rng(1)
    pixels: FloatArray = simulate_centers(
        CAMERA, PEN, swing.rotations, swing.translations, sigma, rng
    )
    centers = Centers(np.arange(len(swing)), pixels, Path("simulated"))
    return calibrate(CAMERA, PEN, observe_centers(centers, CAMERA, PEN))


@pytest.fixture(scope="module")
def good() -> Calibration:
    return calibrated(swing_poses(150, np.random.default_rng(0)))


def test_a_good_calibration_passes_with_its_uncertainty(good: Calibration) -> None:
    verdict = judge(good, SwingLimits(max_uncertainty=0.01))
    assert verdict.grade is Grade.PASS
    assert verdict.reason.code is Code.GOOD
    assert verdict.reason.arguments == (good.budget.weakest_uncertainty,)


@pytest.mark.parametrize(("share", "grade"), [(0.9, Grade.CHECK), (0.3, Grade.REPEAT)])
def test_a_larger_uncertainty_is_checked_and_a_far_larger_one_repeated(
    good: Calibration, share: float, grade: Grade
) -> None:
    limit = share * good.budget.weakest_uncertainty
    verdict = judge(good, SwingLimits(max_uncertainty=limit))
    assert verdict.grade is grade
    assert verdict.reason.code is Code.UNCERTAIN


def test_halves_that_differ_are_checked(good: Calibration) -> None:
    uncertainty = good.halves.expanded_uncertainty
    halves = Halves(np.array([0.0, -1.6, 1.0]) * uncertainty, uncertainty)
    verdict = judge(replace(good, halves=halves), SwingLimits(max_uncertainty=0.01))
    assert verdict.grade is Grade.CHECK
    assert verdict.reason.code is Code.HALVES_DIFFER
    assert verdict.reason.arguments == (-1.6 * uncertainty[1], uncertainty[1])


def test_leds_that_do_not_fit_are_checked() -> None:
    noisy = calibrated(swing_poses(300, np.random.default_rng(0)), sigma=0.15)
    verdict = judge(noisy, SwingLimits(max_uncertainty=0.05))
    assert verdict.reason.code is Code.LEDS_MISFIT
    assert verdict.reason.arguments[0] == noisy.joint.sigma


def test_many_dropped_images_are_checked(good: Calibration) -> None:
    used = good.used.copy()
    used[::4] = False
    verdict = judge(replace(good, used=used), SwingLimits(max_uncertainty=0.01))
    assert verdict.reason.code is Code.MANY_DROPPED
    assert verdict.reason.arguments == (38, 150)


def test_sides_that_the_pen_never_leant_to_are_named() -> None:
    rng = np.random.default_rng(0)
    postures = Postures(
        np.radians(rng.uniform(10, 30, 150)),
        np.radians(rng.uniform(-20, 155, 150)),
        np.radians(rng.uniform(-30, 30, 150)),
    )
    verdict = judge(
        calibrated(swing_from_postures(postures)), SwingLimits(max_uncertainty=0.05)
    )
    assert verdict.grade is Grade.CHECK
    assert verdict.reason.code is Code.TOO_LITTLE_TILT
    assert verdict.reason.arguments == (8, 4, 5, 6, 7)
