"""The settings of a camera: what it offers is shown, what is changed is asked for."""

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QLabel
from pytestqt.qtbot import QtBot
from tests.app.typed_numbers import type_number

from lightpen.cameras.protocol import (
    CameraCapabilities,
    CameraSettings,
    Range,
    Region,
    RegionLimits,
    Stats,
    TriggerMode,
)
from lightpen_app.look.theme import Tone
from lightpen_app.look.words import on_one_line
from lightpen_app.steps.camera.settings_panel import SettingField, SettingsPanel
from lightpen_app.widgets.controls import PushButton
from lightpen_app.widgets.fields import ChoiceField
from lightpen_app.widgets.state_banner import SignLabel

CAPS = CameraCapabilities(
    width=640,
    height=480,
    pixel_formats=("Mono8", "Mono12", "BayerRG8"),
    frame_rate=Range(0.5, 60),
    packet_size=Range(220, 16_000, 4),
    regions=RegionLimits(Range(8, 2448, 8), Range(8, 2048, 8), 4, 4),
    triggers=tuple(TriggerMode),
    has_link=True,
)
SETTINGS = CameraSettings(
    frame_rate=20.0,
    pixel_format="Mono8",
    region=Region(4, 8, 640, 480),
    trigger=TriggerMode.FREE,
    packet_size=1500,
)


@pytest.fixture
def panel(qtbot: QtBot) -> SettingsPanel:
    panel = SettingsPanel()
    qtbot.addWidget(panel)
    panel.set_camera(CAPS, SETTINGS)
    return panel


def field(panel: SettingsPanel, name: str) -> SettingField:
    fields = panel.findChildren(SettingField)
    return next(each for each in fields if each.accessibleName() == name)


def asked(
    qtbot: QtBot, panel: SettingsPanel, name: str, value: float
) -> CameraSettings:
    with qtbot.waitSignal(panel.settings_changed) as signal:
        type_number(field(panel, name), value)
    settings: CameraSettings = signal.args[0]
    return settings


def test_the_ranges_are_those_of_the_camera(panel: SettingsPanel) -> None:
    rate, width = field(panel, "Frame rate"), field(panel, "Region width")

    assert (*rate._limits, rate.value()) == (0.5, 60, 20)
    assert (*width._limits, width.value()) == (8, 2448, 640)
    assert field(panel, "Region from left")._limits[1] == 2448 - 640


def test_each_change_asks_for_nothing_else(qtbot: QtBot, panel: SettingsPanel) -> None:
    assert asked(qtbot, panel, "Frame rate", 30) == CameraSettings(frame_rate=30)
    assert asked(qtbot, panel, "Packet size", 9000) == CameraSettings(packet_size=9000)
    wider = asked(qtbot, panel, "Region width", 800)
    assert wider == CameraSettings(region=Region(4, 8, 800, 480))


def test_one_button_takes_the_whole_sensor(qtbot: QtBot, panel: SettingsPanel) -> None:
    (whole,) = panel.findChildren(PushButton)
    with qtbot.waitSignal(panel.settings_changed) as signal:
        whole.click()

    assert signal.args[0] == CameraSettings(region=Region(0, 0, 2448, 2048))


def test_a_colour_format_comes_with_the_hint_that_grey_is_better(
    panel: SettingsPanel,
) -> None:
    (hint,) = panel.findChildren(SignLabel)
    assert hint.value().text == ""
    panel.set_camera(CAPS, CameraSettings(pixel_format="BayerRG8"))

    assert "monochrome" in hint.value().text
    assert hint.value().tone is Tone.WARN


def test_formats_and_triggers_are_chosen_by_name(
    qtbot: QtBot, panel: SettingsPanel
) -> None:
    formats, triggers = panel.findChildren(ChoiceField)
    with qtbot.waitSignal(panel.settings_changed) as signal:
        formats.activated.emit(formats.findText("Mono12"))
    assert signal.args[0] == CameraSettings(pixel_format="Mono12")
    with qtbot.waitSignal(panel.settings_changed) as signal:
        triggers.activated.emit(triggers.findText("Software trigger"))
    assert signal.args[0] == CameraSettings(trigger=TriggerMode.SOFTWARE)


def test_what_became_of_the_images_is_counted(panel: SettingsPanel) -> None:
    panel.set_stats(Stats(delivered=812, incomplete=3, missed=2, skipped=1))

    counts = "".join(label.text() for label in panel.findChildren(QLabel))
    for words in ("Received: 812", "Incomplete: 3", "Lost: 2", "Not processed: 1"):
        assert on_one_line(words) in counts  # which breaks between them


def test_recorded_images_have_nothing_to_set(panel: SettingsPanel) -> None:
    panel.set_camera(
        CameraCapabilities(80, 60, ("Mono8",), n_images=4), CameraSettings()
    )

    assert panel.isHidden()


@pytest.mark.qt_log_ignore("^This plugin does not support ")
def test_a_list_that_is_open_stays_as_it_is_while_the_camera_offers_the_same(
    qtbot: QtBot, panel: SettingsPanel
) -> None:
    panel.show()
    formats = panel.findChildren(ChoiceField)[0]
    formats.showPopup()
    qtbot.waitUntil(formats.view().isVisible)
    QTest.keyClick(formats.view(), Qt.Key.Key_Down)

    panel.set_camera(CAPS, SETTINGS)
    with qtbot.waitSignal(panel.settings_changed) as signal:
        QTest.keyClick(formats.view(), Qt.Key.Key_Return)

    assert signal.args == [CameraSettings(pixel_format="Mono12")]
