"""The way to the window in which pen and camera are found without files."""

from typing import TYPE_CHECKING

import pytest
from PySide6.QtCore import Qt, QThreadPool
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QPushButton
from pytestqt.qtbot import QtBot
from tests.simulated_stations import random_station

from lightpen_app.face import Service
from lightpen_app.steps.camera.intrinsics_panel import IntrinsicsPanel
from lightpen_app.steps.leds.file_panel import LedFilePanel
from lightpen_app.work.workbench import Workbench
from lightpen_app_extensions.discover.discovery_run import DiscoveryRun
from lightpen_app_extensions.discover.window import DiscoveryWindow

if TYPE_CHECKING:
    from tests.app.conftest import HoldBack


class Discovering(Service):
    discovers = True


def test_both_panels_without_a_file_ask_for_the_swing(
    qtbot: QtBot, workbench: Workbench
) -> None:
    services = (Discovering(workbench),)
    intrinsics = IntrinsicsPanel(workbench.selection, services)
    for panel in (intrinsics, LedFilePanel(workbench)):
        qtbot.addWidget(panel)
        button = next(
            each
            for each in panel.findChildren(QPushButton)
            if each.text() == "I have no such file..."
        )
        with qtbot.waitSignal(panel.discovery_requested, timeout=1000):
            button.click()


@pytest.mark.qt_log_ignore("^This plugin does not support ")
def test_a_click_on_stop_as_the_capture_ends_by_itself_starts_no_other(
    workbench: Workbench, qtbot: QtBot, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("lightpen_app_extensions.discover.discovery_run.N_MOST", 20)
    workbench.camera.open()
    qtbot.waitUntil(lambda: workbench.live.operator is not None)
    window = DiscoveryWindow(workbench)
    qtbot.addWidget(window)
    window.show()
    run = window.findChildren(DiscoveryRun)[0]
    start, stop = (
        each
        for each in window.findChildren(QPushButton)
        if each.text() in ("Start", "Stop")
    )
    assert (start.isEnabled(), stop.isEnabled()) == (True, False)
    QTest.mouseClick(start, Qt.MouseButton.LeftButton)
    qtbot.waitUntil(lambda: run.state.is_capturing)
    stop.setFocus()
    qtbot.waitUntil(lambda: not run.state.is_capturing)
    n_images = run.state.n_images

    QTest.mouseClick(stop, Qt.MouseButton.LeftButton)
    QTest.keyClick(window.focusWidget(), Qt.Key.Key_Space)
    qtbot.wait(200)

    assert not run.state.is_capturing
    assert run.state.n_images == n_images >= 20
    window.close()


@pytest.mark.slow
@pytest.mark.qt_log_ignore("^This plugin does not support ")
def test_a_computation_that_is_cancelled_leaves_what_was_found_before(
    workbench: Workbench,
    qtbot: QtBot,
    monkeypatch: pytest.MonkeyPatch,
    hold_back: "HoldBack",
) -> None:
    monkeypatch.setattr("lightpen_app_extensions.discover.discovery_run.N_MOST", 20)
    workbench.camera.open()
    qtbot.waitUntil(lambda: workbench.live.operator is not None)
    window = DiscoveryWindow(workbench)
    qtbot.addWidget(window)
    window.show()
    run = window.findChildren(DiscoveryRun)[0]
    run.start()
    qtbot.waitUntil(lambda: run.state.n_images >= 20 and not run.state.is_capturing)
    found = random_station(6, 60).discovered()
    run.adopt(found)
    before = run.state
    module = "lightpen_app_extensions.discover.discovery_run"
    may_begin = hold_back(f"{module}.discover")
    buttons = {each.text(): each for each in window.findChildren(QPushButton)}

    buttons["Find pen and camera"].click()
    qtbot.waitUntil(may_begin.is_reached.is_set)
    buttons["Cancel"].click()
    may_begin.set()
    QThreadPool.globalInstance().waitForDone()
    qtbot.wait(50)

    assert vars(run.state) == vars(before)
    assert buttons["Find pen and camera"].isEnabled()
    window.close()
