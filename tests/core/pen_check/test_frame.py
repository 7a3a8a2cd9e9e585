from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from tests.simulated_pens import SAMPLE_PENS, six_led_pen

from lightpen.arrays import FloatArray
from lightpen.errors import FileError
from lightpen.model.pen import Pen, check_frame
from lightpen.model.rigid import rotation_from_vector
from lightpen.pen_check.frame import OpenedPen, examine_frame, moved_into_frame
from lightpen_extensions.simulator.swings import paper_pen

PEN = paper_pen()
R = rotation_from_vector(np.array([0.3, 1.0, 0.2]))


def with_leds(leds: FloatArray) -> Pen:
    return replace(PEN, leds=leds)


def test_the_paper_pen_meets_every_rule() -> None:
    check = examine_frame(PEN)

    assert (check.error, check.remark) == (None, None)
    assert (check.error, check.remark, check.can_be_moved) == (None, None, False)


@pytest.mark.parametrize("pair", list(combinations(range(10), 2)))
def test_each_pair_of_exchanged_leds_is_named(pair: tuple[int, int]) -> None:
    leds = PEN.leds.copy()
    leds[list(pair)] = leds[list(pair[::-1])]

    check = examine_frame(with_leds(leds))

    assert f"LEDs {pair[0] + 1} and {pair[1] + 1} are swapped" in str(check.error)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_mirrored_axis_breaks_the_right_hand(axis: int) -> None:
    leds = PEN.leds.copy()
    leds[:, axis] *= -1

    check = examine_frame(with_leds(leds))

    assert check.error


def test_raw_coordinates_can_be_moved_into_the_frame() -> None:
    raw = with_leds(PEN.leds @ R.T + [400.0, 300.0, 20.0])

    check = examine_frame(raw)

    assert check.can_be_moved
    inside = OpenedPen(Path("leds.csv"), pen=raw).sought
    assert inside is not None
    np.testing.assert_allclose(inside.leds, PEN.leds, atol=1e-9)
    np.testing.assert_array_equal(inside.normals, PEN.normals)


def test_normals_that_were_measured_turn_with_the_pen() -> None:
    raw = replace(PEN, leds=PEN.leds @ R.T, normals=PEN.normals @ R.T)

    np.testing.assert_allclose(moved_into_frame(raw).normals, PEN.normals, atol=1e-9)


def test_a_pen_upside_down_can_be_moved_into_the_frame() -> None:
    check = examine_frame(with_leds(PEN.leds * [-1.0, -1.0, 1.0]))

    assert check.can_be_moved


def test_discs_that_face_away_are_reported() -> None:
    normals = PEN.normals.copy()
    normals[3] *= -1

    check = examine_frame(replace(PEN, normals=normals))

    assert "normal of LED 4" in str(check.error)


def test_a_pen_of_another_layout_keeps_its_frame() -> None:
    check = examine_frame(six_led_pen())

    assert check.error is None
    assert "layout does not define the pen frame" in str(check.remark)
    assert check.is_a_pen


def test_leds_that_are_no_pen_are_not_sought() -> None:
    flat = with_leds(PEN.leds * [0.0, 1.0, 0.0])
    check = examine_frame(flat)

    assert not check.is_a_pen
    assert OpenedPen(Path("leds.csv"), pen=flat).sought is None


@pytest.mark.parametrize("name", SAMPLE_PENS)
def test_a_pen_is_in_error_exactly_where_the_frame_refuses_it(name: str) -> None:
    pen = SAMPLE_PENS[name]()
    try:
        check_frame(pen)
        refusal = None
    except FileError as error:
        refusal = error.message

    assert examine_frame(pen).error == refusal
