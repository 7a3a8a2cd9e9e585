"""Tests of the scale of a board."""

import pytest

from lightpen.errors import UsageError
from lightpen.intrinsics.boards import parse_board
from lightpen.intrinsics.scale_check import ScaleCheck

BOARD = parse_board("circles:9x7:20:10")


def test_a_board_is_as_large_as_the_caliper_says() -> None:
    check = ScaleCheck(stated=160.0, measured=160.8, expanded_uncertainty=0.04)
    board = check.scaled(BOARD)

    assert board.pitch == pytest.approx(20.1)
    assert board.detail == pytest.approx(10.05)
    assert check.sigma == pytest.approx(0.02 / 160.8)


def test_a_check_is_entered_as_three_numbers() -> None:
    assert ScaleCheck.parse(" 200; 200.12 0.04") == ScaleCheck(200, 200.12, 0.04)


@pytest.mark.parametrize(
    "text", ["200", "200 mm", "0.2331 0.0002", "200,12 200 1", "1 2 3 4"]
)
def test_another_text_is_refused_with_what_is_needed(text: str) -> None:
    with pytest.raises(UsageError, match="such as 200"):
        ScaleCheck.parse(text)


@pytest.mark.parametrize(
    "values", [(0, 1, 0.01), (1, -1, 0.01), (1, 1, 0.2), (1, 1, 0)]
)
def test_impossible_lengths_are_refused(values: tuple[float, float, float]) -> None:
    with pytest.raises(UsageError, match="is not valid"):
        ScaleCheck(*values)


@pytest.mark.parametrize("measured", [20.01, 231.0])
def test_a_length_that_no_printer_makes_of_the_stated_one_is_questioned(
    measured: float,
) -> None:
    with pytest.raises(UsageError, match="check both lengths and their unit"):
        ScaleCheck(200, measured, 0.04)
