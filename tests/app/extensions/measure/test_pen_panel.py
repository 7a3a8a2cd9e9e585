"""What is reported of the pen is of the pen that is chosen now."""

from dataclasses import replace
from typing import TYPE_CHECKING

from PySide6.QtCore import QCoreApplication, QThreadPool
from pytestqt.qtbot import QtBot

from lightpen_app.widgets.sign_label import SignLabel
from lightpen_app.work.workbench import Workbench
from lightpen_app_extensions.measure.pen_panel import PenPanel

if TYPE_CHECKING:
    pass


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
