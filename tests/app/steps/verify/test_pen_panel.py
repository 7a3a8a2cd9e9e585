"""The pen's health as the step Verify tells it."""

from dataclasses import replace

from PySide6.QtCore import QCoreApplication, QThreadPool
from pytestqt.qtbot import QtBot

from lightpen_app.steps.verify.pen_panel import PenPanel
from lightpen_app.widgets.sign_label import SignLabel
from lightpen_app.work.workbench import Workbench


def said(panel: PenPanel) -> list[str]:
    labels = panel.findChildren(SignLabel)
    texts = (each.value().text for each in labels if each.isVisible())
    return list(filter(None, texts))


def test_swings_are_said_to_be_read_only_as_long_as_they_are(
    qtbot: QtBot, workbench: Workbench
) -> None:
    panel = PenPanel(workbench)
    qtbot.addWidget(panel)
    panel.show()
    assert said(panel) == ["The swings of the pen are being read."]
    QThreadPool.globalInstance().waitForDone()
    QCoreApplication.processEvents()
    assert said(panel)[0].startswith("Two accepted swings")

    workbench.set_preparation(replace(workbench.preparation, pen_file=None))

    assert said(panel) == []
    panel.shut_down()
