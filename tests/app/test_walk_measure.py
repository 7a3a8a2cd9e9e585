"""A part measured through the wizard, as an operator walks it."""

import json
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from msgspec import structs
from PySide6.QtWidgets import QListWidget
from tests.accepted_tip import accept_tip

from lightpen.record.folder import TOUCHES, VERIFICATIONS
from lightpen.record.results.result_folder import RESULTS, SIMULATED
from lightpen.record.swings.header import Names
from lightpen.swing.preparation import SourceChoice
from lightpen_app.work.settings import Settings, Station, StoredCamera, stored_group
from lightpen_app_extensions.report.control import PrintReportWindow
from lightpen_extensions.comparisons.assessment import CONCLUSION
from lightpen_extensions.measure.measuring.plan_checks import write_plan
from lightpen_extensions.measure.probing_operator import plate_plan
from lightpen_extensions.measure.tasks.part import PART
from lightpen_extensions.measure.tasks.task import VerificationChoices
from lightpen_program.extensions import main

if TYPE_CHECKING:
    from tests.app.conftest import OpenWizard, Walker

STATION = "Hall 2"
DOME = structs.replace(plate_plan().features[7], touches=5)
HOLE = structs.replace(plate_plan().feature("hole 1"), touches=4)
SMALL = structs.replace(
    plate_plan().limited_to({DOME.name, HOLE.name}), features=(DOME, HOLE)
)
PROBING = Station(
    Names("", "Ann", "LP-04", "T-10", "C-1", 10.0),
    camera=StoredCamera(SourceChoice()),
    extensions={"measure": stored_group(VerificationChoices(plan=SMALL, n_frames=2))},
)


@pytest.fixture
def known(settings: Settings, open_wizard: "OpenWizard") -> "Walker":
    """The program at a station with a tip in force and the plan of a dome."""
    settings.set_station(STATION, PROBING)
    settings.set_last(station=STATION)
    walker = open_wizard()
    walker.until(lambda: not walker.workbench.selection.preparation.missing_inputs())
    accept_tip(walker.workbench.folder, walker.workbench.selection.preparation)
    return walker


def test_a_part_is_measured_without_a_key_between_first_and_last_point(
    known: "Walker",
) -> None:
    walker = known
    walker.click_step("Measure")
    walker.until_tells("Probe the sphere dome: 0 of 5 points.")
    assert walker.says("Feature 1 of 2")
    assert walker.tells(SMALL.name)
    walker.click("Let the simulated operator probe")
    n_inputs = walker.n_inputs
    walker.until_says("Feature 2 of 2")
    walker.until_says("Part measured")

    assert walker.n_inputs == n_inputs
    assert walker.tells("simple acceptance")
    folder = walker.workbench.folder / SIMULATED / VERIFICATIONS
    records = [json.loads(each.read_bytes()) for each in sorted(folder.glob("*.json"))]
    assert [each["verification"] for each in records] == [PART.kind, CONCLUSION]
    of_hole, of_dome = records[0]["characteristics"]
    assert of_dome["actual"] == pytest.approx(20, abs=0.1)
    assert {of_hole["decision"], of_dome["decision"]} == {"accepted"}
    (session,) = records[0]["inputs"]["touches"]
    assert measured_again(folder / TOUCHES / session["folder"], walker) == [
        pytest.approx(each["actual"], abs=1e-6) for each in (of_hole, of_dome)
    ]

    walker.click("Report...")
    walker.until(lambda: walker.window.findChild(PrintReportWindow) is not None)


def measured_again(session: Path, walker: "Walker") -> list[float]:
    """Return what `lightpen measure` finds in the record of a session."""
    folder = walker.workbench.folder
    plan, found = folder / "plan.yaml", folder / "again.json"
    write_plan(SMALL, plan)
    (tip,) = (folder / SIMULATED / RESULTS).glob("*.json")
    words = "measure", plan, session, "--tip", tip, "--json", found, "--no-entry"
    assert main([*map(str, words), "--frames", "2"]) == 0
    characteristics = json.loads(found.read_bytes())["characteristics"]
    return [each["actual"] for each in characteristics]


@pytest.mark.slow
def test_the_simulated_plate_is_ticked_off_feature_by_feature(known: "Walker") -> None:
    walker = known
    walker.click_step("Measure")
    walker.click("Other plan")
    walker.until_says("Choose a plan")
    walker.click("Try the simulated plate")
    features = walker.window.page().findChild(QListWidget, "task_list")
    assert isinstance(features, QListWidget)
    walker.until(lambda: features.count() == len(plate_plan().features))
    assert features.currentItem().text() == "top: now"
    walker.click("Let the simulated operator probe")
    walker.until(lambda: "flatness top" in features.item(0).text())
    assert features.item(0).text().endswith("OK")
    walker.until(lambda: features.currentItem().text() == "hole 1: now")
    assert features.item(1).text() == "front"  # done; its place needs the frame
    walker.click("Finish early")
    walker.until_says("Not proven")

    rows = [features.item(i).text() for i in range(features.count())]
    assert rows == [features.item(0).text(), "front"]
    walker.click("Other plan")
    walker.until_says("Choose a plan")


def test_without_a_plan_the_step_says_what_to_do(
    settings: Settings, open_wizard: "OpenWizard"
) -> None:
    settings.set_station(STATION, replace(PROBING, extensions={}))
    settings.set_last(station=STATION)
    walker = open_wizard()
    walker.until(lambda: not walker.workbench.selection.preparation.missing_inputs())
    accept_tip(walker.workbench.folder, walker.workbench.selection.preparation)

    walker.click_step("Measure")

    walker.until_tells("No measuring plan is chosen.")
    assert walker.says("Choose a plan")
    assert walker.main_button().text() == "Open a plan..."
    walker.click("Teach a plan")
    walker.until_tells("Probe F1: 0 of 8 points.")
    walker.click("Other plan")
    walker.until_says("Choose a plan")
