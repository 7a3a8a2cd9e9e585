"""The tip in force verified through the whole wizard, as an operator walks it."""

import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from PySide6.QtCore import Qt
from tests.accepted_tip import Hold, accept_tip, leant
from tests.verifying import TIMEOUT, Verifier

from lightpen.record.folder_archive import SIMULATED
from lightpen.record.verifications import CONCLUSION, VERIFICATIONS
from lightpen.simulator.toucher import Artefacts
from lightpen.verification.choices import TaskKind, VerificationChoices
from lightpen.verification.session import VISIT_TOUCHES
from lightpen_app.work.settings import Settings, Station

if TYPE_CHECKING:
    from tests.app.conftest import OpenWizard, Walker

STATION = "Hall 2"
TABS_BEFORE_PEN = 5
TOUCHES = Station(
    *("Ann", "LP-04", "T-10", "C-1"),
    ball_diameter=10.0,
    fixed_point_touches=3,
    touch_images=2,
)


@pytest.fixture
def known(settings: Settings, open_wizard: "OpenWizard") -> "Walker":
    """The program at a station that is known, with a tip in force."""
    settings.set_station(STATION, TOUCHES)
    settings.set_last_station(STATION)
    walker = open_wizard()
    walker.until(lambda: not walker.workbench.preparation.lacks())
    accept_tip(walker.workbench.folder, walker.workbench.preparation)
    return walker


def records(walker: "Walker") -> list[dict[str, Any]]:
    folder = walker.workbench.folder / SIMULATED / VERIFICATIONS
    return [json.loads(file.read_bytes()) for file in sorted(folder.glob("*.json"))]


def test_a_tip_is_verified_from_start_without_a_key_between_touch_and_verdict(
    known: "Walker",
) -> None:
    walker = known
    walker.click_step("Camera")
    walker.click_step("Start")
    walker.until_says("Verify it")
    walker.click("Verify it")
    assert walker.title() == "Verify"
    walker.until_says("Touch the cone")
    assert walker.says("SIMULATED")
    assert walker.tells("Length")
    for _ in range(2):
        walker.press(Qt.Key.Key_Right)
    walker.click("Touch both ends")
    walker.until_says("NOT POSSIBLE")
    assert walker.tells("The length is not known. Enter the certified one.")
    walker.click_into("Certified length", f"{Artefacts().length:g}")
    walker.press(Qt.Key.Key_Tab)
    # The pen that came by itself may have touched the cone meanwhile.
    walker.until(lambda: not walker.says("NOT POSSIBLE"))
    walker.click("Let the simulated operator touch")
    n_inputs = walker.n_inputs
    walker.until_says("Tip proven")

    assert walker.n_inputs == n_inputs
    assert walker.says("PASS")
    assert walker.says("Fixed point: PASS")
    assert walker.says("Length: PASS")
    assert [each["verification"] for each in records(walker)] == [
        TaskKind.FIXED_POINT,
        TaskKind.LENGTH,
        CONCLUSION,
    ]
    assert {each["origin"] for each in records(walker)} == {"simulated"}
    assert walker.main_button().text() == "Back to Start"
    assert walker.steps()["Verify"] == "now"


def test_a_tip_that_was_accepted_with_doubts_is_verified_under_that_word(
    known: "Walker",
) -> None:
    walker = known
    accept_tip(walker.workbench.folder, walker.workbench.preparation, grade="check")
    walker.click_step("Verify")

    walker.until_tells("Tip T-10 of pen LP-04, in force since")
    (lead,) = (text for text in walker.texts() if "in force since" in text)
    assert lead.endswith("CHECK")


def test_without_a_tip_in_force_the_step_says_so(
    settings: Settings, open_wizard: "OpenWizard"
) -> None:
    settings.set_station(STATION, replace(TOUCHES, tip="T-99"))
    settings.set_last_station(STATION)
    walker = open_wizard()
    walker.until(lambda: not walker.workbench.preparation.lacks())
    walker.click_step("Verify")

    walker.until_tells("No tip is in force for tip T-99 of pen LP-04.")
    assert walker.says("NOT POSSIBLE")
    assert not walker.main_button().isEnabled()


def test_the_pen_is_shown_over_its_swings_and_no_file_is_made_that_is_no_better(
    known: "Walker",
) -> None:
    walker = known
    workbench = walker.workbench
    accept_tip(workbench.folder, workbench.preparation, seed=4)
    walker.click_step("Verify")
    walker.until_says("Touch the cone")
    for _ in range(TABS_BEFORE_PEN):
        walker.press(Qt.Key.Key_Right)
    walker.until_says("No LED has moved against the others over 2 swings.")
    assert not walker.offers("Improve the LED file")

    for seed in (5, 6):
        accept_tip(workbench.folder, workbench.preparation, seed=seed)
    walker.press(Qt.Key.Key_Left)
    walker.press(Qt.Key.Key_Right)
    walker.until_says("No LED has moved against the others over 4 swings.")
    walker.click("Improve the LED file")
    walker.until_tells("does not confirm the new LED file")
    assert not list(workbench.folder.rglob("led files/*"))


# A verification that was interrupted


@pytest.fixture
def interrupted(known: "Walker", tmp_path: Path) -> "Walker":
    """Somebody was killed amid a verification by fixed point and witness."""
    folder, copy = known.workbench.folder, tmp_path / "as it was"
    kept = folder / SIMULATED / VERIFICATIONS
    verifier = Verifier(folder, known.workbench.preparation)
    kinds = (TaskKind.FIXED_POINT, TaskKind.DRIFT)
    verifier.come(VerificationChoices(kinds, n_touches=3, n_frames=2))
    for _ in range(VISIT_TOUCHES):
        verifier.touch(Hold(tilt=0.0))
        verifier.see(verifier.holder.away())
    verifier.touch(*leant(3)[:2])
    shutil.copytree(kept, copy)
    verifier.runner.shut_down()
    assert verifier.runner.await_end(TIMEOUT)
    shutil.rmtree(kept)
    shutil.copytree(copy, kept)
    known.click_step("Camera")
    known.click_step("Start")
    known.until_says("Interrupted verification")
    return known


def test_a_verification_that_was_interrupted_is_gone_on_with(
    interrupted: "Walker",
) -> None:
    walker = interrupted
    walker.click("Continue")
    walker.until(lambda: walker.title() == "Verify")
    walker.until_says("2 of 3 touches")
    walker.click("Let the simulated operator touch")
    walker.until(lambda: walker.main_button().text() == "Back to Start")

    walker.until_tells("The witness stays within")
    kinds = [each["verification"] for each in records(walker)]
    assert kinds == [TaskKind.FIXED_POINT, TaskKind.DRIFT, CONCLUSION]
    walker.click_step("Start")
    walker.until(lambda: not walker.says("Interrupted verification"))


def test_a_verification_that_was_interrupted_is_closed_after_a_question(
    interrupted: "Walker",
) -> None:
    walker = interrupted
    walker.click("Close it")
    assert walker.tells("Close it as abandoned? All that is kept of it stays.")
    walker.click("Close it")
    walker.until(lambda: not walker.says("Interrupted verification"))

    (conclusion,) = records(walker)
    assert conclusion["outcome"] == "abandoned"
