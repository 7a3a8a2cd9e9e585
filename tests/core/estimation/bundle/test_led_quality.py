"""Each LED's fit: a displaced one is named, a good one is not."""

from dataclasses import replace

import numpy as np
import pytest
from tests.simulated_centers import calibrate_pixels, drop_centers, simulate_centers

from lightpen.arrays import FloatArray
from lightpen.estimation.bundle.led_quality import LedQuality, measure_leds
from lightpen.estimation.contact.joint import ContactModel, fit_contact
from lightpen.model.pen import Pen
from lightpen.model.rigid import rig_of
from lightpen_extensions.simulator.swings import (
    paper_camera,
    paper_pen,
    perturbed_pen,
    select_frames,
    swing_poses,
)

CAMERA = paper_camera()
PEN = paper_pen()
SWING = swing_poses(80, np.random.default_rng(0))


def quality(measured: Pen, n_missing: int = 0) -> LedQuality:
    rng = np.random.default_rng(1)
    pixels = simulate_centers(
        CAMERA, PEN, SWING.rotations, SWING.translations, 0.02, rng
    )
    return quality_of(measured, drop_centers(pixels, n_missing, rng))


def quality_of(measured: Pen, pixels: FloatArray) -> LedQuality:
    return calibrate_pixels(pixels, CAMERA, measured).leds


@pytest.mark.parametrize("led", [1, 10])
def test_a_displaced_led_is_named_with_its_displacement(led: int) -> None:
    shift = np.array([0.0, 0.08, 0.04])
    leds = perturbed_pen(PEN, 0.002, np.random.default_rng(2)).leds
    leds[led - 1] -= shift

    found = quality(replace(PEN, leds=leds))

    assert found.displaced == (led,)
    np.testing.assert_allclose(found.displacement[led - 1], shift, atol=0.02)


@pytest.mark.parametrize(("times", "is_named"), [(3.5, False), (7.5, True)])
def test_an_led_stands_out_among_others_that_are_displaced_too(
    times: float, is_named: bool
) -> None:
    usual = quality(perturbed_pen(PEN, 0.02, np.random.default_rng(3)))
    middle = np.median(np.linalg.norm(usual.displacement, axis=1))
    leds = perturbed_pen(PEN, 0.02, np.random.default_rng(3)).leds
    leds[3] = PEN.leds[3] - times * middle * np.array([0.0, 0.9, 0.44])

    assert quality(replace(PEN, leds=leds)).displaced == ((4,) if is_named else ())


def test_a_good_pen_has_no_displaced_led() -> None:
    assert quality(perturbed_pen(PEN, 0.01, np.random.default_rng(3))).displaced == ()


@pytest.mark.parametrize("n_seen", [1, 5, 40])
def test_a_displacement_is_reported_only_where_the_led_was_often_seen(
    n_seen: int,
) -> None:
    rng = np.random.default_rng(1)
    pixels = simulate_centers(
        CAMERA, PEN, SWING.rotations, SWING.translations, 0.02, rng
    )
    pixels[n_seen:, 3] = np.nan
    pixels[:, 3] += 2.0  # half a millimetre

    found = quality_of(PEN, pixels)

    assert found.displaced == ((4,) if n_seen == 40 else ())
    assert np.isfinite(found.displacement[3]).all() == (n_seen == 40)


@pytest.mark.parametrize(("scatter", "is_named"), [(1.0, True), (2.0, False)])
def test_a_displacement_is_named_if_it_is_far_beyond_its_uncertainty(
    scatter: float, is_named: bool
) -> None:
    rng = np.random.default_rng(1)
    pixels = simulate_centers(
        CAMERA, PEN, SWING.rotations, SWING.translations, 0.02, rng
    )
    # By 7 of its standard deviations, and by 4.
    pixels[:, 3] += 2.0 + scatter * rng.standard_normal((80, 2))

    assert quality_of(PEN, pixels).displaced == ((4,) if is_named else ())


@pytest.mark.parametrize("seed", range(2))
def test_an_led_that_is_badly_seen_is_not_called_displaced(seed: int) -> None:
    rng = np.random.default_rng(seed)
    pixels = simulate_centers(
        CAMERA, PEN, SWING.rotations, SWING.translations, 0.02, rng
    )
    pixels[:, 3] += 3.0 * rng.standard_normal((80, 2))

    assert quality_of(PEN, pixels).displaced == ()


def test_residuals_and_counts_are_those_of_the_led() -> None:
    found = quality(PEN, n_missing=3)

    assert found.n_seen.sum() == 80 * 7
    np.testing.assert_array_equal(found.n_seen, found.n_used)
    # sigma 0.02 px an axis, less the freedom the fit takes.
    assert ((found.rms > 0.018) & (found.rms < 0.03)).all()
    assert np.abs(found.mean).max() < 5 * 0.02 / np.sqrt(50)


def test_an_led_is_judged_by_the_images_that_use_it_or_by_all_if_these_are_few() -> (
    None
):
    rng = np.random.default_rng(4)
    few = select_frames(SWING, np.arange(20))
    poses = few.rotations, few.translations
    pixels = simulate_centers(CAMERA, PEN, *poses, 0.02, rng)
    model = ContactModel.of(CAMERA, PEN, pixels)
    whole = fit_contact(model, few.rotations, few.tip_pen, few.cone_cam)
    used = whole.used.copy()
    used[1:, 2], used[:, 3], used[9:, 4], used[10:, 5] = False, False, False, False
    used[5:, 6] = False
    pixels[6:, 6] = np.nan
    joint = replace(whole, used=used)
    found = measure_leds(rig_of(CAMERA), PEN, pixels[:, None], joint)

    state = model.at(whole.rotations, whole.tip_pen, whole.cone_cam)
    by_led = state.jacobian[..., 3:] @ whole.rotations[:, None]
    for j, n_used, n_judging in (
        *((0, 20, 20), (2, 1, 20), (3, 0, 20), (4, 9, 20), (5, 10, 10), (6, 5, 0)),
    ):
        assert found.n_used[j] == n_used
        left = whole.residuals[:n_used, j]
        if n_used:
            mean_square = np.mean(np.sum(left**2, axis=1))
            assert found.rms[j] == pytest.approx(np.sqrt(mean_square))
            np.testing.assert_allclose(found.mean[j], left.mean(axis=0))
        else:
            assert np.isnan([found.rms[j], *found.mean[j]]).all()
        if n_judging:
            A = by_led[:n_judging, j].reshape(-1, 3)
            moved = np.linalg.lstsq(A, state.residuals[:n_judging, j].ravel())[0]
            np.testing.assert_allclose(found.displacement[j], moved, atol=1e-9)
        else:
            assert np.isnan(found.displacement[j]).all()
    assert found.n_seen.tolist() == 6 * [20] + [6] + 3 * [20]
