"""Spots are found where discs were rendered, and flagged where they are not whole."""

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from math import cos, sin
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from lightpen.arrays import FloatArray, Image
from lightpen.detection.spots import MAX_SPOTS, SpotFlaw, Spots, detect_spots

SHAPE = (700, 900)
SUPERSAMPLING = 8
ELECTRONS_AT_FULL_SCALE = 10_000.0
WHOLE_FLAWS = SpotFlaw.MERGED | SpotFlaw.CUT

Hidden = Callable[[FloatArray, FloatArray], npt.NDArray[np.bool_]]


@dataclass(frozen=True)
class Lamp:
    """An elliptic disc in the image: centre, semi-axes, level above the background.

    `shading` is by what share the rim at the end of axis a is brighter than the middle.
    """

    x: float
    y: float
    a: float = 21.0
    b: float = 18.0
    angle: float = 0.0
    level: float = 200.0
    shading: float = 0.0


def grid_of_lamps(seed: int = 0, **shape: float) -> list[Lamp]:
    """Ten lamps at random places within the pixel, turned at random."""
    rng = np.random.default_rng(seed)
    return [
        Lamp(
            110.0 + 170.0 * (i % 5) + rng.uniform(-20, 20),
            180.0 + 320.0 * (i // 5) + rng.uniform(-20, 20),
            angle=rng.uniform(0, np.pi),
            **shape,
        )
        for i in range(10)
    ]


@lru_cache(maxsize=200)
def cover_of(
    lamp: Lamp, sigma: float, motion: tuple[float, float], hidden: Hidden | None
) -> tuple[int, int, FloatArray]:
    """Column and row where a patch begins, and how much of each pixel a disc covers."""
    reach = max(lamp.a, lamp.b) + 5 * sigma + 4 + np.hypot(*motion)
    left, top = round(lamp.x - reach), round(lamp.y - reach)
    side = 2 * round(reach) + 1
    fine = (np.arange(side * SUPERSAMPLING) + 0.5) / SUPERSAMPLING - 0.5
    x, y = np.meshgrid(left + fine, top + fine, sparse=True)
    times = np.linspace(-0.5, 0.5, 25) if any(motion) else np.zeros(1)
    cover = np.zeros((len(fine), len(fine)), np.float32)
    c, s = cos(lamp.angle), sin(lamp.angle)
    for time in times.tolist():
        dx = (x - lamp.x - time * motion[0]).astype(np.float32)
        dy = (y - lamp.y - time * motion[1]).astype(np.float32)
        u, v = c / lamp.a * dx + s / lamp.a * dy, c / lamp.b * dy - s / lamp.b * dx
        inside = u * u + v * v <= 1
        cover += np.where(inside, 1 + lamp.shading * u, 0.0) if lamp.shading else inside
    cover /= len(times)
    if hidden is not None:
        cover[np.broadcast_to(hidden(x, y), cover.shape)] = 0.0
    blurred = cv2.GaussianBlur(cover, (0, 0), sigma * SUPERSAMPLING)
    patch = blurred.reshape(side, SUPERSAMPLING, side, SUPERSAMPLING).mean((1, 3))
    return left, top, patch


def render(
    lamps: Sequence[Lamp],
    sigma: float = 0.8,
    motion: tuple[float, float] = (0.0, 0.0),
    hidden: Hidden | None = None,
    shape: tuple[int, int] = SHAPE,
) -> FloatArray:
    """Light of uniform discs, blurred, moved during the exposure, partly hidden.

    Where discs overlap the brighter one is seen.
    """
    light = np.zeros(shape)
    for lamp in lamps:
        left, top, patch = cover_of(replace(lamp, level=1.0), sigma, motion, hidden)
        side = len(patch)
        rows = slice(max(top, 0), min(top + side, shape[0]))
        columns = slice(max(left, 0), min(left + side, shape[1]))
        if rows.start >= rows.stop or columns.start >= columns.stop:
            continue
        inside = patch[
            rows.start - top : rows.stop - top,
            columns.start - left : columns.stop - left,
        ]
        # Blurred rims of neighbours add up; plateaus of overlapping discs do not.
        brightest = lamp.level * (1 + abs(lamp.shading))
        light[rows, columns] = np.minimum(
            light[rows, columns] + lamp.level * inside,
            np.maximum(light[rows, columns], brightest),
        )
    return light


def expose(light: FloatArray, full_scale: int = 255, seed: int = 1) -> Image:
    """Image with the shot noise and read noise of an ordinary camera."""
    rng = np.random.default_rng(seed)
    electrons = ELECTRONS_AT_FULL_SCALE / full_scale
    charge = rng.poisson(light * electrons) + rng.normal(0.0, 7.0, light.shape)
    digits = np.clip(np.rint(charge / electrons), 0, full_scale)
    return digits.astype(np.uint8) if full_scale == 255 else digits.astype(np.uint16)


def nearest(spots: Spots, lamps: Sequence[Lamp], reach: float = 3.0) -> list[int]:
    """Spot of each lamp; each lamp must have one of its own."""
    found = []
    for lamp in lamps:
        distances = np.hypot(*(spots.centers - (lamp.x, lamp.y)).T)
        assert distances.min() < reach
        found.append(int(distances.argmin()))
    assert len(set(found)) == len(lamps)
    return found


def center_rms(spots: Spots, lamps: Sequence[Lamp]) -> float:
    """Rms error per coordinate, px."""
    truth = np.array([(lamp.x, lamp.y) for lamp in lamps])
    errors = spots.centers[nearest(spots, lamps)] - truth
    return float(np.sqrt(np.mean(errors**2)))


def flaws_of(spots: Spots, lamps: Sequence[Lamp]) -> list[SpotFlaw]:
    return [SpotFlaw(int(spots.flaws[i])) for i in nearest(spots, lamps)]


def frames(folder: Path, every: int = 1) -> list[tuple[Image, dict[str, FloatArray]]]:
    """Images of a set and the true LED values of each as arrays by name."""
    truth = json.loads((folder / "truth.json").read_text(encoding="utf-8"))
    read: list[tuple[Image, dict[str, FloatArray]]] = []
    for frame in truth["frames"][::every]:
        data = np.frombuffer((folder / frame["file"]).read_bytes(), np.uint8)
        names = ("ellipse_center", "semi_axes", "area_px")
        leds = {n: np.array([led[n] for led in frame["leds"]]) for n in names}
        image = cv2.imdecode(data, cv2.IMREAD_UNCHANGED)
        assert image is not None
        read.append((image.astype(np.uint8), leds))
    return read


@pytest.mark.parametrize(
    ("name", "every"), [("swing-clean", 2), ("swing-full", 10), ("fixed-point", 1)]
)
def test_clean_sets_give_every_led_unflagged_and_nothing_else(
    shared_data: Path, name: str, every: int
) -> None:
    squares = []
    for image, leds in frames(shared_data / name, every):
        spots = detect_spots(image)
        lamps = [Lamp(x, y) for x, y in leds["ellipse_center"]]
        found = nearest(spots, lamps)
        assert len(spots) == len(lamps)
        assert not spots.flaws.any()
        squares.append((spots.centers[found] - leds["ellipse_center"]) ** 2)
        np.testing.assert_allclose(spots.areas[found], leds["area_px"], rtol=0.003)
        axes = 2.0 * np.sqrt(np.linalg.eigvalsh(spots.shapes[found])[:, ::-1])
        np.testing.assert_allclose(axes, leds["semi_axes"], rtol=0.003)
    # Shot noise alone allows 0.002 px.
    assert np.sqrt(np.mean(squares)) < 0.003


@pytest.mark.parametrize(
    ("level", "sigma", "limit", "flaws"),
    [
        pytest.param(200.0, 0.8, 0.005, SpotFlaw.NONE, id="normal"),
        pytest.param(25.0, 0.8, 0.015, SpotFlaw.NONE, id="dim"),
        pytest.param(510.0, 0.8, 0.010, SpotFlaw.SATURATED, id="saturated"),
        pytest.param(200.0, 2.5, 0.010, SpotFlaw.BLURRED, id="defocused"),
        pytest.param(200.0, 5.0, 0.015, SpotFlaw.BLURRED, id="far out of focus"),
    ],
)
def test_centers_stay_exact_in_bad_light(
    level: float, sigma: float, limit: float, flaws: SpotFlaw
) -> None:
    lamps = grid_of_lamps(level=level)
    spots = detect_spots(expose(render(lamps, sigma)))
    assert len(spots) == len(lamps)
    assert center_rms(spots, lamps) < limit
    assert flaws_of(spots, lamps) == [flaws] * len(lamps)


@pytest.mark.parametrize("size", [1.0, 2.0])
@pytest.mark.parametrize(
    ("level", "sigma", "limit"),
    [(150.0, 0.8, 0.012), (60.0, 0.8, 0.015), (150.0, 1.5, 0.025)],
)
def test_a_disc_that_is_brighter_on_one_side_keeps_its_center(
    level: float, sigma: float, limit: float, size: float
) -> None:
    shaded = grid_of_lamps(a=21.0 * size, b=18.0 * size, level=level, shading=0.08)
    spots = detect_spots(expose(render(shaded, sigma)))

    # Its outline lies 0.1 to 0.2 px towards the bright side.
    assert center_rms(spots, shaded) < limit


def test_a_disc_that_is_brighter_on_one_side_keeps_its_center_before_grey() -> None:
    shaded = grid_of_lamps(level=80.0, shading=0.12)
    assert center_rms(detect_spots(expose(render(shaded) + 80.0)), shaded) < 0.02


@pytest.mark.parametrize(
    ("full_scale", "level"),
    [(1023, 700.0), (4095, 3000.0), (16383, 15_000.0), (65535, 50_000.0)],
)
def test_deep_images_are_read_like_8_bit_ones(full_scale: int, level: float) -> None:
    lamps = grid_of_lamps(level=level)
    spots = detect_spots(expose(render(lamps), full_scale))
    assert len(spots) == len(lamps)
    assert center_rms(spots, lamps) < 0.01
    np.testing.assert_allclose(spots.contrasts, level / full_scale, rtol=0.03)


def test_full_scale_can_be_given() -> None:
    lamps = grid_of_lamps(level=900.0)
    spots = detect_spots(expose(render(lamps), 1023), full_scale=1023)
    np.testing.assert_allclose(spots.contrasts, 900.0 / 1023, rtol=0.03)


@pytest.mark.parametrize("full_scale", [1000, 1023, 4095, 16383, 65472])
def test_leds_at_the_limit_of_any_depth_are_saturated(full_scale: int) -> None:
    image = expose(render(grid_of_lamps(level=2.0 * full_scale)), full_scale)
    spots = detect_spots(image)
    assert (spots.flaws & SpotFlaw.SATURATED).all()
    np.testing.assert_allclose(spots.contrasts, 1, rtol=0.03)


def test_leds_below_the_limit_of_a_stated_depth_are_not_saturated() -> None:
    image = expose(render(grid_of_lamps(level=2000.0)), 1023)
    assert not (detect_spots(image, full_scale=4095).flaws & SpotFlaw.SATURATED).any()


def test_discs_of_six_pixels_are_found_in_a_large_image() -> None:
    lamps = grid_of_lamps(a=3.0, b=3.0)
    spots = detect_spots(expose(render(lamps, shape=(1100, 1300))))
    assert len(spots) == len(lamps)
    assert center_rms(spots, lamps) < 0.02


def test_small_discs_are_found_beside_a_bright_window() -> None:
    """In a crowded image single samples are ignored, so that it is sampled closer."""
    lamps = grid_of_lamps(a=2.6, b=2.6)
    light = render(lamps, shape=(1100, 1300))
    light[800:1090, 20:1280] += 150.0
    assert len(nearest(detect_spots(expose(light)), lamps)) == len(lamps)


@pytest.mark.parametrize(("a", "b", "sigmas"), [(6.0, 6.0, 10.0), (40.0, 32.0, 14.0)])
def test_discs_in_strong_noise_are_found_whole(
    a: float, b: float, sigmas: float
) -> None:
    lamps = grid_of_lamps(a=a, b=b, level=3.0 * sigmas)[:4]
    noise = np.random.default_rng(0).normal(20.0, 3.0, SHAPE)
    spots = detect_spots(np.rint(render(lamps) + noise).astype(np.uint8))
    assert not any(flaw & WHOLE_FLAWS for flaw in flaws_of(spots, lamps))


def test_a_disc_at_a_tenth_of_a_lamp_is_found_beside_it() -> None:
    lamps = grid_of_lamps(level=25.0)
    first = lamps[0]
    lamp = Lamp(first.x + 70.0, first.y + 5.0, 40.0, 40.0, level=400.0)
    spots = detect_spots(expose(render([*lamps, lamp])))
    assert len(spots) == len(lamps) + 1
    assert center_rms(spots, lamps) < 0.015
    assert spots.areas[0] == pytest.approx(np.pi * 40.0**2, rel=0.05)  # brightest first


def test_leds_in_front_of_a_bright_window_are_found_and_the_window_is_not() -> None:
    lamps = grid_of_lamps(level=90.0)
    light = render(lamps)
    light[60:640, 30:870] += 120.0
    spots = detect_spots(expose(light))
    assert len(spots) == len(lamps)
    assert center_rms(spots, lamps) < 0.02


@pytest.mark.parametrize(
    ("level", "full_scale", "flaw"),
    [
        (200.0, 255, SpotFlaw.NONE),
        (300.0, 255, SpotFlaw.SATURATED),
        (300.0, 4095, SpotFlaw.SATURATED),
    ],
)
@pytest.mark.parametrize("background", ["gradient", "glow", "wall"])
def test_leds_before_an_uneven_background_are_found_and_reported_if_saturated(
    background: str, level: float, full_scale: int, flaw: SpotFlaw
) -> None:
    lamps = grid_of_lamps(level=level)
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]] / max(SHAPE)
    behind = {
        "gradient": 40 * x,
        "glow": 40 * np.exp(-((x - 0.5) ** 2 + (y - 0.4) ** 2) / 0.1),
        "wall": 30.0 * (x > 0.3),
    }[background]
    rng = np.random.default_rng(0)
    noisy = (render(lamps) + behind + rng.normal(0, 1.5, SHAPE)) * full_scale / 255
    depth = np.uint8 if full_scale == 255 else np.uint16
    spots = detect_spots(np.clip(np.rint(noisy), 0, full_scale).astype(depth))

    found = flaws_of(spots, lamps)
    assert [each & SpotFlaw.SATURATED for each in found] == [flaw] * len(lamps)


