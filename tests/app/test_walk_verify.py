"""The tip in force verified through the whole wizard, as an operator walks it."""

import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from PySide6.QtCore import QSize, Qt
from PySide6.QtWidgets import QApplication, QListWidget
from tests.accepted_tip import accept_tip, leant
from tests.app.room import scrolled_sideways
from tests.verifying import TIMEOUT, Verifier

from lightpen.estimation.reports.verdict import Grade
from lightpen.record.folder import VERIFICATIONS
from lightpen.record.results.result_folder import SIMULATED
from lightpen.record.swings.header import Names
from lightpen.swing.preparation import SourceChoice
from lightpen_app.widgets.bars import QuestionBar
from lightpen_app.widgets.fitting import FRAME
from lightpen_app.work.settings import Settings, Station, StoredCamera, stored_group
from lightpen_extensions.comparisons.assessment import CONCLUSION
from lightpen_extensions.measure.tasks.fixed_point import FIXED_POINT
from lightpen_extensions.measure.tasks.registry import TASKS
from lightpen_extensions.measure.tasks.task import VerificationChoices

if TYPE_CHECKING:
    from tests.app.conftest import OpenWizard, Walker

STATION = "Hall 2"
RULE = "Decision rule: simple acceptance (JCGM 106, 8.2)."
TASKS_BEFORE_PEN = len(TASKS)
FIVE = VerificationChoices(n_cone=5, n_cone_frames=3, n_frames=2)  # fewer do not
TOUCHES = Station(
    Names("", "Ann", "LP-04", "T-10", "C-1", 10.0),
    camera=StoredCamera(SourceChoice()),
    extensions={"measure": stored_group(FIVE)},
)


@pytest.fixture
def known(settings: Settings, open_wizard: "OpenWizard") -> "Walker":
    """The program at a station that is known, with a tip in force."""
    settings.set_station(STATION, TOUCHES)
    settings.set_last(station=STATION)
    walker = open_wizard()
    walker.until(lambda: not walker.workbench.selection.preparation.missing_inputs())
    accept_tip(walker.workbench.folder, walker.workbench.selection.preparation)
    return walker


def records(walker: "Walker") -> list[dict[str, Any]]:
    folder = walker.workbench.folder / SIMULATED / VERIFICATIONS
    return [json.loads(file.read_bytes()) for file in sorted(folder.glob("*.json"))]


@pytest.mark.slow
def test_every_task_has_room_in_a_window_of_1280_x_800(known: "Walker") -> None:
    walker = known
    walker.window.resize(QSize(1280, 800) - FRAME)
    walker.click_step("Verify")
    tasks = walker.window.page().findChild(QListWidget, "task_list")
    assert isinstance(tasks, QListWidget)
    for row in range(tasks.count()):
        tasks.setCurrentRow(row)
        QApplication.processEvents()
        assert scrolled_sideways(walker.window.page()) == ()


@pytest.mark.slow
def test_a_tip_is_verified_from_start_without_a_key_between_touch_and_verdict(
    known: "Walker",
) -> None:
    walker = known
    walker.click_step("Camera")
    walker.click_step("Start")
    walker.until_says("Verify tip")
    walker.click("Verify tip")
    assert walker.title() == "Verify"
    walker.until_says("Probe the cone")
    assert walker.says("SIMULATED")
    walker.click("Let the simulated operator probe")
    n_inputs = walker.n_inputs
    walker.until_says("Tip verified")

    assert walker.n_inputs == n_inputs
    assert walker.says("PASS")
    tasks = walker.window.page().findChild(QListWidget, "task_list")
    assert isinstance(tasks, QListWidget)
    assert tasks.item(0).text().startswith("Tip check: PASS")
    assert [each["verification"] for each in records(walker)] == [
        FIXED_POINT.kind,
        CONCLUSION,
    ]
    assert {each["origin"] for each in records(walker)} == {"simulated"}
    assert walker.main_button().text() == "Measure a part"
    assert walker.steps()["Verify"] == "now"


