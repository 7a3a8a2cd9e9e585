"""Tests of `checks.recompute_check`: whoever has the key can still lie."""

import json
import shutil
from collections.abc import Callable
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from msgspec import structs
from tests.accepted_tip import accept_tip

from lightpen.archive.checks.check import ArchiveCheckResult, check_archive
from lightpen.archive.checks.recompute_check import with_recomputed
from lightpen.archive.logbook.logbook import Logbook
from lightpen.detection.observations import observe_centers
from lightpen.estimation.bundle.priors import ConeSeparation
from lightpen.estimation.calibrate import calibrate
from lightpen.estimation.reports.calibration_record import CalibrationRecord
from lightpen.estimation.reports.report import calibration_record
from lightpen.estimation.uncertainty.second_cone import SecondSwing
from lightpen.formats.camera_files import read_camera
from lightpen.formats.hashes import Inputs, with_content
from lightpen.formats.observation_files import Centers
from lightpen.formats.opened_files import CameraFile, PenFile
from lightpen.formats.pen_files import read_pen
from lightpen.formats.rig_files import read_rig
from lightpen.model.limits import SwingLimits
from lightpen.record.results.result_folder import FolderArchive
from lightpen.record.results.results import Result
from lightpen.record.swings.names import Names
from lightpen.simulator.swings import PAPER_CONE, simulate_centers, swing_poses
from lightpen.swing.image_sources import SecondCamera
from lightpen.swing.preparation import Preparation

NAMES = Names("Hall 2", "Ann", "LP-04", "T-10", "C-1", 10.0)


@pytest.fixture
def result(tmp_path: Path, shared_data: Path) -> Result:
    """An accepted tip in the data folder."""
    files = shared_data / "fixed-point"
    prepared = Preparation(
        names=NAMES,
        camera_file=CameraFile.read(files / "camera.yaml"),
        pen_file=PenFile.read(files / "leds.csv"),
    )
    file = accept_tip(tmp_path, prepared)
    found = FolderArchive(tmp_path).content(file)
    assert isinstance(found, Result)
    return found


def entered_and_recomputed(data: Path, n_tips: int | None = None) -> ArchiveCheckResult:
    with closing(Logbook(data)) as logbook:
        assert logbook.enter_owed() == ()
        checked = check_archive(logbook.database, data)
        assert checked.findings == ()
        return with_recomputed(checked, logbook.database, data, n_tips)


def test_honest_tips_follow_from_their_centres(tmp_path: Path, result: Result) -> None:
    checked = entered_and_recomputed(tmp_path)

    assert (checked.n_tips, checked.findings, checked.notes) == (1, (), ())


def test_a_tip_of_two_cameras_follows_from_the_centres_of_both(
    tmp_path: Path, shared_data: Path, shifted: Callable[..., Result]
) -> None:
    data, folder = tmp_path / "data", tmp_path / "files"
    shutil.copytree(shared_data / "fixed-point", folder)
    shutil.copy(folder / "camera.yaml", folder / "right.yaml")
    left = {"name": "left", "intrinsics": "camera.yaml"}
    right = {
        "name": "right",
        "intrinsics": "right.yaml",
        "cam_from_rig_rotation": [1, 0, 0, 0, 1, 0, 0, 0, 1],
        "cam_from_rig_translation": [-300.0, 0.0, 0.0],
    }
    (folder / "rig.json").write_text(json.dumps({"cameras": [left, right]}))
    rig_file = read_rig(folder / "rig.json")
    prepared = Preparation(
        names=NAMES,
        second=SecondCamera(rig_file=rig_file),
        pen_file=PenFile.read(folder / "leds.csv"),
    )
    honest = FolderArchive(data).content(accept_tip(data, prepared))
    shutil.rmtree(folder)
    assert isinstance(honest, Result)
    FolderArchive(data).store(shifted(honest, "tip"))

    checked = entered_and_recomputed(data)

    assert (checked.n_tips, checked.notes) == (2, ())
    assert [each.values["number"] for each in checked.findings] == [2]


def test_a_tip_of_two_cones_follows_from_the_centres_in_both(
    tmp_path: Path, shared_data: Path, result: Result, shifted: Callable[..., Result]
) -> None:
    honest = replace(result, calibration=in_two_cones(shared_data / "fixed-point"))
    FolderArchive(tmp_path).store(honest)
    FolderArchive(tmp_path).store(shifted(honest, "tip"))

    checked = entered_and_recomputed(tmp_path)

    assert (checked.n_tips, checked.notes) == (3, ())
    assert [each.values["number"] for each in checked.findings] == [3]


def in_two_cones(files: Path) -> CalibrationRecord:
    """Calibrate a tip by two swings, in cones 120 mm apart."""
    camera, pen = read_camera(files / "camera.yaml"), read_pen(files / "leds.csv")
    rng = np.random.default_rng(8)
    swings = []
    for cone in (PAPER_CONE, np.add(PAPER_CONE, [120.0, 0.0, 0.0])):
        swing = swing_poses(30, rng, pen=pen, camera=camera, cone_cam=cone)
        poses = swing.rotations, swing.translations
        pixels = simulate_centers(camera, pen, *poses, 0.02, rng)
        centers = Centers(np.arange(1, 31), pixels, Path("swing.csv"))
        swings.append(observe_centers(centers, camera, pen))
    second = SecondSwing(swings[1], ConeSeparation(120.0, 0.002))
    found = calibrate(camera, pen, swings[0], second=second)
    camera_file, pen_file = files / "camera.yaml", files / "leds.csv"
    inputs = Inputs(with_content(camera_file), with_content(pen_file), (), None)
    return calibration_record(found, inputs, "joint", SwingLimits())


def test_no_more_tips_are_recomputed_than_asked_for(
    tmp_path: Path, result: Result
) -> None:
    FolderArchive(tmp_path).store(result)

    assert entered_and_recomputed(tmp_path, 1).n_tips == 1
    assert entered_and_recomputed(tmp_path, 0).n_tips == 0


@pytest.mark.slow
@pytest.mark.parametrize("what", ["tip", "uncertainty"])
def test_a_forged_tip_or_u_that_is_entered_and_signed_is_found(
    what: str, tmp_path: Path, result: Result, shifted: Callable[..., Result]
) -> None:
    FolderArchive(tmp_path).store(shifted(result, what))
    found = entered_and_recomputed(tmp_path)

    (finding,) = found.findings
    assert finding.code == "archive.other-tip-again"
    assert finding.values["number"] == 2


@pytest.fixture
def shifted() -> Callable[..., Result]:
    """Return a function that forges a result: another tip, or half of its U."""

    def forge(result: Result, what: str) -> Result:
        calibration = result.calibration
        x, y, z = calibration.tip_pen_mm
        a, b, c = calibration.expanded_uncertainty_mm
        forged = (
            structs.replace(calibration, tip_pen_mm=(x + 0.01, y, z))
            if what == "tip"
            else structs.replace(
                calibration, expanded_uncertainty_mm=(a / 2, b / 2, c / 2)
            )
        )
        return replace(result, calibration=forged)

    return forge


def test_a_tip_that_cannot_be_recomputed_is_noted(
    tmp_path: Path, result: Result
) -> None:
    inputs = result.calibration.inputs
    without = structs.replace(inputs, pen=structs.replace(inputs.pen, base64=""))
    calibration = structs.replace(result.calibration, inputs=without)
    FolderArchive(tmp_path).store(replace(result, calibration=calibration))
    found = entered_and_recomputed(tmp_path)

    assert (found.n_tips, found.findings) == (1, ())
    assert [each.code for each in found.notes] == ["archive.not-recomputed"]
