"""Somebody who has never seen the program: explained, tried out, and guided."""

from typing import TYPE_CHECKING

import pytest
from PySide6.QtCore import QProcess, Qt
from PySide6.QtWidgets import QApplication, QLabel

from lightpen.model.origin import Origin
from lightpen_app.steps.start import newcomer_panel
from lightpen_app.steps.start.newcomer_panel import Introduction
from lightpen_app.widgets.pen_in_space import PenInSpace
from lightpen_app.work.settings import Settings

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
        "Enter the name of the station.",
        "No image received from the camera yet.",
        "Swing the pen first.",
    }
    walker.click("Let the simulated operator swing")
    walker.until(lambda: walker.workbench.run.status.state is not None)
    assert walker.workbench.run.status.origin is Origin.SIMULATED
    assert settings.stations() == ()  # nobody wants it back at the next start
    walker.window.go_to(0)
    walker.click("Set up station...")
    assert not walker.control("Try it with a simulated pen").isEnabled()


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
    walked = []
    for name in ("Hall 9", "Ann", "LP-9", "T-9"):
        walker.type(name)
        walker.press(Qt.Key.Key_Return)
        focused = QApplication.focusWidget()
        assert focused is not None
        walked.append(focused.accessibleName())

    assert walked == ["Operator", "Pen serial number", "Probe tip", "Cone"]
    walker.type("C-9")
    walker.press(Qt.Key.Key_Return)
    walker.until_shows("Camera")


@pytest.mark.slow
def test_the_introduction_shows_pen_and_cone_and_leads_to_the_trial(
    open_wizard: "OpenWizard",
) -> None:
    walker = open_wizard()
    walker.click("What is this?")
    (introduction,) = walker.window.findChildren(Introduction)

    pictures = introduction.findChildren(PenInSpace)
    reported = " ".join(label.text() for label in introduction.findChildren(QLabel))
    assert [each.value() is not None for each in pictures] == [True, True]
    assert all(
        step in reported for step in ("Start", "Camera", "LEDs", "Swing", "Review")
    )

    introduction.accept()

    walker.until_shows("Swing")


@pytest.mark.slow
def test_the_demo_is_played_in_a_window_of_its_own(
    open_wizard: "OpenWizard", monkeypatch: pytest.MonkeyPatch
) -> None:
    started: list[tuple[object, ...]] = []
    monkeypatch.setattr(QProcess, "startDetached", lambda *words: started.append(words))
    walker = open_wizard()

    walker.click("Play the demo")

    assert started == [newcomer_panel.DEMO]
