"""A solved record: what every image says of the tip, used or not."""

import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lightpen.detection.reasons import Reason
from lightpen.errors import CalibrationError, FileError
from lightpen.record.swings.interrupted import count_left_out, worst_first
from lightpen.record.swings.reading import open_record
from lightpen.record.swings.solving import (
    Solution,
    load_image,
    solve_again,
    solve_record,
)

N_IMAGES = 20


@pytest.fixture(scope="module")
def folder(
    swung: Callable[..., Path], tmp_path_factory: pytest.TempPathFactory
) -> Path:
    """Return a record in which image 7 is damaged."""
    folder = tmp_path_factory.mktemp("solving") / "swing"
    shutil.copytree(swung(N_IMAGES), folder)
    (folder / "images" / "000007.png").write_bytes(b"no image")
    return folder


@pytest.fixture(scope="module")
def solution(folder: Path) -> Solution:
    return solve_record(open_record(folder))


@pytest.fixture(scope="module")
def without_five(solution: Solution) -> Solution:
    return solve_again(solution, {5: "taken out"})


def test_a_used_image_has_the_misfit_that_the_calibration_gives_it(
    solution: Solution,
) -> None:
    used = solution.calibration.used
    np.testing.assert_allclose(
        solution.misfits[used], solution.calibration.rms[used], rtol=1e-12
    )


def test_an_image_that_is_taken_out_keeps_a_misfit(
    solution: Solution, without_five: Solution
) -> None:
    assert not without_five.calibration.used[4]
    # The tip no longer gives way to the image, so it fits a little worse.
    assert without_five.misfits[4] == pytest.approx(solution.misfits[4], rel=0.2)
    assert without_five.misfits[4] >= solution.misfits[4]


def test_an_image_in_which_the_tip_slipped_shows_by_its_misfit(
    solution: Solution,
) -> None:
    calibration = solution.calibration
    pixels = calibration.observations.pixels.copy()
    pixels[2] += [3.0, 0.0]  # the pen as a whole: turning it cannot make up for that
    moved = replace(calibration.observations, pixels=pixels)

    found = solve_again(replace(solution, observations=moved), {})

    row = next(row for row in worst_first(found) if row.number == 3)
    assert row.reason is Reason.SLIPPED
    assert found.misfits[2] > 20 * np.nanmedian(found.misfits)


def test_an_unreadable_image_has_no_misfit_and_does_not_hinder(
    solution: Solution,
) -> None:
    assert np.isnan(solution.misfits[6])
    assert np.isnan(solution.residuals[6]).all()
    assert solution.calibration.reasons[6] is Reason.UNREADABLE
    assert solution.calibration.used.sum() == N_IMAGES - 1


def test_putting_back_gives_the_same_tip_to_the_last_digit(
    solution: Solution, without_five: Solution
) -> None:
    again = solve_again(without_five, {})

    np.testing.assert_array_equal(
        again.calibration.joint.tip_pen, solution.calibration.joint.tip_pen
    )
    np.testing.assert_array_equal(again.residuals, solution.residuals)


def test_too_few_images_are_refused(solution: Solution) -> None:
    rest = dict.fromkeys(range(4, N_IMAGES + 1), "taken out")
    with pytest.raises(CalibrationError, match="at least 6"):
        solve_again(solution, rest)


def test_images_are_listed_worst_first_and_those_without_the_pen_before_them(
    solution: Solution,
) -> None:
    rows = worst_first(solution)

    assert rows[0].number == 7
    misfits = [row.misfit for row in rows[1:]]
    assert misfits == sorted(misfits, reverse=True)
    assert sorted(row.number for row in rows) == list(range(1, N_IMAGES + 1))
    assert rows[1].is_used
    assert rows[1].n_leds > 3


def test_only_what_was_taken_out_can_be_put_back(without_five: Solution) -> None:
    rows = {row.number: row for row in worst_first(without_five)}

    assert rows[5].can_be_included
    assert not rows[5].is_used
    assert not rows[7].can_be_included
    assert not rows[7].is_used
    assert not rows[1].can_be_included


def test_what_is_left_out_is_counted_by_reason(without_five: Solution) -> None:
    assert count_left_out(without_five) == {Reason.TAKEN_OUT: 1, Reason.UNREADABLE: 1}


def test_an_image_is_read_again_by_its_number(solution: Solution) -> None:
    camera = solution.source.camera
    assert load_image(solution, 3).shape == (camera.height, camera.width)
    with pytest.raises(FileError, match="wrong checksum"):
        load_image(solution, 7)
