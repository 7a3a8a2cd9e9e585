"""What is reported of the pen is of the pen that is chosen now."""

from dataclasses import replace
from pathlib import Path

from PySide6.QtCore import QCoreApplication, QThreadPool
from pytestqt.qtbot import QtBot
from tests.accepted_tip import accept_tip

from lightpen_app.look.phrases import GRADE_MARKS
from lightpen_app.look.signs import Sign
from lightpen_app.look.sounds import Sounds
from lightpen_app.widgets.state_banner import SignLabel
from lightpen_app.work.workbench import Workbench
from lightpen_app_extensions.measure.check_list import ROW, CheckList, CheckRow
from lightpen_app_extensions.measure.service import MeasureService
from lightpen_app_extensions.measure.verify_page import PenPanel, VerifyPage


def words(panel: PenPanel) -> str:
    labels = panel.findChildren(SignLabel)
    reported = (each.value().text for each in labels if each.isVisible())
    return " ".join(filter(None, reported))


def test_swings_are_said_to_be_read_only_as_long_as_they_are(
    qtbot: QtBot, workbench: Workbench
) -> None:
    panel = PenPanel(workbench)
    qtbot.addWidget(panel)
    panel.show()
    panel.read()
    assert words(panel) == "Reading the swings of the pen."
    QThreadPool.globalInstance().waitForDone()
    QCoreApplication.processEvents()
    assert words(panel).startswith("Two accepted swings")
    panel.resize(900, 400)  # the words stay with their sign, not in the middle
    verdict = panel.findChild(SignLabel)
    assert isinstance(verdict, SignLabel)
    assert verdict.height() <= verdict.heightForWidth(verdict.width())

    workbench.selection.set_preparation(
        replace(workbench.selection.preparation, pen_file=None)
    )

    assert not words(panel)
    panel.shut_down()


def test_the_pen_is_ticked_off_once_two_swings_of_it_are_read(
    qtbot: QtBot, workbench: Workbench
) -> None:
    page = VerifyPage(MeasureService(workbench), Sounds(Path()))
    qtbot.addWidget(page)
    panel = page.findChild(PenPanel)
    checks = page.findChild(CheckList)
    assert isinstance(panel, PenPanel)
    assert isinstance(checks, CheckList)

    def pen_row() -> CheckRow:
        row = checks.item(checks.count() - 1).data(ROW)
        assert isinstance(row, CheckRow)
        return row

    assert (pen_row().name, pen_row().sign) == ("Pen", Sign.RING)
    for seed in (3, 4):
        accept_tip(workbench.folder, workbench.selection.preparation, seed=seed)
    panel.read()
    qtbot.waitUntil(lambda: pen_row().value != "", timeout=60_000)

    assert panel.grade is not None
    assert (pen_row().sign, pen_row().tone) == GRADE_MARKS[panel.grade]
    page.shut_down()
