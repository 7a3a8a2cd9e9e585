"""LEDs of a few pixels have centres, standard deviations and flaws of their own."""

from dataclasses import dataclass, replace

import cv2
import numpy as np
import pytest
from tests.simulated_panels import Panel, panel_image

from lightpen.arrays import FloatArray, IntArray
from lightpen.detection.pen_detection import detect_pen
from lightpen.detection.reasons import Reason
from lightpen.detection.small_spots import measure_small
from lightpen.detection.spots import EXACT_SIGMA, SpotFlaw, detect_spots
from lightpen_extensions.simulator.image_plans import plan_scene, render_plan
from lightpen_extensions.simulator.scenes import Scene

EASY = Panel(6.0)
HARD = Panel(
    6.0, reflections=(0.1, 0.5), bloom=0.3, background=0.08, quality=80
)  # as photographs of boards are
HALOS = Panel(
    6.0,
    gains=(0.4, 4.0),
    reflections=(0.05, 0.2),
    bloom=0.15,
    psf=0.7,
    background=0.05,
    quality=None,
    pitch=4.0,
    halos=(0.1, 0.4),
    variety=0.3,
)  # each LED with light and a shape of its own
CLIPPED = Panel(5.0, gains=(1.2, 6.0), reflections=(0.05, 0.2), bloom=0.1)
CLEAN = Panel(6.0, reflections=(0.0, 0.0), bloom=0.0, quality=None)


@dataclass(frozen=True, eq=False)
class Found:
    errors: FloatArray  # (N, 2), px
    sigmas: FloatArray
    flaws: IntArray
    n_leds: int

    @property
    def rms(self) -> float:
        return float(np.sqrt(np.mean(self.errors**2)))


def found_on(panel: Panel, n_images: int = 3) -> Found:
    rng = np.random.default_rng(1)
    errors, sigmas, flaws, n_leds = [], [], [], 0
    for _ in range(n_images):
        shown = panel_image(panel, rng)
        spots = detect_spots(shown.image)
        gaps = np.linalg.norm(spots.centers - shown.centers[:, None], axis=2)
        near = gaps.min(axis=1) < panel.width / 2 + 1
        which = gaps.argmin(axis=1)[near]
        errors.append(spots.centers[which] - shown.centers[near])
        sigmas.append(spots.sigmas[which])
        flaws.append(spots.flaws[which])
        n_leds += len(shown.centers)
    return Found(
        np.concatenate(errors), np.concatenate(sigmas), np.concatenate(flaws), n_leds
    )


@pytest.mark.parametrize("width", [5.0, 6.0, 7.0])
@pytest.mark.parametrize("panel", [EASY, HARD])
def test_at_most_one_in_ten_small_leds_on_a_reflecting_board_is_flagged(
    panel: Panel, width: float
) -> None:
    found = found_on(replace(panel, width=width))
    flaws = found.flaws[(found.flaws & SpotFlaw.SATURATED) == 0]
    assert len(found.flaws) > 0.98 * found.n_leds
    assert np.mean(flaws > 0) <= 0.1


@pytest.mark.parametrize("seed", [1, 2])
def test_small_leds_that_wide_light_joins_are_found_in_large_images(seed: int) -> None:
    # In every fourth pixel a fifth of them is lost.
    panel = replace(CLEAN, halos=(0.02, 0.1), pitch=6.0)
    shown = panel_image(panel, np.random.default_rng(seed))
    image = np.full((1100, 1400), 8, np.uint8)
    height, width = shown.image.shape
    image[200 : 200 + height, 300 : 300 + width] = np.maximum(shown.image, 8)
    wide = cv2.GaussianBlur(image, (0, 0), 9.0)

    spots = detect_spots(cv2.addWeighted(image, 1.0, wide, 6.0, 0.0).astype(np.uint8))

    places = shown.centers + np.array([300, 200])
    gaps = np.linalg.norm(spots.centers - places[:, None], axis=2)
    assert np.mean(gaps.min(axis=1) < 2.0) > 0.95


@pytest.mark.slow
def test_leds_that_all_differ_by_halo_and_lens_are_not_flagged_for_it() -> None:
    # A fixed limit of their difference flags a quarter.
    unlike = replace(HALOS, width=7.0, gains=(0.35, 0.95), variety=0.7)
    found = found_on(unlike, 4)
    unclipped = found.flaws[(found.flaws & SpotFlaw.SATURATED) == 0]
    assert np.mean((unclipped & (SpotFlaw.MERGED | SpotFlaw.CUT)) > 0) <= 0.1


@pytest.mark.parametrize("quality", [pytest.param(None, marks=pytest.mark.slow), 60])
def test_leds_in_the_dark_that_are_no_even_discs_are_not_flagged_for_it(
    quality: int | None,
) -> None:
    # By the outline of an even disc four of five are.
    panel = replace(
        CLEAN, width=5.0, gains=(0.3, 0.6), pitch=6.0, psf=1.0, die=0.5, quality=quality
    )
    found = found_on(panel, 4)
    assert np.mean((found.flaws & (SpotFlaw.MERGED | SpotFlaw.CUT)) > 0) <= 0.1


