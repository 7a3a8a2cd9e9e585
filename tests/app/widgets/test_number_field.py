"""A number in a field: units, limits, and what is refused."""

from collections.abc import Iterator

import pytest
from PySide6.QtCore import QEvent, QLocale, Qt
from PySide6.QtGui import QKeyEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QLabel, QMainWindow
from pytestqt.qtbot import QtBot

from lightpen_app.look.theme import Tone
from lightpen_app.widgets.number_field import NumberField, is_refusing

KEPT: list[QMainWindow] = []  # Python owns a window


def field_of(
    qtbot: QtBot,
    unit: str = "mm",
    limits: tuple[float, float] = (0.0005, 1.0),
    n_decimals: int = 4,
) -> NumberField:
    field = NumberField(unit, limits, n_decimals)
    around = QMainWindow()
    around.setCentralWidget(field)
    qtbot.addWidget(around)
    around.resize(400, 200)
    around.show()
    KEPT.append(around)
    return field


@pytest.fixture(autouse=True)
def kept() -> Iterator[None]:
    yield
    KEPT.clear()


def enter(field: NumberField, text: str) -> None:
    field.selectAll()
    for letter in text:  # QTest aborts at a Greek letter
        pressed = QKeyEvent(QEvent.Type.KeyPress, 0, Qt.KeyboardModifier(0), letter)
        QApplication.sendEvent(field, pressed)
    QTest.keyClick(field, Qt.Key.Key_Return)


def reason_shown(field: NumberField) -> str:
    label = field.window().findChild(QLabel, "refusal")
    return label.text() if label is not None and label.isVisible() else ""


def test_a_number_has_a_decimal_point_in_every_country(qtbot: QtBot) -> None:
    QLocale.setDefault(QLocale(QLocale.Language.German))
    field = field_of(qtbot, "mm", (0, 50), 3)

    field.set_value(2.5)

    assert field.text() == "2.500 mm"


@pytest.mark.parametrize(
    ("typed", "value"),
    [
        ("0.02", 0.02),
        ("0,02", 0.02),
        (".02", 0.02),
        ("2e-2", 0.02),
        ("0.02 mm", 0.02),
        ("20 um", 0.02),
        ("20µm", 0.02),
        ("20 μm", 0.02),
        ("0.02 in", 0.508),
        ("0.05 cm", 0.5),
    ],
)
def test_a_number_may_be_typed_with_a_unit(
    qtbot: QtBot, typed: str, value: float
) -> None:
    field = field_of(qtbot)

    with qtbot.waitSignal(field.value_changed) as changed:
        enter(field, typed)

    assert changed.args == [pytest.approx(value)]
    assert field.value() == pytest.approx(value)
    assert field.text() == f"{value:.4f} mm"
    assert field.reason() == ""


@pytest.mark.parametrize(
    ("typed", "reason"),
    [
        ("20", "Allowed: 0.0005 to 1 mm. For 20 μm enter 0.02."),
        ("xyz-5", "Enter a number, 0.0005 to 1 mm."),
        ("-5", "Allowed: 0.0005 to 1 mm."),
        ("", "Enter a number, 0.0005 to 1 mm."),
        ("0", "Allowed: 0.0005 to 1 mm."),
        ("nan", "Enter a number, 0.0005 to 1 mm."),
        ("1e99", "Allowed: 0.0005 to 1 mm."),
        ("0.02 s", "s is not a unit here; enter 0.0005 to 1 mm."),
        ("0.02 mm mm", "Enter a number, 0.0005 to 1 mm."),
        ("0.00055", "At most 4 decimals are possible."),
    ],
)
def test_what_is_not_allowed_is_refused_in_red_with_the_reason_and_stays(
    qtbot: QtBot, typed: str, reason: str
) -> None:
    field = field_of(qtbot)
    field.set_value(0.012)

    with qtbot.assertNotEmitted(field.value_changed):
        field.selectAll()
        QTest.keyClick(field, Qt.Key.Key_Delete)
        enter(field, typed)

    assert field.value() == 0.012
    assert field.text() == typed
    assert field.property("tone") == Tone.BAD.value
    assert field.reason() == reason
    assert reason_shown(field) == reason


def test_a_whole_number_takes_no_decimals(qtbot: QtBot) -> None:
    field = field_of(qtbot, "", (10, 2000), 0)
    enter(field, "300.5")

    assert field.reason() == "Enter a whole number."


def test_a_refused_number_is_corrected_and_the_reason_goes(qtbot: QtBot) -> None:
    field = field_of(qtbot)
    enter(field, "20")
    assert is_refusing(field.window())

    enter(field, "20 um")

    assert field.value() == 0.02
    assert field.property("tone") == Tone.PLAIN.value
    assert reason_shown(field) == ""
    assert not is_refusing(field.window())


def test_another_value_ends_a_refusal(qtbot: QtBot) -> None:
    field = field_of(qtbot)
    enter(field, "20")

    field.set_value(0.5)

    assert (field.text(), field.reason(), reason_shown(field)) == ("0.5000 mm", "", "")


def test_an_empty_field_is_the_least_number_if_that_has_a_name(qtbot: QtBot) -> None:
    field = field_of(qtbot, "mm", (0.0, 50.0), 3)
    field.set_empty_text("Not specified")
    assert (field.text(), field.placeholderText()) == ("", "Not specified")
    enter(field, "3")
    field.selectAll()
    QTest.keyClick(field, Qt.Key.Key_Delete)

    with qtbot.waitSignal(field.value_changed):
        QTest.keyClick(field, Qt.Key.Key_Return)

    assert field.value() == 0


def test_a_number_that_is_being_typed_stays_until_another_one_is_shown(
    qtbot: QtBot,
) -> None:
    field = field_of(qtbot, "mm", (1, 50), 3)
    field.set_value(2)
    field.activateWindow()
    field.setFocus()
    qtbot.waitUntil(field.hasFocus)
    field.selectAll()
    QTest.keyClicks(field, "1")

    field.set_value(2)
    field.set_unit("mm")
    QTest.keyClicks(field, "7")
    assert (field.text(), field.value()) == ("17", 17)
    field.set_value(3)

    assert field.text() == "3.000 mm"


def test_arrows_change_the_second_digit_within_the_limits(qtbot: QtBot) -> None:
    field = field_of(qtbot)
    field.set_value(0.02)
    steps: list[float] = []
    field.value_changed.connect(steps.append)

    for key in (Qt.Key.Key_Up, Qt.Key.Key_Down, Qt.Key.Key_Down):
        QTest.keyClick(field, key)
    field.set_value(0.9999)
    QTest.keyClick(field, Qt.Key.Key_Up)
    QTest.keyClick(field, Qt.Key.Key_Up)

    assert steps == pytest.approx([0.021, 0.02, 0.019, 1.0])
