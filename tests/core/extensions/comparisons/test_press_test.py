"""The press test: a stylus that gives way is found, and a stiff one is left alone."""

from dataclasses import replace
from datetime import date, timedelta
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from benchmarks.station import GOOD, _drawn_pen, drawn_rig
from msgspec.structs import replace as replace_struct
from tests.simulated_centers import simulate_centers

from lightpen.detection.observations import observe_centers
from lightpen.estimation.calibrate import Calibration, calibrate_rig
from lightpen.estimation.reports.verdict import Grade
from lightpen.formats.observation_files import Centers
from lightpen.model.bending import ASSUMED, bending_on
from lightpen.model.rigid import rig_of
from lightpen_extensions.comparisons.press_test import press_test
from lightpen_extensions.simulator.swings import paper_camera, paper_pen, swing_poses

N_IMAGES, NOISE, SEAT = 60, 0.03, 0.002  # px, mm
DAY = date(2025, 11, 3)
GIVES_WAY = 0.02  # mm by the sine of the lean
SEEDS = (0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (1, 2, 3)))


@cache
def swung(
    seed: int,
    number: int,
    compliance: float = 0.0,
    cone: float = 0.0,
    seat: float = SEAT,
) -> Calibration:
    """Return a swing at the station of a seed, whose files are off as they state.

    The tip moves by the compliance, mm by the sine of the lean, the cone sideways.
    """
    of_station = np.random.default_rng([26, seed])
    file = drawn_rig(rig_of(paper_camera()), of_station)
    pen_file = _drawn_pen(GOOD, paper_pen(), of_station)
    rng = np.random.default_rng([26, seed, number])
    poses = swing_poses(N_IMAGES, rng)
    axes = poses.rotations[:, :, 1]
    up = axes.mean(axis=0) / np.linalg.norm(axes.mean(axis=0))
    across = axes - (axes @ up)[:, None] * up
    places = poses.translations - compliance * across
    places[:, 0] += cone
    places += seat * rng.standard_normal(places.shape)
    pixels = simulate_centers(
        paper_camera(), paper_pen(), poses.rotations, places, NOISE, rng
    )
    centers = Centers(np.arange(N_IMAGES), pixels, Path("simulated"))
    seen = observe_centers(centers, file.cameras[0], pen_file)
    return calibrate_rig(file, pen_file, [seen])


@pytest.mark.parametrize("seed", SEEDS)
def test_a_stylus_that_gives_way_is_found_along_the_pen(seed: int) -> None:
    found = press_test(swung(seed, 1), swung(seed, 2, GIVES_WAY))

    assert found.assessment.grade is Grade.CHECK
    assert found.assessment.reason.code == "press-test.gives-way"
    assert abs(found.change[1] - GIVES_WAY) < 1.5 * found.uncertainty[1]


@pytest.mark.parametrize("seed", SEEDS)
def test_a_stiff_stylus_is_left_alone(seed: int) -> None:
    found = press_test(swung(seed, 1), swung(seed, 3))

    assert found.assessment.grade is Grade.STEADY
    assert (np.abs(found.change) < 1.5 * found.uncertainty).all()
    assert found.uncertainty[1] < GIVES_WAY


def test_the_swings_exchanged_change_the_sign() -> None:
    usual, firm = swung(0, 1), swung(0, 2, GIVES_WAY)

    there, back = press_test(usual, firm), press_test(firm, usual)

    np.testing.assert_allclose(back.change, -there.change, rtol=1e-6, atol=1e-9)


def test_a_cone_that_was_moved_between_the_swings_is_no_bending() -> None:
    found = press_test(swung(0, 1), swung(0, 4, cone=0.05))

    assert found.assessment.grade is Grade.STEADY


def test_bending_replaces_the_assumed_one_until_its_due_date() -> None:
    found = press_test(swung(0, 1), swung(0, 2, GIVES_WAY))
    measured = found.bending(DAY)
    assert measured is not None

    assert measured.due == date(2026, 11, 3)
    expected = np.hypot(found.change[1], found.uncertainty[1] / 2)
    assert bending_on(DAY, measured).sigma == pytest.approx(expected)
    assert "by press test of 2025-11-03" in str(bending_on(DAY, measured).words)
    assert bending_on(DAY, None).sigma == ASSUMED
    stiff = replace_struct(measured, bending_mm=0.0, expanded_uncertainty_mm=0.001)
    assert bending_on(DAY, stiff).sigma == pytest.approx(0.0005)
    assert bending_on(measured.due + timedelta(days=1), stiff).sigma == ASSUMED


def test_a_coarse_test_measures_no_bending() -> None:
    found = press_test(swung(0, 1), swung(0, 5, seat=0.1))

    assert found.assessment.reason.code == "press-test.coarse"
    assert found.bending(DAY) is None


def test_instruments_that_disagree_count_by_half_their_difference() -> None:
    usual, firm = swung(0, 1), swung(0, 3)
    one, rig = usual.instrument, firm.instrument.rig
    longer = rig.cameras[0].intrinsics * np.r_[1.01, 1.01, np.ones(7)]
    camera = rig.cameras[0].with_intrinsics(longer)
    other = replace(firm.instrument, rig=replace(rig, cameras=(camera,)))

    by_one = press_test(usual, replace(firm, instrument=one))
    by_other = press_test(
        replace(usual, instrument=other), replace(firm, instrument=other)
    )
    by_both = press_test(usual, replace(firm, instrument=other))

    changes = np.array([by_one.change, by_other.change])
    np.testing.assert_allclose(by_both.change, changes.mean(axis=0))
    half = np.ptp(changes, axis=0) / 2
    assert half.max() > 0.005
    np.testing.assert_allclose(
        by_both.uncertainty, np.hypot(by_one.uncertainty, 2 * half)
    )