@pytest.mark.parametrize(
    "gains", [(0.4, 3.0), pytest.param((2.0, 6.0), marks=pytest.mark.slow)]
)
def test_reflections_beside_leds_do_not_flag_them(gains: tuple[float, float]) -> None:
    found = found_on(replace(EASY, width=8.0, gains=gains))
    assert np.mean((found.flaws & ~SpotFlaw.SATURATED) > 0) < 0.03


@pytest.mark.parametrize("panel", [CLEAN, EASY, HARD])
@pytest.mark.parametrize("width", [5.0, 8.0])
def test_small_leds_of_which_a_part_is_hidden_are_flagged(
    panel: Panel, width: float
) -> None:
    shown = panel_image(replace(panel, width=width), np.random.default_rng(5))
    hidden = np.arange(0, len(shown.centers), 6)
    x, y = np.meshgrid(*(np.arange(n) for n in shown.image.shape[::-1]))
    visible = np.ones(shown.image.shape)
    for u, v in shown.centers[hidden]:
        beside = (x > u + width / 6) & (x < u + 1.2 * width)
        visible[beside & (np.abs(y - v) < width)] = 0
    image = shown.image * cv2.GaussianBlur(visible, (0, 0), 1.2)
    spots = detect_spots(image.astype(np.uint8))
    gaps = np.linalg.norm(spots.centers - shown.centers[hidden][:, None], axis=2)
    which = gaps.argmin(axis=1)[gaps.min(axis=1) < width / 2]
    assert len(which)
    assert ((spots.flaws[which] & (SpotFlaw.CUT | SpotFlaw.MERGED)) > 0).all()


@pytest.mark.parametrize(
    ("panel", "limit"),
    # A Gaussian fit from the true place reaches 0.013 to 0.048 px on them.
    [
        (CLEAN, 0.011),
        (replace(CLEAN, width=4.0), 0.013),
        (replace(CLEAN, width=10.0), 0.009),
        (replace(EASY, width=4.0), 0.027),
        (EASY, 0.0165),
        (replace(EASY, width=10.0), 0.012),
        *(
            pytest.param(panel, limit, marks=pytest.mark.slow)
            for panel, limit in (
                (replace(EASY, width=12.0, reflections=(0.1, 0.4)), 0.0105),
                (replace(HARD, width=8.0), 0.026),
                (replace(HARD, width=8.0, darkening=0.75), 0.031),
                (replace(HARD, width=14.0), 0.018),
                (replace(EASY, width=10.0, gains=(2.0, 6.0), bloom=0.15), 0.018),
                (replace(CLIPPED, width=10.0, gains=(1.2, 3.0)), 0.009),
            )
        ),
    ],
)
def test_centers_are_better_than_by_a_gaussian_fit(panel: Panel, limit: float) -> None:
    assert found_on(panel).rms < limit


@pytest.mark.parametrize("width", [5.0, pytest.param(7.0, marks=pytest.mark.slow)])
def test_clipped_leds_that_bloom_have_centers(width: float) -> None:
    found = found_on(replace(EASY, gains=(2.0, 6.0), width=width))
    assert np.mean((found.flaws & SpotFlaw.SATURATED) > 0) > 0.9
    assert found.rms < 0.06


@pytest.mark.parametrize(
    ("width", "gains"),
    [pytest.param(10.0, (2.0, 6.0), marks=pytest.mark.slow), (14.0, (0.4, 4.0))],
)
def test_regions_beside_each_other_are_measured_once(
    width: float, gains: tuple[float, float]
) -> None:
    found = found_on(replace(EASY, gains=gains, bloom=0.15, width=width), 2)
    assert len(found.flaws) == found.n_leds
    assert found.rms < 0.04


def test_leds_on_a_brighter_part_of_the_board_are_found() -> None:
    shown = panel_image(replace(HARD, width=7.0), np.random.default_rng(1))
    y, x = (np.linspace(0, 3, n) for n in shown.image.shape)
    board = 20 * (1 + np.cos(x) * np.cos(y[:, None]))
    image = np.clip(shown.image + board, 0, 255).astype(np.uint8)
    gaps = np.linalg.norm(detect_spots(image).centers - shown.centers[:, None], axis=2)
    assert (gaps.min(axis=1) < 1).all()


@pytest.mark.slow
@pytest.mark.parametrize("panel", [EASY, HARD, replace(HARD, width=8.0)])
def test_the_stated_standard_deviation_is_about_the_error(panel: Panel) -> None:
    found = found_on(panel, 6)
    typical = 1.2 * np.median(np.linalg.norm(found.errors, axis=1)) / np.sqrt(2)
    assert 0.5 < np.median(found.sigmas) / typical < 2.0


