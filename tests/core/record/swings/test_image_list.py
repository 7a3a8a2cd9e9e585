"""What a review lists of a solved swing, though its images differ in what is wrong."""

import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from lightpen.detection.reasons import Reason
from lightpen.record.swings.interrupted import ImageRow, count_left_out, worst_first
from lightpen.record.swings.reading import open_record
from lightpen.record.swings.solving import Solution, solve_again, solve_record

N_IMAGES = 20
DAMAGED = 7
SLIPPED = 12
EXCLUDED = (5, 9, 14)


@pytest.fixture(scope="module")
def solution(
    swung: Callable[..., Path], tmp_path_factory: pytest.TempPathFactory
) -> Solution:
    folder = tmp_path_factory.mktemp("review") / "swing"
    shutil.copytree(swung(N_IMAGES), folder)
    (folder / "images" / f"{DAMAGED:06d}.png").write_bytes(b"no image")
    excluded = dict.fromkeys(EXCLUDED, str(Reason.TAKEN_OUT))
    excluded[SLIPPED] = str(Reason.SLIPPED)
    return solve_again(solve_record(open_record(folder)), excluded)


@pytest.fixture(scope="module")
def rows(solution: Solution) -> dict[int, ImageRow]:
    """Return the images by their number, in the order of the list."""
    return {row.number: row for row in worst_first(solution)}


def test_the_image_without_the_pen_comes_first_and_then_the_worst(
    solution: Solution, rows: dict[int, ImageRow]
) -> None:
    numbers = list(rows)
    misfits = [row.misfit for row in rows.values()]

    assert numbers[0] == DAMAGED
    assert np.isnan(misfits[0])
    assert misfits[1:] == sorted(misfits[1:], reverse=True)
    assert numbers[1] == 1 + np.nanargmax(solution.misfits)
    assert sorted(numbers) == list(range(1, N_IMAGES + 1))


def test_every_image_says_whether_and_why_it_does_not_take_part(
    rows: dict[int, ImageRow],
) -> None:
    reasons = {row.number: row.reason for row in rows.values() if not row.is_used}

    assert reasons == {
        DAMAGED: Reason.UNREADABLE,
        SLIPPED: Reason.SLIPPED,
        **dict.fromkeys(EXCLUDED, Reason.TAKEN_OUT),
    }
    can_be_included = {row.number for row in rows.values() if row.can_be_included}
    assert can_be_included == {SLIPPED, *EXCLUDED}


def test_an_image_tells_how_many_leds_were_seen(
    solution: Solution, rows: dict[int, ImageRow]
) -> None:
    n_leds = len(solution.source.pen.leds)

    assert rows[DAMAGED].n_leds == 0
    assert all(3 < row.n_leds <= n_leds for n, row in rows.items() if n != DAMAGED)


def test_reasons_are_counted_the_most_frequent_first(solution: Solution) -> None:
    counts = list(count_left_out(solution).items())

    assert counts[0] == (Reason.TAKEN_OUT, len(EXCLUDED))
    assert sorted(counts[1:]) == [(Reason.SLIPPED, 1), (Reason.UNREADABLE, 1)]


def test_an_image_that_is_put_back_is_counted_no_more(solution: Solution) -> None:
    whole = solve_again(solution, {})

    assert dict(count_left_out(whole)) == {Reason.UNREADABLE: 1}