@pytest.mark.slow
def test_another_check_is_done_on_request_and_the_first_stays_ticked(
    known: "Walker",
) -> None:
    walker = known
    walker.click_step("Verify")
    walker.until_says("Probe the cone")
    walker.click("Let the simulated operator probe")
    walker.until_says("Tip verified")
    walker.click("Let the simulated operator probe")  # it puts the pen down
    checks = walker.window.page().findChild(QListWidget, "task_list")
    assert isinstance(checks, QListWidget)
    verified = checks.item(0).text()

    checks.setCurrentRow(1)
    walker.click("Do now")
    walker.until(lambda: checks.item(1).text() == "Drift: now")

    assert checks.currentRow() == 1
    assert checks.item(0).text() == verified
    assert verified.startswith("Tip check: PASS")


@pytest.mark.slow
def test_a_tip_that_was_accepted_with_doubts_is_verified_under_that_word(
    known: "Walker",
) -> None:
    walker = known
    accept_tip(
        walker.workbench.folder,
        walker.workbench.selection.preparation,
        grade=Grade.CHECK,
    )
    walker.click_step("Verify")

    walker.until_tells("Practice tip T-10 of pen LP-04, saved")
    (lead,) = (text for text in walker.texts() if "Practice tip" in text)
    assert lead.endswith("CHECK")


@pytest.mark.slow
def test_without_a_tip_in_force_the_step_says_so(
    settings: Settings, open_wizard: "OpenWizard"
) -> None:
    settings.set_station(
        STATION, replace(TOUCHES, names=replace(TOUCHES.names, tip="T-99"))
    )
    settings.set_last(station=STATION)
    walker = open_wizard()
    walker.until(lambda: not walker.workbench.selection.preparation.missing_inputs())
    walker.click_step("Verify")

    walker.until_tells("Tip T-99 of pen LP-04 has no accepted calibration.")
    assert walker.says("NOT POSSIBLE")
    assert not walker.main_button().isEnabled()


@pytest.mark.slow
def test_the_pen_is_shown_over_its_swings(known: "Walker") -> None:
    walker = known
    workbench = walker.workbench
    accept_tip(workbench.folder, workbench.selection.preparation, seed=4)
    walker.click_step("Verify")
    walker.until_says("Probe the cone")
    for _ in range(TASKS_BEFORE_PEN):
        walker.press(Qt.Key.Key_Down)
    walker.until_says("No LED moved relative to the others in 2 swings. " + RULE)


# A verification that was interrupted


@pytest.fixture
def interrupted(known: "Walker", tmp_path: Path) -> "Walker":
    """Somebody was killed amid a tip check."""
    folder, copy = (
        known.workbench.folder,
        tmp_path / "reinstated from the earlier calibration.",
    )
    kept = folder / SIMULATED / VERIFICATIONS
    verifier = Verifier(folder, known.workbench.selection.preparation)
    verifier.come(FIVE)
    verifier.touch(*leant(5)[:2])
    shutil.copytree(kept, copy)
    verifier.runner.shut_down()
    assert verifier.runner.await_end(TIMEOUT)
    shutil.rmtree(kept)
    shutil.copytree(copy, kept)
    known.click_step("Camera")
    known.click_step("Start")
    known.until_says("Interrupted: 1")
    return known


@pytest.mark.slow
def test_a_verification_that_was_interrupted_is_gone_on_with(
    interrupted: "Walker",
) -> None:
    walker = interrupted
    walker.click("Continue")
    walker.until(lambda: walker.title() == "Verify")
    walker.until_says("2 of 5 points")
    walker.click("Let the simulated operator probe")
    walker.until(lambda: walker.main_button().text() == "Measure a part")

    kinds = [each["verification"] for each in records(walker)]
    assert kinds == [FIXED_POINT.kind, CONCLUSION]
    walker.click_step("Start")
    walker.until(lambda: not walker.says("Interrupted: 1"))


@pytest.mark.slow
def test_a_verification_that_was_interrupted_is_closed_after_a_question(
    interrupted: "Walker",
) -> None:
    walker = interrupted
    walker.click("Close verification")
    assert walker.tells(
        "Close this verification as abandoned? Its recorded data remains."
    )
    (question,) = (w for w in walker.seen() if isinstance(w, QuestionBar))
    walker.click_on(walker.control("Close verification", question))
    walker.until(lambda: not walker.says("Interrupted: 1"))

    (conclusion,) = records(walker)
    assert conclusion["outcome"] == "abandoned"
