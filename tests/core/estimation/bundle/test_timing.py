"""What is not simultaneous is found, corrected and named, and else costs nothing."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.simulated_centers import simulate_rig_centers

from lightpen.arrays import BoolArray, FloatArray
from lightpen.detection.observations import observe_centers
from lightpen.estimation.bundle.effect_findings import FoundEffect
from lightpen.estimation.bundle.effects import EffectName, lens_and_timing
from lightpen.estimation.calibrate import Calibration, calibrate, calibrate_rig
from lightpen.estimation.reports.report_warnings import warnings_of
from lightpen.estimation.uncertainty.budget import ContributionName
from lightpen.formats.observation_files import Centers
from lightpen.model.rig import from_first
from lightpen.simulator.postures import Postures
from lightpen.simulator.samples import row_of_cameras
from lightpen.simulator.swings import (
    Swing,
    paper_camera,
    paper_pen,
    simulate_centers,
    swing_from_postures,
)
from lightpen.swing_messages import time_span

CAMERA, PEN = paper_camera(), paper_pen()
N_IMAGES, NOISE = 120, 0.03
TIMES = np.arange(N_IMAGES, dtype=float)  # image intervals


def swing_at(times: FloatArray) -> Swing:
    """Return the same smooth swing of the pen at any times."""
    phase = 2 * np.pi * times / 60
    tilts = np.radians(22 + 7 * np.sin(0.37 * phase))
    return swing_from_postures(Postures(tilts, phase, 0.4 * np.sin(0.71 * phase)))


def seen(delays: Callable[[FloatArray], FloatArray]) -> FloatArray:
    """Return centres (N, L, 2) of LEDs that are seen later by delays of centres."""
    exact = _centers(np.zeros((N_IMAGES, PEN.n_leds)))
    moved = _centers(delays(_centers(delays(exact))))
    rng = np.random.default_rng(265)
    return moved + rng.normal(0, NOISE, moved.shape)


def _centers(delays: FloatArray) -> FloatArray:
    pixels = []
    for j in range(PEN.n_leds):
        swing = swing_at(TIMES + delays[:, j])
        poses = swing.rotations, swing.translations
        drawn = simulate_centers(CAMERA, PEN, *poses, 0.0, np.random.default_rng(0))
        pixels.append(drawn[:, j])
    return np.stack(pixels, axis=1)


def calibrated(pixels: FloatArray) -> tuple[Calibration, FloatArray]:
    centers = Centers(np.arange(N_IMAGES), pixels, Path("simulated"))
    found = calibrate(CAMERA, PEN, observe_centers(centers, CAMERA, PEN))
    return found, found.joint.tip_pen - swing_at(TIMES).tip_pen


@pytest.mark.parametrize(
    ("name", "size", "code"),
    [
        (EffectName.SHUTTER, 0.2, "warning.effect-shutter"),
        (EffectName.STROBE, 0.004, "warning.effect-strobe"),
    ],
)
def test_what_is_not_simultaneous_is_corrected_and_named(
    name: EffectName, size: float, code: str
) -> None:
    def delays(pixels: FloatArray) -> FloatArray:
        if name is EffectName.SHUTTER:
            return np.asarray(size * (pixels[..., 1] / CAMERA.height - 0.5))
        return np.tile(size * (np.arange(PEN.n_leds) - 4.5), (N_IMAGES, 1))

    found, error = calibrated(seen(delays))
    effect = next(each for each in found.effects if each.name is name)
    assert effect.sigma is not None
    assert effect.size == pytest.approx(size, rel=0.05)
    assert (np.abs(error) < found.budget.expanded_uncertainty[:3]).all()
    assert np.linalg.norm(error) < 0.01
    assert code in [each.code for each in warnings_of(found)]


def test_a_simultaneous_swing_loses_nothing_by_timing() -> None:
    found, _ = calibrated(seen(lambda pixels: np.zeros(pixels.shape[:-1])))
    names = {EffectName.SHUTTER, EffectName.STROBE, EffectName.DELAY}
    assert not names & {each.name for each in found.effects}
    shares = {each.name: each.standard_uncertainty for each in found.budget.shares}
    by_timing = shares.get(ContributionName.TIMING, np.zeros(3))
    assert (by_timing < 0.3 * shares[ContributionName.NOISE]).all()


@pytest.mark.slow
def test_a_late_camera_is_corrected_and_named() -> None:
    rig = from_first(row_of_cameras(2, 1000.0))
    rng, late = np.random.default_rng(266), 0.06
    now, later = (
        simulate_rig_centers(rig, PEN, swing_at(TIMES + delay), NOISE, rng)
        for delay in (0.0, late)
    )
    pixels = np.stack([now[:, 0], later[:, 1]], axis=1)
    observed = [
        observe_centers(
            Centers(np.arange(N_IMAGES), pixels[:, c], Path("simulated")), camera, PEN
        )
        for c, camera in enumerate(rig.cameras)
    ]
    timed = [replace(each, interval_ms=50.0) for each in observed]
    found = calibrate_rig(rig, PEN, timed)
    effect = next(each for each in found.effects if each.name is EffectName.DELAY)
    assert effect.camera == rig.names[1]
    assert effect.size == pytest.approx(late, rel=0.05)
    error = found.joint.tip_pen - swing_at(TIMES).tip_pen
    assert (np.abs(error) < found.budget.expanded_uncertainty[:3]).all()
    assert "verdict.not-simultaneous" not in [m.code for m in warnings_of(found)]
    reported = next(str(m) for m in warnings_of(found) if " ms late" in str(m))
    assert float(reported.split(" ms late")[0].split()[-1]) == pytest.approx(
        3.0, rel=0.05
    )


def test_an_led_that_the_next_image_lacks_moves_as_from_the_one_before() -> None:
    """One that both images beside lack moves as the others do on average."""
    speeds = 10.0 + np.arange(6.0)
    pixels = np.zeros((9, 1, 6, 2))
    pixels[:, 0, :, 0] = np.arange(9)[:, None] * speeds
    used = np.ones((9, 1, 6), bool)
    used[4, 0, 0] = used[[5, 7], 0, 1] = False
    effects = lens_and_timing(pixels, used, (CAMERA,))
    strobe = next(each for each in effects if each.name is EffectName.STROBE)
    order = np.arange(6) - 2.5

    found = strobe.columns[:, 0, :, 0, 0] / order

    np.testing.assert_allclose(found[3, 0], 10.0)
    np.testing.assert_allclose(found[6, 1], np.delete(speeds, 1).mean())
    assert (strobe.columns[..., 1, 0] == 0).all()


def test_what_may_be_late_has_the_motion_times_its_delay_as_columns() -> None:
    """Of two cameras, the second of which sees all move twice as fast."""
    rng = np.random.default_rng(1)
    pixels = 500.0 + np.zeros((5, 2, 3, 2))
    pixels += np.arange(5.0)[:, None, None, None] * [4.0, -3.0]
    pixels[:, 1] = 2 * pixels[:, 1] + rng.uniform(0, 300, (3, 2))
    lower = replace(CAMERA, height=CAMERA.height // 2)
    effects = lens_and_timing(pixels, np.ones((5, 2, 3), bool), (CAMERA, lower))

    speed = np.array([1.0, 2.0])[:, None, None] * [4.0, -3.0]
    by_row = [
        pixels[:, c, :, 1, None] / camera.height - 0.5
        for c, camera in enumerate((CAMERA, lower))
    ]
    nothing = np.zeros((5, 3, 1))
    expected = [
        (EffectName.STROBE, 0, np.tile([[-1.0], [0.0], [1.0]], (5, 2, 1, 1))),
        (EffectName.SHUTTER, 0, np.stack([by_row[0], nothing], axis=1)),
        (EffectName.DELAY, 1, np.stack([nothing, nothing + 1], axis=1)),
        (EffectName.SHUTTER, 1, np.stack([nothing, by_row[1]], axis=1)),
    ]
    timing = [each for each in effects if each.name is not EffectName.LENS]
    assert [(each.name, each.camera) for each in timing] == [e[:2] for e in expected]
    for each, (_, _, delays) in zip(timing, expected, strict=True):
        np.testing.assert_allclose(each.columns[..., 0], delays * speed)
        assert each.shapes == (np.eye(1),)
        assert (each.stated, each.is_exact) == (0.0, False)


@pytest.mark.parametrize(
    ("steps", "is_known"),
    [
        ([2.0, 1.5, 2.2, 1.6], True),
        ([1.01, 1.01, 1.01, 1.01], True),
        ([0.99, 0.99, 0.99, 0.99], False),  # the pen rests
        ([2.0, 2.99, 2.0, 2.99], True),
        ([2.0, 3.01, 2.0, 3.01], False),  # a step half as long again as the one before
        ([2.0, 2.0, 4.0], True),  # half of them are even
        ([2.0, 2.0, 4.0, 2.0], False),
    ],
)
def test_only_an_even_motion_tells_times(steps: list[float], is_known: bool) -> None:
    pixels = np.zeros((len(steps) + 1, 1, 4, 2))
    pixels[..., 0] = np.cumsum([0.0, *steps])[:, None, None]
    effects = lens_and_timing(pixels, np.ones(pixels.shape[:-1], bool), (CAMERA,))
    assert (EffectName.STROBE in [each.name for each in effects]) == is_known


@pytest.mark.parametrize("used", [np.arange(5) % 2 == 0, np.zeros(5, bool)])
def test_images_without_neighbours_tell_no_times(used: BoolArray) -> None:
    pixels = np.zeros((5, 1, 4, 2))
    pixels[..., 0] = 10 * np.arange(5)[:, None, None]
    shown = np.tile(used[:, None, None], (1, 1, 4))
    effects = lens_and_timing(pixels, shown, (CAMERA,))
    assert [each.name for each in effects] == [EffectName.LENS]


def test_a_time_is_stated_in_ms_if_the_image_rate_is_known_with_its_sign() -> None:
    effect = FoundEffect(EffectName.DELAY, "right", -0.05, 0.001, 100.0)
    assert "0.05 image intervals early" in str(effect.message)
    assert "2.5 ms early" in str(replace(effect, interval_ms=50.0).message)
    strobe = replace(effect, name=EffectName.STROBE, interval_ms=50.0)
    assert "2.5 ms apart" in str(strobe.message)


@pytest.mark.parametrize(
    ("intervals", "text"),
    [(0.00343, "3.43 µs"), (0.99951, "1 ms"), (999, "999 ms"), (1500, "1.5 s")],
)
def test_the_unit_of_a_time_suits_its_size(intervals: float, text: str) -> None:
    assert str(time_span(intervals, 1.0)) == text
