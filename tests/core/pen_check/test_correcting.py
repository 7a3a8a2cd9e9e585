"""Drafts of a pen, corrected by a finding."""

import numpy as np
import pytest

from lightpen.pen_check.draft import (
    PenDraft,
    check_draft,
    corrected,
    exchanged,
    leds_to_exchange,
)
from lightpen.pen_check.match import Finding, MatchFinding
from lightpen_extensions.simulator.swings import paper_pen

DRAFT = PenDraft.of(paper_pen())


def test_leds_that_stand_in_each_others_place_are_exchanged() -> None:
    wrong = exchanged(DRAFT, (5, 8))

    pair = leds_to_exchange(check_draft(wrong).frame)

    assert pair == (5, 8)
    assert exchanged(wrong, pair) == DRAFT


def test_leds_in_their_order_need_no_exchange() -> None:
    assert leds_to_exchange(check_draft(DRAFT).frame) is None
    assert leds_to_exchange(None) is None


@pytest.mark.parametrize("wrong_axis", ["x", "y"])
def test_of_two_coordinates_that_is_exchanged_which_the_frame_needs(
    wrong_axis: str,
) -> None:
    wrong = exchanged(DRAFT, (5, 9), wrong_axis)

    assert (
        corrected(wrong, Finding(MatchFinding.EXCHANGED, (5, 9), axes="x/y")) == DRAFT
    )


def test_several_coordinates_are_exchanged_together() -> None:
    wrong = exchanged(DRAFT, (2, 8), "yz")

    assert (
        corrected(wrong, Finding(MatchFinding.EXCHANGED, (2, 8), axes="y, z")) == DRAFT
    )


def test_an_led_off_its_place_is_put_where_it_was_measured() -> None:
    by = (0.8, 0.0, -0.1234567)
    result = corrected(DRAFT, Finding(MatchFinding.SHIFTED, (6,), by))

    moved = result.pen().leds - paper_pen().leds
    np.testing.assert_allclose(moved[5], by, atol=5e-4)  # written to the micrometre
    assert not np.delete(moved, 5, axis=0).any()
    assert result.rows[5][1] == DRAFT.rows[5][1]  # what stays is as it was typed


def test_what_the_images_do_not_tell_is_left_to_the_user() -> None:
    unsure = Finding(MatchFinding.SHIFTED, (6,), (0.8, 0.0, 0.0), is_sure=False)
    either = Finding(MatchFinding.SHIFTED_EITHER, (6, 7), (0.8, 0.0, 0.0))

    for finding in (unsure, either, Finding(MatchFinding.UNSEEN, (6,))):
        assert not finding.can_be_corrected
