"""Tests of the pen and of its frame."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lightpen.arrays import FloatArray
from lightpen.errors import FileError
from lightpen.model.pen import (
    Pen,
    check_frame,
    check_leds,
    in_pen_frame,
    pen_frame_from_raw,
)
from lightpen.model.rigid import rotation_from_vector

LEDS = np.array(
    [
        *([0.0, 0.0, -30.0], [-0.2, 60.1, -29.7], [0.3, 120.3, -30.2]),
        [0.0, 180.0, -30.1],
        *([-25.0, 20.0, 0.0], [-25.1, 90.0, 0.0], [-25.4, 160.0, 0.0]),
        *([25.1, 35.0, 0.0], [25.2, 105.0, 0.0], [24.9, 170.0, 0.0]),
    ]
)
PEN = Pen(
    LEDS, np.tile([0.0, 0.0, 1.0], (10, 1)), nominal_tip=np.array([0, -90.0, -24])
)


def moved(points: FloatArray, seed: int) -> FloatArray:
    rng = np.random.default_rng(seed)
    R = rotation_from_vector(rng.normal(size=3))
    return points @ R.T + rng.uniform(-900, 900, 3)


def renumbered(*order: int) -> Pen:
    """Return the pen whose LED j has the place of LED ``order[j - 1]``."""
    return replace(PEN, leds=LEDS[np.array(order) - 1])


def refusal(pen: Pen) -> str:
    with pytest.raises(FileError) as info:
        check_frame(pen)
    return str(info.value)


def test_a_pen_in_its_frame_passes() -> None:
    check_frame(PEN)


def test_deviations_of_real_leds_pass() -> None:
    noise = np.random.default_rng(1).uniform(-0.4, 0.4, LEDS.shape)
    check_frame(replace(PEN, leds=LEDS + noise))


@pytest.mark.parametrize(
    ("order", "pair"),
    [
        ((1, 3, 2, 4, 5, 6, 7, 8, 9, 10), "2 and 3"),
        ((4, 2, 3, 1, 5, 6, 7, 8, 9, 10), "1 and 4"),
        ((1, 2, 3, 4, 8, 6, 7, 5, 9, 10), "5 and 8"),
        ((1, 2, 3, 4, 5, 6, 7, 8, 10, 9), "9 and 10"),
        ((1, 6, 3, 4, 5, 2, 7, 8, 9, 10), "2 and 6"),
    ],
)
def test_two_exchanged_leds_are_named(order: tuple[int, ...], pair: str) -> None:
    assert f"LEDs {pair} are swapped" in refusal(renumbered(*order))


@given(st.permutations(range(1, 11)).filter(lambda order: order != sorted(order)))
def test_any_other_order_of_the_leds_is_refused(order: list[int]) -> None:
    with pytest.raises(FileError, match=r"swapped|out of order|mirror image"):
        check_frame(renumbered(*order))


@given(st.permutations(range(1, 11)).filter(lambda order: order != sorted(order)))
def test_any_other_order_of_raw_leds_is_refused(order: list[int]) -> None:
    raw = moved(renumbered(*order).leds, 1)
    with pytest.raises(FileError, match=r"swapped|out of order|mirror image"):
        pen_frame_from_raw(raw)


def test_leds_in_a_ring_of_wrong_places_are_listed() -> None:
    text = refusal(renumbered(2, 3, 1, 4, 5, 6, 7, 8, 9, 10))
    assert "LEDs 1, 2, 3 are out of order" in text


@pytest.mark.parametrize("axis", range(3))
def test_a_mirrored_pen_is_refused(axis: int) -> None:
    leds = LEDS.copy()
    leds[:, axis] *= -1
    with pytest.raises(FileError, match="mirror image of the pen"):
        check_frame(replace(PEN, leds=leds))


def test_exchanged_columns_are_refused() -> None:
    text = refusal(renumbered(1, 2, 3, 4, 8, 9, 10, 5, 6, 7))
    assert "if the columns are swapped, renumber them" in text


@pytest.mark.parametrize("seed", range(5))
def test_coordinates_of_a_measuring_machine_are_refused(seed: int) -> None:
    text = refusal(replace(PEN, leds=moved(LEDS, seed)))
    assert "The LEDs are not in the pen frame:" in text
    assert "measuring machine" in text


def test_the_led_farthest_from_its_place_is_named() -> None:
    turned = LEDS @ rotation_from_vector(np.array([0.0, 0.0, 0.02])).T
    text = refusal(replace(PEN, leds=turned))
    assert "LED 4 is 3.60 mm from its nominal position" in text  # 180 mm times 0.02


def test_normals_away_from_the_viewer_are_refused() -> None:
    normals = PEN.normals.copy()
    normals[6] = [0, 0, -1]
    text = refusal(replace(PEN, normals=normals))
    assert "normal of LED 7 points away from the viewer (nz = -1.000)" in text


@pytest.mark.parametrize("seed", range(20))
def test_a_pen_of_another_layout_may_have_any_frame(seed: int) -> None:
    rng = np.random.default_rng(seed)
    leds = rng.uniform(-90, 90, (rng.integers(4, 13), 3))
    check_frame(Pen(leds, np.tile([0.0, 0.0, 1.0], (len(leds), 1))))


@pytest.mark.parametrize("led", [2, 5, 9])
def test_a_pen_with_one_led_elsewhere_is_another_layout(led: int) -> None:
    leds = LEDS.copy()
    leds[led - 1] += [4.0, 0.0, 4.0]
    check_frame(replace(PEN, leds=leds[::-1]))


def test_a_flat_pen_is_another_layout() -> None:
    check_frame(replace(PEN, leds=(LEDS * [1, 1, 0])[::-1]))


def test_the_constructed_frame_is_that_of_the_definition() -> None:
    R, t = pen_frame_from_raw(moved(LEDS, 3))
    leds = moved(LEDS, 3) @ R.T + t
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(R) > 0
    np.testing.assert_allclose(leds[0, :2], 0, atol=1e-9)
    np.testing.assert_allclose(leds[3, 0], 0, atol=1e-9)
    assert leds[3, 1] > 0
    np.testing.assert_allclose(leds[4:, 2].mean(), 0, atol=1e-9)
    assert np.all(leds[:4, 2] < 0)
    assert np.all(leds[4:7, 0] < 0)
    assert np.all(leds[7:, 0] > 0)


@given(st.integers(0, 2**32 - 1))
def test_any_rigid_motion_is_undone(seed: int) -> None:
    """The nominal LEDs are in the frame exactly, so they come back exactly."""
    R, t = pen_frame_from_raw(moved(LEDS, seed))
    # 1e-9 mm: the rounding of coordinates of a metre, turned over the pen's length
    np.testing.assert_allclose(moved(LEDS, seed) @ R.T + t, LEDS, atol=1e-9)


@pytest.mark.parametrize("seed", range(10))
def test_leds_off_the_plane_get_the_same_frame_after_any_motion(seed: int) -> None:
    leds = LEDS + np.random.default_rng(seed).uniform(-0.4, 0.4, LEDS.shape)
    frames = [pen_frame_from_raw(points) for points in (leds, moved(leds, seed))]
    (R, t), (R_moved, t_moved) = frames
    np.testing.assert_allclose(
        moved(leds, seed) @ R_moved.T + t_moved, leds @ R.T + t, atol=1e-9
    )


def test_a_whole_pen_is_put_into_its_frame() -> None:
    assert PEN.nominal_tip is not None
    R = rotation_from_vector(np.array([0.3, 2.0, -1.0]))
    t = np.array([400.0, 300.0, -100.0])
    raw = replace(
        PEN,
        leds=LEDS @ R.T + t,
        normals=PEN.normals @ R.T,
        nominal_tip=R @ PEN.nominal_tip + t,
    )
    pen = in_pen_frame(raw)
    np.testing.assert_allclose(pen.leds, LEDS, atol=1e-9)
    np.testing.assert_allclose(pen.normals, PEN.normals, atol=1e-12)
    assert pen.nominal_tip is not None
    np.testing.assert_allclose(pen.nominal_tip, PEN.nominal_tip, atol=1e-9)


def test_mirrored_raw_coordinates_are_refused() -> None:
    with pytest.raises(FileError, match=r"mirror image .* change the sign of one"):
        pen_frame_from_raw(moved(LEDS, 1) * [1, -1, 1])


@pytest.mark.parametrize(
    ("led", "shift"), [(3, [4.0, 0.0, 0.0]), (6, [0.0, 0.0, 4.0]), (6, [9.0, 0.0, 0.0])]
)
def test_raw_leds_off_the_layout_are_refused(led: int, shift: list[float]) -> None:
    leds = LEDS.copy()
    leds[led - 1] += shift
    with pytest.raises(FileError, match="does not define the pen frame"):
        pen_frame_from_raw(moved(leds, 1))


def test_raw_leds_of_another_number_are_refused() -> None:
    with pytest.raises(FileError, match="does not define the pen frame"):
        pen_frame_from_raw(LEDS[:9])


def test_points_of_another_shape_are_a_mistake_of_the_caller() -> None:
    with pytest.raises(ValueError, match=r"shape \(10, 3\), got \(10, 2\)"):
        pen_frame_from_raw(LEDS[:, :2])


@pytest.mark.parametrize(
    ("leds", "sentence"),
    [
        (LEDS[:3], "needs 4 to 100 LEDs; the file has 3"),
        (np.zeros((101, 3)), "the file has 101"),
        (LEDS / 1000, r"span only 0\.18 mm, .* in metres or inches, state"),
        (LEDS * 1000, r"span 180 m; .* state their unit"),
        (LEDS + np.array([2e6, 0, 0]), r"LED 9 is 2000\.03 m from the origin"),
        (LEDS * 1e300, "from the origin, which is implausible"),
        (LEDS[:4] + np.array([0, 0, 0.5]), r"collinear within 0\.\d\d mm over 180 mm"),
        (
            np.concatenate([LEDS[:9], LEDS[:1] + np.array([0, 5.9, 0])]),
            r"LEDs 1 and 10 are 5\.90 mm apart, too close for discs of 10 mm",
        ),
    ],
)
def test_leds_that_cannot_be_a_pen_are_refused(leds: FloatArray, sentence: str) -> None:
    with pytest.raises(FileError, match=sentence):
        check_leds(leds, 10.0)


@pytest.mark.parametrize(
    "leds",
    [
        LEDS,
        LEDS[[0, 3, 4, 9]],
        LEDS * [1, 1, 0],
        LEDS * 27,
        np.concatenate([LEDS[:9], LEDS[:1] + np.array([0, 6.1, 0])]),
    ],
    ids=["the paper's", "four", "flat", "five metres long", "close"],
)
def test_leds_that_fix_a_pose_pass(leds: FloatArray) -> None:
    check_leds(leds, 10.0)
