"""The images of a calibration are posed again by what its file states."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lightpen.formats.json_records import record_bytes
from lightpen.record.retraced import Retraced, retrace
from lightpen.record.statement import StatedCalibration, read_statement


def of_file(stated: dict[str, Any], folder: Path) -> StatedCalibration:
    path = folder / "tip.json"
    path.write_bytes(record_bytes(stated))
    return read_statement(path).calibration


@pytest.fixture
def retraced(stated: dict[str, Any], tmp_path: Path) -> Retraced:
    found = retrace(of_file(stated, tmp_path))
    assert found is not None
    return found


def test_the_last_uncertainty_is_that_of_the_record(
    stated: dict[str, Any], retraced: Retraced
) -> None:
    np.testing.assert_allclose(
        retraced.uncertainties[-1], stated["expanded_uncertainty_mm"], rtol=1e-9
    )
    # By the poses alone a tip is hardly worse than by all images together.
    away = np.abs(retraced.tips[-1] - stated["tip_pen_mm"])
    assert (away < stated["expanded_uncertainty_mm"]).all()


def test_images_that_take_no_part_are_passed_over(
    stated: dict[str, Any], retraced: Retraced
) -> None:
    used = [i for i, frame in enumerate(stated["frames"], 1) if frame["used"]]

    assert len(used) < len(stated["frames"])
    assert len(retraced.tilts) == len(used)
    assert retraced.numbers[-1] == used[-1]


def test_postures_and_residuals_are_those_of_the_calibration(
    stated: dict[str, Any], retraced: Retraced
) -> None:
    tilts = np.degrees([retraced.tilts.min(), retraced.tilts.max()])
    np.testing.assert_allclose(tilts, stated["coverage"]["tilt_deg"], atol=0.05)
    rms = np.sqrt(np.mean(np.sum(retraced.residuals**2, axis=1)))
    # Less than where the cone holds the tip, by three of six numbers a pose.
    assert 0.7 * stated["rms_px"] < rms < stated["rms_px"]


@pytest.mark.parametrize(
    "otherwise", [{"instrument": None}, {"rig": {}}, {"second_cone": {"distance": 1}}]
)
def test_nothing_is_retraced_where_the_file_does_not_hold_enough(
    stated: dict[str, Any], tmp_path: Path, otherwise: dict[str, Any]
) -> None:
    assert retrace(of_file({**stated, **otherwise}, tmp_path)) is None


def test_too_few_images_are_not_retraced(
    stated: dict[str, Any], tmp_path: Path
) -> None:
    few = [
        {**frame, "used": frame["used"] and i < 6}
        for i, frame in enumerate(stated["frames"])
    ]

    assert retrace(of_file({**stated, "frames": few}, tmp_path)) is None
