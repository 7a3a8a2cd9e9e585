"""Pens of which two LEDs are exchanged."""

import numpy as np

from lightpen.model.pen import Pen
from lightpen.pen_check.frame import examine_frame, exchanged, leds_to_exchange
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
