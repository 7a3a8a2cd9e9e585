"""What earlier versions wrote is opened, computed to the same tip, and gone on with."""

import json
import shutil
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lightpen.record.acceptance import accept, conclude_accepted
from lightpen.record.folder_archive import RECORDS, FolderArchive
from lightpen.record.names import Names
from lightpen.record.reading import open_record, recorded_names
from lightpen.record.solving import load_image, solve_record
from lightpen.record.unfinished import find_unfinished
from lightpen.record.writing import RecordWriter
from lightpen.swing.resuming import read_resumable

NAMES = Names("Hall 2", "Ann", "LP-04", "T-10", "C-1", 10.0)
ACCEPTED = "20261122-084628_LP-04_T-10"
INTERRUPTED = "20261122-084651_LP-04_T-10"


@pytest.fixture
def data(version_0_1: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(version_0_1, tmp_path / "data"))


@pytest.fixture
def tips(version_0_1: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((version_0_1 / "tips.json").read_bytes())
    return found


def test_the_result_is_in_force_and_finds_its_record_though_that_has_moved(
    data: Path, tips: dict[str, Any]
) -> None:
    found = FolderArchive(data).in_force("LP-04", "T-10", is_simulated=True)

    assert found is not None
    assert (found.names, found.grade) == (NAMES, "check")
    assert found.accepted == datetime(2026, 11, 22, 8, 46, 51, 529655, UTC)
    assert found.tip_pen.tolist() == tips[ACCEPTED]["tip_pen_mm"]
    assert found.uncertainty.tolist() == tips[ACCEPTED]["expanded_uncertainty_mm"]
    assert found.record == data / RECORDS / ACCEPTED
    assert open_record(found.record).verdict == "check"


@pytest.mark.parametrize("name", [ACCEPTED, INTERRUPTED])
def test_the_records_give_the_tip_that_they_gave(
    data: Path, tips: dict[str, Any], name: str
) -> None:
    record = open_record(data / RECORDS / name)
    calibration = solve_record(record).calibration
    joint = calibration.joint

    assert recorded_names(record) == NAMES
    # Then the camera was held at its file, now it is solved for.
    uncertainty = calibration.budget.expanded_uncertainty
    for found, key, within in (
        (joint.tip_pen, "tip_pen_mm", uncertainty[:3]),
        (joint.cone_cam, "cone_cam_mm", uncertainty[3:]),
    ):
        assert (np.abs(found - tips[name][key]) <= within).all()
    assert len(calibration.used) == tips[name]["images"]["total"]
    assert calibration.used.sum() == tips[name]["images"]["used"]


def test_the_swing_without_a_verdict_is_offered_and_goes_on(data: Path) -> None:
    found = find_unfinished(data / RECORDS)
    (record,) = conclude_accepted(FolderArchive(data), found).interrupted
    swing = read_resumable(record.folder)
    first, image = record.images[0], load_image(solve_record(record), 1)
    with RecordWriter.resume(swing.record) as writer:
        number = writer.append(
            image, first.pixels, first.rotation, first.translation, 0.0
        )

    assert record.folder.name == INTERRUPTED
    assert swing.state.n_kept == 12
    assert number == 13
    assert len(open_record(record.folder).images) == 13


def test_a_tip_accepted_now_takes_the_place_of_the_earlier_one_and_keeps_it(
    data: Path,
) -> None:
    archive = FolderArchive(data)
    (earlier,) = archive.folder.iterdir()
    content = earlier.read_bytes()
    solution = solve_record(open_record(data / RECORDS / ACCEPTED))

    result = accept(archive, solution, datetime.now(UTC), "As before.")

    found = archive.in_force("LP-04", "T-10", is_simulated=True)
    assert found is not None
    assert found.accepted == result.accepted
    assert found.images == (1, 2, 3, *range(5, 15))
    assert list(archive.folder.iterdir()) == [earlier]
    assert earlier.read_bytes() == content


def test_an_earlier_result_of_a_simulated_swing_is_in_force_for_no_pen(
    data: Path,
) -> None:
    assert FolderArchive(data).in_force("LP-04", "T-10") is None
    assert FolderArchive(data).tips("LP-04") == ()
    assert FolderArchive(data).tips("LP-04", is_simulated=True) == ("T-10",)


def test_an_earlier_result_whose_swing_is_gone_stays_in_force_and_says_nothing_of_it(
    data: Path,
) -> None:
    shutil.rmtree(data / RECORDS)
    found = FolderArchive(data).in_force("LP-04", "T-10")

    assert found is not None
    assert found.origin is None