def test_streaks_are_not_spots() -> None:
    lamps = grid_of_lamps()
    light = render(lamps)
    light[340:346, 20:880] += 150.0
    light[20:680, 885:892] += 250.0
    spots = detect_spots(expose(light))
    assert len(spots) == len(lamps)
    assert center_rms(spots, lamps) < 0.005


@pytest.mark.parametrize("length", [14, 30, 500])
def test_a_row_or_column_of_defective_pixels_is_no_spot(length: int) -> None:
    image = np.zeros((600, 700), np.uint8)
    image[8 : 8 + length, 40] = 200
    assert len(detect_spots(image)) == 0
    assert len(detect_spots(image.T)) == 0


def test_hot_pixels_are_not_spots_and_do_not_move_centers() -> None:
    lamps = grid_of_lamps(level=60.0)
    image = expose(render(lamps))
    clean = center_rms(detect_spots(image), lamps)
    rng = np.random.default_rng(5)
    rows, columns = rng.integers(0, image.shape, (600, 2)).T
    away = [
        all(np.hypot(c - lamp.x, r - lamp.y) > 24 for lamp in lamps)
        for r, c in zip(rows, columns, strict=True)
    ]
    image[rows[away], columns[away]] = 255
    spots = detect_spots(image)
    assert len(spots) == len(lamps)
    assert center_rms(spots, lamps) < clean + 0.003


