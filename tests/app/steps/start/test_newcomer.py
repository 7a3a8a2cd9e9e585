"""Somebody who has never seen the program: explained, tried out, and guided."""

import time
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QApplication, QCheckBox, QFileDialog

from lightpen.cameras.source import FoundDevice, SourcePlace
from lightpen.cameras.sources import source_named
from lightpen.live.sources import SourceEnvironment
from lightpen.model.names import Origin
from lightpen.swing.preparation import SourceChoice
from lightpen_app.work.settings import Settings
from lightpen_extensions.simulator.simulator import SceneSimulator

if TYPE_CHECKING:
    from tests.app.conftest import OpenWizard


@pytest.mark.slow
def test_a_simulated_pen_is_at_the_swing_after_one_click(
    open_wizard: "OpenWizard", settings: Settings
) -> None:
    walker = open_wizard()

    walker.click("Try it with a simulated pen")

    # Nothing is missing that is only being read.
    reasons = set[str]()

    def is_swinging() -> bool:
        reasons.update(s.why_closed for s in walker.window.steps() if s.shows_reason)
        return walker.title() == "Swing"

    walker.until(is_swinging)
    assert reasons <= {
        "Enter the serial number of the pen.",
        "No image received from the camera yet.",
        "Swing the pen first.",
    }
    walker.click("Let the simulated operator swing")
    walker.until(lambda: walker.workbench.run.status.state is not None)
    assert walker.workbench.run.status.origin is Origin.SIMULATED
    assert settings.stations() == ()  # nobody wants it back at the next start
    walker.window.go_to(0)
    walker.click("Set up station...")
    walker.click("Other ways to begin")
    assert not walker.control("Try it with a simulated pen").isEnabled()


@pytest.mark.slow
def test_the_first_view_asks_only_how_to_begin(open_wizard: "OpenWizard") -> None:
    walker = open_wizard()

    walker.until_says("Choose how to begin.")
    assert not any(step.shows_reason for step in walker.window.steps())
    assert not walker.tells("SIMULATED")


@pytest.mark.slow
def test_at_the_first_start_the_trial_is_seen_in_the_smallest_window(
    open_wizard: "OpenWizard",
) -> None:
    walker = open_wizard()
    walker.window.resize(940, 500)

    def is_seen() -> bool:
        trial = walker.control("Try it with a simulated pen")
        return trial.visibleRegion().boundingRect() == trial.rect()

    walker.until(is_seen)


@pytest.mark.slow
def test_enter_goes_to_the_first_field_that_is_missing(
    open_wizard: "OpenWizard",
) -> None:
    walker = open_wizard()
    walker.click("Set up my station")
    walker.click("More")
    walker.tab_to("Station")
    walked = []
    for name in ("Hall 9", "LP-9"):
        walker.press(Qt.Key.Key_A, Qt.KeyboardModifier.ControlModifier)
        walker.type(name)
        walker.press(Qt.Key.Key_Return)
        focused = QApplication.focusWidget()
        assert focused is not None
        walked.append(focused.accessibleName())

    assert walked == ["Pen serial number", "Probe tip"]
    walker.type("T-9")
    walker.press(Qt.Key.Key_Return)
    walker.until_shows("Camera")


@pytest.mark.slow
def test_for_recorded_images_only_pen_and_tip_are_asked(
    open_wizard: "OpenWizard", tmp_path: Path
) -> None:
    walker = open_wizard()
    selection = walker.workbench.selection
    walker.until(lambda: bool(selection.preparation.names.station))
    walker.click("Calibrate from recorded images")
    (dialog,) = walker.window.findChildren(QFileDialog)
    dialog.fileSelected.emit(str(tmp_path))
    dialog.close()

    walker.until_says("Set up station")
    assert selection.preparation.source == SourceChoice("recorded", str(tmp_path))
    assert not walker.offers("Station")
    assert walker.offers("Probe tip")


@pytest.mark.slow
def test_a_station_is_set_up_by_pen_and_tip_and_simulates_nothing(
    open_wizard: "OpenWizard",
) -> None:
    walker = open_wizard()
    walker.until(lambda: bool(walker.workbench.selection.preparation.names.station))
    assert not walker.tells("SIMULATED")
    walker.click("Try it with a simulated pen")
    walker.until_shows("Swing")
    walker.window.go_to(0)
    walker.click("Set up station...")
    walker.click("Other ways to begin")
    walker.click("Set up my station")

    names = walker.workbench.selection.preparation.names
    assert (names.pen, names.tip, names.cone) == ("", "", "C-1")
    assert names.station != "Trial"
    assert not walker.tells("SIMULATED")
    boxes = [box.text() for box in walker.window.findChildren(QCheckBox)]
    assert "As in the LED file" in boxes  # without numbers of another pen
    walker.type("LP-9")
    walker.enter("Probe tip", "T-9")
    walker.press(Qt.Key.Key_Return)
    walker.until_shows("Camera")
    assert walker.tells("Choose your camera.")


@pytest.mark.slow
def test_a_real_station_is_at_its_first_live_image_after_four_entries(
    open_wizard: "OpenWizard", aravis: SourcePlace
) -> None:
    found = FoundDevice(aravis.name, f"Aravis simulator ({aravis.name})")
    source = source_named("aravis")
    assert source is not None
    cameras = ((source, found),)
    walker = open_wizard(
        SourceEnvironment(SceneSimulator(), found_cameras=lambda: cameras)
    )
    walker.until(lambda: bool(walker.workbench.selection.preparation.names.station))
    begun = time.monotonic()

    walker.click("Set up my station")
    walker.type("LP-9")
    walker.enter("Probe tip", "T-9")
    walker.press(Qt.Key.Key_Return)
    walker.until_shows("Camera")
    walker.until(lambda: walker.offers(found.label))
    walker.click(found.label)
    walker.until_says("Live")

    assert time.monotonic() - begun < 30
    chosen = walker.workbench.selection.preparation.source
    assert chosen == SourceChoice("aravis", aravis.name)
    assert not walker.tells("SIMULATED")
