"""The operator's day: a tip in two or three keys, all tips at a glance."""

from dataclasses import replace
from typing import TYPE_CHECKING

import pytest
from PySide6.QtCore import Qt

from lightpen.model.limits import SwingLimits
from lightpen.record.swings.header import Names
from lightpen.swing.preparation import SourceChoice
from lightpen_app.steps.start.day_view import DayView
from lightpen_app.work.settings import Settings, Station, StoredCamera
from lightpen_extensions.simulator.hand import SimulatedOperator

if TYPE_CHECKING:
    from tests.app.conftest import OpenWizard, Walker

KNOWN = Station(
    Names("", "Ann", "LP-04", "T-10", "C-1", 10.0),
    camera=StoredCamera(SourceChoice()),
    limits=SwingLimits(max_uncertainty=0.02, min_images=20, max_images=150),
)


@pytest.fixture
def known(settings: Settings, open_wizard: "OpenWizard") -> "Walker":
    """The program at a station that was set up before."""
    settings.set_station("Hall 2", KNOWN)
    settings.set_last(station="Hall 2")
    return open_wizard()


@pytest.mark.slow
def test_a_tip_takes_three_keys_from_the_launch_and_the_next_one_two(
    known: "Walker",
) -> None:
    walker = known
    walker.until(lambda: walker.main_button().text().startswith("Swing "))
    assert walker.n_inputs == 0

    swing_and_accept(walker)
    assert walker.n_inputs <= 3

    n_before = walker.n_inputs
    walker.until(walker.main_button().isEnabled)
    assert walker.main_button().text() == "Swing tip T-10"
    swing_and_accept(walker)
    assert walker.n_inputs - n_before <= 2


def swing_and_accept(walker: "Walker") -> None:
    """Start a swing by Enter, see it in the review without a key, accept by Enter."""
    run, live = walker.workbench.run, walker.workbench.live
    walker.press(Qt.Key.Key_Return)
    walker.until_shows("Swing")
    walker.until(lambda: run.status.state is not None and run.status.result is None)
    operator = live.operator
    assert isinstance(operator, SimulatedOperator)
    operator.seat()
    live.set_following(True)
    walker.until(lambda: run.status.verdict is not None)
    live.set_following(False)
    operator.lean_towards(0.0, 0.0, 0.0)  # upright and still: to the review
    walker.until_shows("Review")
    walker.until(walker.main_button().isEnabled)
    walker.press(Qt.Key.Key_Return)
    walker.until(lambda: run.status.result is not None)


@pytest.mark.slow
def test_what_is_not_ready_is_amber_and_the_main_button_leads_there(
    known: "Walker",
) -> None:
    walker = known
    walker.until(lambda: walker.main_button().text().startswith("Swing "))
    selection = walker.workbench.selection
    selection.set_preparation(replace(selection.preparation, pen_file=None))

    walker.until(lambda: walker.main_button().text() == "Check the LEDs")
    assert walker.tells("Open the LED geometry file.")
    assert not walker.offers("Swing anyway")
    walker.press(Qt.Key.Key_Return)
    walker.until_shows("LEDs")


@pytest.mark.slow
def test_a_tip_is_found_by_a_part_of_its_name(known: "Walker") -> None:
    walker = known
    walker.until(lambda: walker.main_button().text().startswith("Swing "))
    view = walker.window.page().findChild(DayView)
    assert isinstance(view, DayView)
    assert [row.tip for row in view.rows()] == ["T-10"]

    walker.type("04")
    assert [row.tip for row in view.rows()] == ["T-10"]  # its pen
    assert walker.main_button().text() == "Swing tip T-10"
    assert walker.main_button().isEnabled()
    walker.type("x")
    assert view.rows() == ()
    assert not walker.main_button().isEnabled()
    assert walker.tells("No tip matches 04x. Press Enter, or clear the search.")


@pytest.mark.slow
def test_what_is_set_up_once_is_a_click_away(known: "Walker") -> None:
    walker = known
    walker.until(lambda: walker.main_button().text().startswith("Swing "))
    assert not walker.offers("Station")
    walker.click("Set up station...")
    assert walker.says("Set up station")
    assert walker.offers("Station")
    walker.click("Show the tips of this station")
    assert not walker.says("Set up station")
    assert walker.main_button().text().startswith("Swing ")
