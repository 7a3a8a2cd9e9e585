"""Pens, corrected by a finding."""

import numpy as np
import pytest

from lightpen.model.pen import Pen
from lightpen.pen_check.frame import (
    corrected,
    examine_frame,
    exchanged,
    leds_to_exchange,
)
from lightpen.pen_check.match import Finding, MatchFinding
from lightpen_extensions.simulator.swings import paper_pen

PEN = paper_pen()


def are_same(pen: Pen, other: Pen) -> bool:
    return np.array_equal(pen.leds, other.leds) and np.array_equal(
        pen.normals, other.normals
    )


def test_leds_that_stand_in_each_others_place_are_exchanged() -> None:
    wrong = exchanged(PEN, (5, 8))

    pair = leds_to_exchange(examine_frame(wrong))

    assert pair == (5, 8)
    assert are_same(exchanged(wrong, pair), PEN)


def test_leds_in_their_order_need_no_exchange() -> None:
    assert leds_to_exchange(examine_frame(PEN)) is None


@pytest.mark.parametrize("wrong_axis", ["x", "y"])
def test_of_two_coordinates_that_is_exchanged_which_the_frame_needs(
    wrong_axis: str,
) -> None:
    wrong = exchanged(PEN, (5, 9), wrong_axis)

    assert are_same(
        corrected(wrong, Finding(MatchFinding.EXCHANGED, (5, 9), axes="x/y")), PEN
    )


def test_several_coordinates_are_exchanged_together() -> None:
    wrong = exchanged(PEN, (2, 8), "yz")

    assert are_same(
        corrected(wrong, Finding(MatchFinding.EXCHANGED, (2, 8), axes="y, z")), PEN
    )


def test_an_led_off_its_place_is_put_where_it_was_measured() -> None:
    by = (0.8, 0.0, -0.1234567)
    result = corrected(PEN, Finding(MatchFinding.SHIFTED, (6,), by))

    moved = result.leds - paper_pen().leds
    np.testing.assert_allclose(moved[5], by, atol=5e-4)  # written to the micrometre
    assert not np.delete(moved, 5, axis=0).any()


def test_what_the_images_do_not_tell_is_left_to_the_user() -> None:
    unsure = Finding(MatchFinding.SHIFTED, (6,), (0.8, 0.0, 0.0), is_sure=False)
    either = Finding(MatchFinding.SHIFTED_EITHER, (6, 7), (0.8, 0.0, 0.0))

    for finding in (unsure, either, Finding(MatchFinding.UNSEEN, (6,))):
        assert not finding.can_be_corrected