def test_masked_circles_are_left_out() -> None:
    lamps = grid_of_lamps()
    image = expose(render(lamps))
    spots = detect_spots(image, np.array([[lamps[3].x, lamps[3].y, 23.0]]))
    assert len(spots) == len(lamps) - 1
    nearest(spots, lamps[:3] + lamps[4:])


def test_masked_circles_are_left_out_of_a_small_image_too() -> None:
    lamps = grid_of_lamps()
    left = [lamp for lamp in lamps if lamp.x < 400 and lamp.y < 400]
    image = expose(render(lamps))[:400, :400]
    mask = np.array([[lamp.x, lamp.y, 30.0] for lamp in left[:2]])
    spots = detect_spots(image, mask)
    assert len(detect_spots(image)) == len(spots) + 2
    nearest(spots, left[2:])


@pytest.mark.parametrize("gap", [8.0, 5.0, 3.0, 2.0])
def test_discs_with_a_dark_gap_are_parted(gap: float) -> None:
    lamps = grid_of_lamps(b=21.0)
    rng = np.random.default_rng(2)
    pairs = []
    for lamp in lamps:
        angle = rng.uniform(0, 2 * np.pi)
        distance = 42.0 + gap
        x, y = lamp.x + distance * np.cos(angle), lamp.y + distance * np.sin(angle)
        pairs += [lamp, Lamp(x, y, b=21.0)]
    spots = detect_spots(expose(render(pairs)))
    assert len(spots) == len(pairs)
    assert center_rms(spots, pairs) < 0.008
    assert not (spots.flaws & WHOLE_FLAWS).any()


