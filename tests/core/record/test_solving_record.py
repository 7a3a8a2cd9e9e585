"""The tip of a record is one and the same, whoever asks for it, and however often."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from benchmarks.small_records import entries_of

from lightpen.detection.reasons import Reason
from lightpen.errors import CalibrationError, Cancelled, FileError
from lightpen.estimation.reports.report import calibration_record
from lightpen.model.limits import SwingLimits
from lightpen.record.swings.reading import (
    JOURNAL,
    image_name,
    open_record,
    record_files,
)
from lightpen.record.swings.solving import (
    Solution,
    record_inputs,
    solve_again,
    solve_record,
)
from lightpen.record.swings.writing import RecordWriter, note_excluded
from lightpen_extensions.simulator.swings import PAPER_TIP

N_IMAGES = 20


@pytest.fixture
def folder(swung: Callable[..., Path], tmp_path: Path) -> Path:
    """A record that the test may change."""
    return Path(shutil.copytree(swung(), tmp_path / "swing"))


def without_time(solution: Solution) -> dict[str, Any]:
    inputs = record_inputs(solution.source)
    record = calibration_record(solution.calibration, inputs, SwingLimits())
    found = entries_of(record)
    found.pop("created")
    return found


def assert_same(one: Solution, other: Solution) -> None:
    np.testing.assert_array_equal(
        one.calibration.joint.tip_pen, other.calibration.joint.tip_pen
    )
    assert without_time(one) == without_time(other)


def test_the_tip_is_the_true_one_within_its_uncertainty(folder: Path) -> None:
    calibration = solve_record(open_record(folder)).calibration
    errors = calibration.joint.tip_pen - PAPER_TIP

    assert (np.abs(errors) < 2 * calibration.budget.expanded_uncertainty[:3]).all()


def test_two_solutions_of_a_record_are_the_same_to_the_last_digit(folder: Path) -> None:
    assert_same(solve_record(open_record(folder)), solve_record(open_record(folder)))


def test_images_taken_out_give_the_same_tip_at_once_and_from_the_disk(
    folder: Path,
) -> None:
    excluded = {3: "taken out", 7: "tip slipped"}
    at_once = solve_again(solve_record(open_record(folder)), excluded)
    note_excluded(folder, excluded)
    from_disk = solve_record(open_record(folder))

    assert_same(at_once, from_disk)
    assert at_once.excluded == from_disk.excluded == excluded
    assert at_once.calibration.reasons[2] is Reason.TAKEN_OUT
    assert at_once.calibration.reasons[6] is Reason.SLIPPED
    assert at_once.calibration.used.sum() == N_IMAGES - 2


@pytest.mark.slow
def test_images_put_back_give_the_tip_of_before(folder: Path) -> None:
    before = solve_record(open_record(folder))
    note_excluded(folder, {1: "taken out", 2: "taken out"})
    fewer = solve_record(open_record(folder))
    note_excluded(folder, {})

    assert_same(solve_again(fewer, {}), before)
    assert_same(solve_record(open_record(folder)), before)


@pytest.mark.slow
def test_a_record_goes_by_its_mask(
    folder: Path, rewrite_header: Callable[..., None]
) -> None:
    header = json.loads((folder / "header.json").read_bytes())
    camera = header["cameras"][0] | {"mask_px": [[612.0, 512.0, 90.0]]}
    rewrite_header(folder, cameras=[camera])
    solution = solve_record(open_record(folder))
    seen = solution.observations.pixels
    distances = np.linalg.norm(seen - [612.0, 512.0], axis=2)

    assert np.nanmin(distances) > 80
    assert np.isnan(seen).any()


def test_progress_is_reported_and_what_it_raises_ends_the_computation(
    folder: Path,
) -> None:
    fractions: list[float] = []
    solve_record(open_record(folder), fractions.append)
    assert fractions == pytest.approx(np.arange(1, N_IMAGES + 1) / N_IMAGES)

    def cancel(fraction: float) -> None:
        raise Cancelled

    with pytest.raises(Cancelled):
        solve_record(open_record(folder), cancel)


def test_an_image_that_changed_is_left_out_with_its_reason(folder: Path) -> None:
    path = folder / image_name(4)
    path.write_bytes(path.read_bytes()[:-40] + bytes(40))
    solution = solve_record(open_record(folder))

    assert solution.calibration.reasons[3] is Reason.UNREADABLE
    assert "wrong checksum" in str(solution.observations.details[3])
    assert solution.calibration.used.sum() == N_IMAGES - 1


def test_an_image_that_is_gone_is_left_out_and_not_among_the_inputs(
    folder: Path,
) -> None:
    (folder / image_name(4)).unlink()
    solution = solve_record(open_record(folder))

    assert solution.calibration.reasons[3] is Reason.UNREADABLE
    inputs = record_inputs(solution.source).observations
    assert [file.path.name for file in inputs] == [
        f"{number:06d}.png" for number in range(1, N_IMAGES + 1) if number != 4
    ]


def test_a_record_without_images_says_what_to_do(folder: Path) -> None:
    (folder / JOURNAL).write_bytes(b"")
    with pytest.raises(
        CalibrationError, match=r"contains no images\. Resume the swing"
    ):
        solve_record(open_record(folder))


def test_a_record_without_one_readable_image_is_refused(folder: Path) -> None:
    for image in open_record(folder).images:
        (folder / image_name(image.number)).write_bytes(b"no image")
    with pytest.raises(FileError, match="None of the 20 images can be read"):
        solve_record(open_record(folder))


def test_too_few_images_left_leave_the_solution_as_it_is(folder: Path) -> None:
    solution = solve_record(open_record(folder))
    all_but_five = dict.fromkeys(range(6, N_IMAGES + 1), "taken out")
    with pytest.raises(
        CalibrationError, match=r"5 of 20 images are usable.*15 excluded manually"
    ):
        solve_again(solution, all_but_five)

    assert solution.excluded == {}


def test_numbers_of_images_that_are_not_there_take_nothing_out(folder: Path) -> None:
    solution = solve_record(open_record(folder))

    assert solve_again(solution, {99: "taken out"}).calibration.used.all()


def test_noting_what_is_noted_already_leaves_the_record_untouched(folder: Path) -> None:
    note_excluded(folder, {5: "taken out"})
    before = (folder / JOURNAL).read_bytes()
    note_excluded(folder, {5: "taken out"})

    assert (folder / JOURNAL).read_bytes() == before


def test_a_verdict_and_later_changes_leave_the_images_alone(folder: Path) -> None:
    before = solve_record(open_record(folder))
    with RecordWriter.resume(open_record(folder)) as writer:
        writer.conclude("pass")
    record = open_record(folder)

    assert record.verdict == "pass"
    assert_same(solve_record(record), before)


def test_the_files_of_a_record_are_all_that_its_folder_holds(folder: Path) -> None:
    found = {path for path in folder.rglob("*") if path.is_file()}

    assert set(record_files(open_record(folder))) == found
    assert json.loads((folder / "header.json").read_text(encoding="utf-8"))


def test_a_record_is_solved_by_what_its_station_assumed(
    folder: Path, rewrite_header: Callable[..., None]
) -> None:
    usual = solve_record(open_record(folder)).calibration
    rewrite_header(folder, assumptions={"form_error": 0.01})
    other = solve_record(open_record(folder)).calibration

    assert other.assumptions.form_error == 0.01
    assert other.budget.weakest_uncertainty > 2 * usual.budget.weakest_uncertainty
