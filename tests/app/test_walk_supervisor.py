"""Limits and a supervisor's password, as an operator and a supervisor meet them."""

from typing import TYPE_CHECKING

import pytest
from PySide6.QtCore import Qt
from tests.accepted_tip import accept_tip

from lightpen.record.library.supervision import read_supervision
from lightpen.record.swings.header import Names
from lightpen.swing.preparation import SourceChoice
from lightpen_app.work.settings import Settings, Station, StoredCamera, stored_group
from lightpen_extensions.measure.tasks.task import VerificationChoices

if TYPE_CHECKING:
    from tests.app.conftest import OpenWizard, Walker

STATION = "Hall 2"
STRICT = "0.0010"
CHOSEN = Station(
    Names("", "Ann", "LP-04", "T-10", "C-1", 10.0),
    camera=StoredCamera(SourceChoice()),
    extensions={
        "measure": stored_group(
            VerificationChoices(n_cone=5, n_cone_frames=3, n_frames=2)
        )
    },
)


@pytest.fixture
def known(settings: Settings, open_wizard: "OpenWizard") -> "Walker":
    """The program at a station that is known, with a tip in force."""
    settings.set_station(STATION, CHOSEN)
    settings.set_last(station=STATION)
    walker = open_wizard()
    walker.until(lambda: not walker.workbench.selection.preparation.missing_inputs())
    accept_tip(walker.workbench.folder, walker.workbench.selection.preparation)
    return walker


def sign(walker: "Walker", name: str, password: str) -> None:
    walker.click_into("Supervisor", name)
    walker.click_into("Supervisor password", password)
    walker.press(Qt.Key.Key_Return)


def lay_down_limits(walker: "Walker", password: str, limit: str) -> None:
    if walker.offers("Set up station..."):
        walker.click("Set up station...")
    walker.click("All limits...")
    walker.click_into(
        "Fixed point: std. deviation perpendicular to the line of sight", limit
    )
    sign(walker, "Eve", password)


@pytest.mark.slow
def test_a_wrong_password_lays_down_nothing_and_is_asked_for_again(
    known: "Walker",
) -> None:
    walker, folder = known, known.workbench.folder
    lay_down_limits(walker, "correct horse", STRICT)
    walker.until(lambda: walker.workbench.selection.supervision.is_guarded)
    assert read_supervision(folder).limits[STATION].verification.across == 0.001

    lay_down_limits(walker, "wrong horse", "1.0000")
    walker.until_tells("Wrong supervisor password.")
    assert read_supervision(folder).limits[STATION].verification.across == 0.001
    walker.type("correct horse")  # the password waits for it
    walker.press(Qt.Key.Key_Return)
    walker.until(lambda: walker.workbench.selection.limits.verification.across == 1.0)