def test_a_disc_parted_from_the_light_of_its_neighbour_is_flagged() -> None:
    lamps = [Lamp(200.3, 200.4, b=21.0), Lamp(242.8, 200.4, b=21.0), Lamp(500.0, 400.0)]
    spots = detect_spots(expose(render(lamps)))
    assert flaws_of(spots, lamps)[2] is SpotFlaw.NONE
    assert all(flaw & SpotFlaw.MERGED for flaw in flaws_of(spots, lamps)[:2])


def test_overlapping_discs_are_flagged_as_merged() -> None:
    whole = grid_of_lamps()
    pair = [Lamp(300.0, 340.0), Lamp(330.0, 345.0)]
    spots = detect_spots(expose(render([*whole, *pair])))
    assert center_rms(spots, whole) < 0.005
    rest = np.delete(np.arange(len(spots)), nearest(spots, whole))
    assert len(rest) == 1
    assert SpotFlaw(int(spots.flaws[rest[0]])) & SpotFlaw.MERGED


@pytest.mark.parametrize("sliver", [1.0, 3.0, 10.0, 20.0])
def test_discs_partly_behind_a_finger_are_flagged_as_cut(sliver: float) -> None:
    lamps = grid_of_lamps(b=21.0)
    cut, whole = lamps[:2], lamps[2:]

    def finger(x: FloatArray, y: FloatArray) -> npt.NDArray[np.bool_]:
        first, second = (
            np.hypot(x - lamp.x - 61.0 + sliver, y - lamp.y) < 40.0 for lamp in cut
        )
        return first | second

    spots = detect_spots(expose(render(lamps, hidden=finger)))
    assert not (spots.flaws[nearest(spots, whole)] & WHOLE_FLAWS).any()
    rest = np.delete(np.arange(len(spots)), nearest(spots, whole))
    assert len(rest) == 2
    assert (spots.flaws[rest] & SpotFlaw.CUT).all()


