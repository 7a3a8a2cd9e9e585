"""The choice of a camera: what is there, what was found, what has to be installed."""

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QComboBox
from pytestqt.qtbot import QtBot

from lightpen.cameras.source import FoundDevice
from lightpen.cameras.sources import SOURCES, source_named
from lightpen.messages import message
from lightpen.swing.preparation import NO_SOURCE, SourceChoice
from lightpen_app.look.languages import LanguageSwitch
from lightpen_app.look.theme import Tone
from lightpen_app.steps.camera.source_panel import DeviceField, SourcePanel
from lightpen_app.widgets.controls import PushButton
from lightpen_app.widgets.state_banner import SignLabel

FOUND = (
    FoundDevice("21877692", "Basler acA2440 (21877692)"),
    FoundDevice("LP02", "Aravis Fake (LP02)"),
)


@pytest.fixture
def panel(qtbot: QtBot) -> SourcePanel:
    panel = SourcePanel(SOURCES)
    qtbot.addWidget(panel)
    panel.show()
    return panel


def choose(panel: SourcePanel, key: str) -> None:
    """Choose a kind of source as a user does."""
    kinds = panel.findChildren(QComboBox)[0]
    index = [source.key for source in SOURCES].index(key)
    kinds.setCurrentIndex(index)
    kinds.activated.emit(index)


def reported(panel: SourcePanel) -> SignLabel:
    (label,) = (each for each in panel.findChildren(SignLabel) if each.isVisible())
    return label


def test_choosing_a_kind_of_camera_looks_for_cameras_and_takes_the_first(
    panel: SourcePanel, qtbot: QtBot
) -> None:
    with qtbot.waitSignal(panel.search_requested):
        choose(panel, "aravis")
    assert panel.value() == SourceChoice("aravis")
    panel.set_searching(True)
    assert "Searching for cameras" in reported(panel).value().text
    panel.set_searching(False)
    with qtbot.waitSignal(panel.value_changed):
        panel.set_found(FOUND)

    assert panel.value() == SourceChoice("aravis", "21877692")
    assert panel.findChildren(DeviceField)[0].currentText() == FOUND[0].label
    assert reported(panel).value().text == "Cameras found: 2"


def test_a_camera_that_was_chosen_stays_when_others_are_found(
    panel: SourcePanel,
) -> None:
    panel.set_value(SourceChoice("aravis", "LP02"))
    panel.set_found(FOUND)

    assert panel.value().place == "LP02"
    assert panel.findChildren(DeviceField)[0].currentText() == FOUND[1].label


def test_an_address_can_be_typed(panel: SourcePanel, qtbot: QtBot) -> None:
    choose(panel, "aravis")
    panel.set_found(())
    assert reported(panel).value().tone is Tone.WARN
    (field,) = panel.findChildren(DeviceField)
    edit = field.lineEdit()
    assert edit is not None
    QTest.keyClicks(edit, "169.254.1.7")
    with qtbot.waitSignal(panel.value_changed):
        QTest.keyClick(edit, Qt.Key.Key_Return)

    assert panel.value() == SourceChoice("aravis", "169.254.1.7")


def test_a_library_that_is_absent_is_a_line_and_no_search(
    panel: SourcePanel, qtbot: QtBot
) -> None:
    absent = message("genicam.absent", python="python")
    panel.set_absent({"genicam": absent})
    kinds = panel.findChildren(QComboBox)[0]
    names = [kinds.itemText(index) for index in range(kinds.count())]
    assert any(name.startswith("GenICam") and "not installed" in name for name in names)
    with qtbot.assertNotEmitted(panel.search_requested):
        choose(panel, "genicam")

    assert reported(panel).value().text == str(absent)
    assert not panel.findChildren(DeviceField)[0].isVisible()


def test_why_a_producer_does_not_load_is_shown(panel: SourcePanel) -> None:
    choose(panel, "genicam")
    panel.set_search_problem("vendor.cti does not load: wrong ELF class.")

    assert "wrong ELF class" in reported(panel).value().text
    assert reported(panel).value().tone is Tone.BAD


def test_what_a_search_came_to_is_reported_in_the_language_that_is_chosen(
    panel: SourcePanel, qapp: QApplication
) -> None:
    choose(panel, "aravis")
    panel.set_found(())
    english = reported(panel).value().text

    LanguageSwitch(qapp).set_language("zh_CN")
    QApplication.processEvents()

    assert english.startswith("No camera found.")
    assert "No camera" not in reported(panel).value().text


def test_before_a_source_is_chosen_the_cameras_that_are_there_are_offered(
    panel: SourcePanel, qtbot: QtBot
) -> None:
    assert panel.value() == NO_SOURCE
    assert panel.findChildren(QComboBox)[0].placeholderText() == "Choose your camera"
    panel.set_searching(True)
    assert "Searching for cameras" in reported(panel).value().text
    sources = [source_named("genicam"), source_named("aravis")]
    panel.set_offers(tuple(zip(sources, FOUND, strict=True)))  # type: ignore[arg-type]
    (button,) = (
        each for each in panel.findChildren(PushButton) if "21877692" in each.text()
    )
    with qtbot.waitSignal(panel.value_changed):
        button.click()

    assert panel.value() == SourceChoice("genicam", "21877692")
    assert not button.isVisible()
