"""The images of a calibration are posed again by what its file states."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lightpen.estimation.reports.calibration_record import CalibrationRecord
from lightpen.formats.own_json import record_bytes
from lightpen.record.calibrations import read_calibration
from lightpen_app_extensions.report.reestimated import (
    ReestimatedPoses,
    reestimate_poses,
)


def of_file(stated: dict[str, Any], folder: Path) -> CalibrationRecord:
    path = folder / "tip.json"
    path.write_bytes(record_bytes(stated))
    return read_calibration(path).calibration


@pytest.fixture
def reestimated(stated: dict[str, Any], tmp_path: Path) -> ReestimatedPoses:
    found = reestimate_poses(of_file(stated, tmp_path))
    assert found is not None
    return found


def test_images_that_take_no_part_are_passed_over(
    stated: dict[str, Any], reestimated: ReestimatedPoses
) -> None:
    used = [i for i, frame in enumerate(stated["frames"], 1) if frame["used"]]

    assert len(used) < len(stated["frames"])
    assert len(reestimated.tilts) == len(used)


def test_postures_and_residuals_are_those_of_the_calibration(
    stated: dict[str, Any], reestimated: ReestimatedPoses
) -> None:
    tilts = np.degrees([reestimated.tilts.min(), reestimated.tilts.max()])
    np.testing.assert_allclose(tilts, stated["coverage"]["tilt_deg"], atol=0.05)
    rms = np.sqrt(np.mean(np.sum(reestimated.residuals**2, axis=1)))
    # Less than where the cone holds the tip, by three of six numbers a pose.
    assert 0.7 * stated["rms_px"] < rms < stated["rms_px"]


def test_the_images_of_a_rig_are_not_reestimated(
    stated: dict[str, Any], tmp_path: Path
) -> None:
    of_rig = of_file({**stated, "rig": {"cameras": []}}, tmp_path)
    assert reestimate_poses(of_rig) is None


def test_too_few_images_are_not_reestimated(
    stated: dict[str, Any], tmp_path: Path
) -> None:
    few = [
        {**frame, "used": frame["used"] and i < 6}
        for i, frame in enumerate(stated["frames"])
    ]

    assert reestimate_poses(of_file({**stated, "frames": few}, tmp_path)) is None