def test_discs_that_leave_the_image_are_flagged_as_cut() -> None:
    height, width = SHAPE
    lamps = [Lamp(2.0, 300.0), Lamp(500.0, height - 9.0), Lamp(width - 15.0, 100.0)]
    spots = detect_spots(expose(render(lamps)))
    assert len(spots) == 3
    assert (spots.flaws & SpotFlaw.CUT).all()


@pytest.mark.parametrize(
    ("radius", "sliver", "sigmas"),
    [(6.0, 1.0, 60.0), (21.0, 1.5, 20.0), (40.0, 2.0, 20.0)],
)
def test_cut_discs_are_reported_in_noise_whatever_their_size(
    radius: float, sliver: float, sigmas: float
) -> None:
    lamp = Lamp(100.3, 100.4, radius, radius, level=3.0 * sigmas)

    def edge(x: FloatArray, y: FloatArray) -> npt.NDArray[np.bool_]:
        return np.asarray(x > lamp.x + radius - sliver)

    light = render([lamp], hidden=edge, shape=(220, 220))
    noise = np.random.default_rng(0).normal(20.0, 3.0, light.shape)
    spots = detect_spots(np.rint(light + noise).astype(np.uint8))
    assert all(flaw & WHOLE_FLAWS for flaw in flaws_of(spots, [lamp]))


@pytest.mark.parametrize("sliver", [0.3, 1.0])
def test_a_sliver_beyond_any_border_is_noticed(sliver: float) -> None:
    """It moves the centre by 0.05 px and 0.14 px, and hardly changes the shape."""
    near, far = 20.5 - sliver, 278.5 + sliver
    places = [(near, 150.0), (150.0, near), (far, 150.0), (150.0, far)]
    lamps = [Lamp(x, y, b=21.0) for x, y in places]
    spots = detect_spots(expose(render(lamps, shape=(300, 300))))
    assert all(flaw & WHOLE_FLAWS for flaw in flaws_of(spots, lamps))


def test_a_disc_just_inside_the_border_is_whole() -> None:
    lamps = [Lamp(26.2, 300.0), Lamp(500.0, SHAPE[0] - 27.0)]
    spots = detect_spots(expose(render(lamps)))
    assert center_rms(spots, lamps) < 0.008
    assert not spots.flaws.any()