def test_light_beside_clipped_leds_enters_the_standard_deviation() -> None:
    found = found_on(CLIPPED, 6)
    assert np.sqrt(np.mean((found.errors / found.sigmas[:, None]) ** 2)) < 1.3


def test_leds_among_foreign_light_count_less_than_such_in_the_dark() -> None:
    assert np.median(found_on(HARD).sigmas) > 2 * np.median(found_on(CLEAN).sigmas)


def test_a_fit_that_leaves_its_led_for_a_brighter_reflection_is_reported() -> None:
    y, x = np.mgrid[:60, :140]
    lights = [(20, 160.0), (50, 160.0), (80, 160.0), (110, 160.0), (115, 200.0)]
    light = sum(a * (np.hypot(x - u, y - 30) < 2.2) for u, a in lights)
    noise = np.random.default_rng(0).normal(0, 1, light.shape)
    image = cv2.GaussianBlur(np.minimum(light, 255), (0, 0), 1.6) + noise
    centers = np.array([(u, 30.0) for u, _ in lights[:4]])
    shown = np.clip(image, 0, 255).astype(np.uint8)
    found = measure_small(shown, centers, np.full(4, 3.0), 255.0)
    assert found.are_whole.tolist() == [True, True, True, False]
    assert (found.sigmas > 1).tolist() == [False, False, False, True]


def small_pen(diameter: float, blur: float) -> Scene:
    usual = Scene(n_images=3, seed=3)
    return replace(
        usual,
        pen=replace(usual.pen, diameter=diameter),
        optics=replace(usual.optics, psf_sigma=blur),
    )


@pytest.mark.parametrize("diameter", [1.0, 1.4, 2.3])  # 4 to 10 px
def test_a_pen_of_small_leds_is_found(diameter: float) -> None:
    scene = small_pen(diameter, 1.5)
    plan = plan_scene(scene)
    for image_plan in plan.image_plans:
        image = render_plan(scene, image_plan)
        detection = detect_pen(image, scene.camera, plan.measured_pen)
        assert detection.has_pose
        assert detection.n_leds == scene.pen.n_leds
        # Blur makes their size, which so tells no diameter.
        assert np.isnan(detection.areas).all()
        assert (detection.sigmas >= EXACT_SIGMA).all()


@pytest.mark.parametrize(
    ("diameter", "blur", "width"), [(0.3, 0.6, 1.9), (0.6, 0.6, 2.7), (0.7, 0.6, 2.9)]
)
def test_spots_of_one_to_three_pixels_are_refused_as_too_small(
    diameter: float, blur: float, width: float
) -> None:
    scene = small_pen(diameter, blur)
    plan = plan_scene(scene)
    image = render_plan(scene, plan.image_plans[0])
    detection = detect_pen(image, scene.camera, plan.measured_pen)
    assert detection.reason is Reason.TOO_SMALL
    assert detection.spots is not None
    assert detection.spots.tiny_width == pytest.approx(width, abs=0.5)


def test_hot_pixels_are_no_leds_that_are_too_small() -> None:
    image = np.zeros((600, 800), np.uint8)
    image[np.arange(20, 580, 40), np.arange(20, 580, 40)] = 200
    assert np.isnan(detect_spots(image).tiny_width)


def test_blur_that_joins_small_leds_leaves_them_too_small() -> None:
    panel = replace(CLEAN, width=2.0, psf=1.0, gains=(2.5, 6.0))
    shown = panel_image(panel, np.random.default_rng(1)).image
    assert detect_spots(shown).tiny_width == pytest.approx(3.0, abs=0.4)


def test_a_wide_halo_is_not_taken_for_the_led_in_it() -> None:
    rng = np.random.default_rng(5)
    y, x = np.mgrid[:300, :400]
    light = np.full((300, 400), 0.05)
    columns, rows = np.meshgrid(np.arange(7), np.arange(5))
    grid = np.stack([columns.ravel(), rows.ravel()], axis=1)
    centers = [104, 86] + 32 * grid + rng.uniform(-2, 2, (35, 2))
    for center in centers:
        away = np.hypot(x - center[0], y - center[1])
        led, height = np.clip(3.0 - away, 0, 1), rng.uniform(0.5, 0.8)
        # Halos lie beside their LEDs, so that their middles are another place.
        aside = np.hypot(x - center[0] - 1, y - center[1])
        halo = rng.uniform(0.1, 0.2) * np.exp(-0.5 * (aside / 6) ** 2)
        light += height * (led + halo)
    image = cv2.GaussianBlur(light, (0, 0), 0.8) * 255 + rng.normal(0, 1, light.shape)

    spots = detect_spots(np.clip(np.rint(image), 0, 255).astype(np.uint8))

    gaps = np.linalg.norm(spots.centers - centers[:, None], axis=2)
    assert len(spots) == 35
    assert gaps.min(axis=1).max() < 0.15
    assert not spots.flaws.any()
    assert spots.areas.max() < 40
