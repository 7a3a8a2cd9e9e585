"""The way to the window in which pen and camera are found without files."""

from PySide6.QtWidgets import QPushButton
from pytestqt.qtbot import QtBot

from lightpen_app.steps.camera.intrinsics_panel import IntrinsicsPanel
from lightpen_app.steps.leds.file_panel import LedFilePanel


def test_both_panels_without_a_file_ask_for_the_swing(qtbot: QtBot) -> None:
    for panel in (IntrinsicsPanel(), LedFilePanel()):
        qtbot.addWidget(panel)
        button = next(
            each
            for each in panel.findChildren(QPushButton)
            if each.text() == "I have no such file..."
        )
        with qtbot.waitSignal(panel.discovery_requested, timeout=1000):
            button.click()