@pytest.mark.parametrize("sigma", [0.8, 2.5])
def test_area_and_shape_are_those_of_one_ellipse_however_blurred(sigma: float) -> None:
    """What is cut or merged is recognised by their disagreement."""
    spots = detect_spots(expose(render(grid_of_lamps(), sigma)))
    of_shape = 4 * np.pi * np.sqrt(np.linalg.det(spots.shapes))
    # Without the allowance for blur they are 0.1 % and 0.9 % apart.
    np.testing.assert_allclose(spots.areas, of_shape, rtol=4e-4 * sigma)


def test_motion_blur_is_flagged_and_keeps_the_center() -> None:
    lamps = grid_of_lamps()
    spots = detect_spots(expose(render(lamps, motion=(11.0, 4.0))))
    assert center_rms(spots, lamps) < 0.01
    assert (spots.flaws & SpotFlaw.BLURRED).all()


def test_edge_width_is_the_rise_of_the_rim() -> None:
    for sigma in (0.8, 1.2, 1.8):
        spots = detect_spots(expose(render(grid_of_lamps(), sigma)))
        # 10 to 90 % of a Gaussian edge, widened by the pixel.
        expected = 2.563 * np.hypot(sigma, 1 / np.sqrt(12))
        np.testing.assert_allclose(spots.edge_widths, expected, rtol=0.06)


def test_spots_hardly_above_the_noise_are_flagged_as_dim() -> None:
    lamps = grid_of_lamps(level=6.0)
    spots = detect_spots(expose(render(lamps)))
    assert [f & SpotFlaw.DIM for f in flaws_of(spots, lamps)] == [SpotFlaw.DIM] * len(
        lamps
    )


def test_a_view_of_a_larger_image_gives_the_same_spots() -> None:
    image = expose(render(grid_of_lamps(), shape=(1100, 1300)))
    views: list[Image] = [image[3:1050, 5:1201], image.T, image[:, ::-1]]
    for view in views:
        copy = detect_spots(view.copy(order="C"))
        np.testing.assert_allclose(detect_spots(view).centers, copy.centers, atol=1e-9)


def test_an_image_without_light_has_no_spots() -> None:
    black = np.zeros((1100, 1300))
    for spots in (
        detect_spots(black.astype(np.uint8)),
        detect_spots(black.astype(np.uint16)),
    ):
        assert len(spots) == 0
        assert spots.centers.shape == (0, 2)
        assert spots.shapes.shape == (0, 2, 2)
        assert spots.flaws.dtype == np.int64


@pytest.mark.parametrize("level", [3, 40, 255])
def test_noise_is_not_taken_for_spots(level: int) -> None:
    rng = np.random.default_rng(3)
    noise = np.clip(rng.normal(level, 8.0, (1100, 1300)), 0, 255)
    assert len(detect_spots(noise.astype(np.uint8))) == 0


def test_the_number_of_spots_is_limited() -> None:
    y, x = np.mgrid[:1100, :1300]
    image = np.where(np.hypot(x % 80 - 40, y % 80 - 40) < 18, 200, 0).astype(np.uint8)
    assert len(detect_spots(image)) == MAX_SPOTS


@pytest.mark.slow
@settings(max_examples=60)
@given(
    arrays(
        st.sampled_from([np.uint8, np.uint16]),
        st.tuples(st.integers(0, 40), st.integers(0, 40)),
    ),
    st.integers(1, 30),
)
def test_any_grey_image_is_accepted(image: Image, enlarged: int) -> None:
    blocks = np.repeat(np.repeat(image, enlarged, 0), enlarged, 1)
    spots = detect_spots(blocks)
    assert np.isfinite(spots.centers).all()
    assert np.isfinite(spots.shapes).all()
    assert (spots.areas > 0).all()


@pytest.mark.parametrize(
    "image",
    [
        np.zeros((20, 20, 3), np.uint8),
        np.zeros((20, 20), np.float64),
        np.zeros((20, 20), np.int16),
        np.zeros(20, np.uint8),
    ],
)
def test_images_that_are_not_grey_are_refused(image: Image) -> None:
    with pytest.raises(ValueError, match="must be a 2-D array of uint8 or uint16, got"):
        detect_spots(image)


@pytest.mark.parametrize("width", range(1200, 1264, 7))
def test_images_of_any_width_are_searched(width: int) -> None:
    image = np.zeros((1100, width), np.uint8)
    image[500:540, 600:640] = 200

    assert len(detect_spots(image)) == 1
