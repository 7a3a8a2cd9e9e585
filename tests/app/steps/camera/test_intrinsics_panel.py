"""Whether the swing at hand agrees with the intrinsics file, as the panel tells it."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from PySide6.QtWidgets import QLabel
from pytestqt.qtbot import QtBot

from lightpen.estimation.bundle.consistency_findings import FOCAL_LENGTH, Contradiction
from lightpen.formats.opened_files import CameraFile
from lightpen.record.swings.reading import open_record
from lightpen.record.swings.solving import Solution, solve_record
from lightpen_app.steps.camera.intrinsics_panel import IntrinsicsPanel
from lightpen_app.work.workbench import Workbench


@pytest.fixture(scope="module")
def solution(swung: Callable[..., Path]) -> Solution:
    return solve_record(open_record(swung(20)))


@pytest.fixture
def panel(qtbot: QtBot, workbench: Workbench, solution: Solution) -> IntrinsicsPanel:
    panel = IntrinsicsPanel(workbench.selection)
    qtbot.addWidget(panel)
    panel.set_value(CameraFile.read(solution.source.camera_files[0]))
    return panel


def words(panel: IntrinsicsPanel) -> str:
    labels = panel.findChildren(QLabel)
    return " ".join(each.text() for each in labels if each.isVisibleTo(panel))


def test_a_swing_that_agrees_with_the_file_is_reported(
    panel: IntrinsicsPanel, solution: Solution
) -> None:
    assert "agree" not in words(panel)
    panel.set_swing(solution)
    assert "Checked by a swing: file and camera agree." in words(panel)
    panel.set_swing(None)
    assert "agree" not in words(panel)


def test_what_a_swing_denies_of_the_file_is_reported(
    panel: IntrinsicsPanel, solution: Solution
) -> None:
    values = (2319.0, 0.5, 2326.0, 0.4)
    denied = Contradiction(FOCAL_LENGTH, "px", *values, 21.0, "", of_rig=False)
    calibration = replace(solution.calibration, contradictions=(denied,))
    panel.set_swing(replace(solution, calibration=calibration))

    assert "focal length 2326 ±" in words(panel)
    assert "agree" not in words(panel)


def test_a_swing_says_nothing_of_another_file(
    panel: IntrinsicsPanel, solution: Solution
) -> None:
    file = CameraFile.read(solution.source.camera_files[0])
    other = replace(file.camera, fx=file.camera.fx + 1.0)
    panel.set_value(replace(file, camera=other))
    panel.set_swing(solution)

    assert "agree" not in words(panel)
