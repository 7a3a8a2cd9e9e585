from dataclasses import replace

import numpy as np
import pytest

from lightpen.errors import FileError
from lightpen.model.rigid import rotation_from_vector
from lightpen.pen_check.draft import FACING, PenDraft, check_draft
from lightpen_extensions.simulator.scenes import fanned_pen
from lightpen_extensions.simulator.swings import paper_pen

PEN = paper_pen()
DRAFT = PenDraft.of(PEN)
R = rotation_from_vector(np.array([0.3, 1.0, 0.2]))


def test_a_draft_is_the_pen_that_it_shows() -> None:
    pen = PenDraft.of(fanned_pen()).pen()

    np.testing.assert_allclose(pen.leds, fanned_pen().leds, atol=1e-6)
    np.testing.assert_allclose(pen.normals, fanned_pen().normals, atol=1e-6)
    assert pen.nominal_tip is not None
    assert (pen.diameter, pen.name, pen.nominal_tip.tolist()) == (
        *(10.0, "fanned"),
        [0.0, -90.0, -25.0],
    )


def test_numbers_are_shown_without_idle_zeros() -> None:
    leds = PEN.leds.copy()
    leds[0] = [-1e-9, 12.5, -30.1234567]

    assert PenDraft.of(replace(PEN, leds=leds)).rows[0][:3] == (
        *("0", "12.5", "-30.123457"),
    )


def test_a_cell_that_is_no_number_is_named() -> None:
    draft = DRAFT.with_cell(4, 1, "12,4O")

    (flaw,) = draft.flaws()

    assert (flaw.row, flaw.column) == (4, 1)
    assert str(flaw.message) == 'LED 5, y: "12,4O" is not a number (letter O).'
    with pytest.raises(FileError, match="LED 5, y"):
        draft.pen()


def test_a_decimal_comma_is_a_decimal_point() -> None:
    assert DRAFT.with_cell(4, 1, " 12,4 ").pen().leds[4, 1] == 12.4


def test_a_new_led_has_to_be_typed() -> None:
    draft = DRAFT.with_led()

    assert draft.n_leds == 11
    assert draft.rows[10] == ("", "", "", *FACING)
    with pytest.raises(FileError, match="LED 11, x: a cell is empty"):
        draft.pen()


def test_removing_an_led_renumbers_the_later_ones() -> None:
    draft = DRAFT.without_led(2)

    assert draft.n_leds == 9
    assert draft.rows[2] == DRAFT.rows[3]


def test_only_discs_that_face_elsewhere_have_normals_to_show() -> None:
    assert not DRAFT.has_normals
    assert PenDraft.of(fanned_pen()).has_normals


def test_a_normal_that_is_not_of_unit_length_is_named() -> None:
    with pytest.raises(FileError, match=r"LED 3: the normal 0\.5 0 1 does not have"):
        DRAFT.with_cell(2, 3, "0.5").pen()


@pytest.mark.parametrize("diameter", ["0", "-3", "200"])
def test_a_disc_that_cannot_be_is_refused(diameter: str) -> None:
    with pytest.raises(FileError, match="is not valid"):
        replace(DRAFT, diameter=diameter).pen()


def test_a_diameter_that_is_no_number_is_named() -> None:
    with pytest.raises(FileError, match="Diameter of the discs: a cell is empty"):
        replace(DRAFT, diameter="").pen()


def test_a_tip_needs_all_coordinates_or_none() -> None:
    assert replace(DRAFT, tip=("", "", "")).pen().nominal_tip is None
    with pytest.raises(FileError, match="Nominal tip, y: a cell is empty"):
        replace(DRAFT, tip=("0", "", "-25")).pen()


def test_a_good_draft_is_usable_and_sought() -> None:
    check = check_draft(DRAFT)

    assert check.usable is check.pen is check.sought
    assert check.flaw is None


def test_an_unchanged_draft_stands_for_the_very_pen() -> None:
    assert check_draft(DRAFT, PEN).usable is PEN


def test_an_empty_draft_has_nothing_wrong_but_is_no_pen() -> None:
    check = check_draft(PenDraft())

    assert (check.flaw, check.pen, check.sought, check.usable) == (None,) * 4


def test_a_flawed_draft_tells_its_cell() -> None:
    check = check_draft(DRAFT.with_cell(0, 0, "x"))

    assert str(check.flaw) == 'LED 1, x: "x" is not a number.'
    assert check.pen is None


def test_raw_coordinates_are_sought_in_the_pen_frame_but_not_usable() -> None:
    raw = replace(PEN, leds=PEN.leds @ R.T + [400.0, 300.0, 20.0])

    check = check_draft(PenDraft.of(raw))

    assert check.usable is None
    assert check.sought is not None
    np.testing.assert_allclose(check.sought.leds, PEN.leds, atol=1e-5)


def test_leds_that_are_no_pen_are_shown_but_not_sought() -> None:
    check = check_draft(DRAFT.with_cell(6, 1, "16"))

    assert check.pen is not None
    assert check.sought is check.usable is None
