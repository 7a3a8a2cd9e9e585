"""What is assumed of a station can be seen and changed."""

from dataclasses import replace

import pytest
from PySide6.QtWidgets import QDialogButtonBox
from pytestqt.qtbot import QtBot
from tests.app.typed_numbers import type_number

from lightpen.model.limits import USUAL
from lightpen_app.steps.start.limits_dialog import AssumptionsDialog
from lightpen_app.widgets.number_field import NumberField


@pytest.fixture
def dialog(qtbot: QtBot) -> AssumptionsDialog:
    dialog = AssumptionsDialog()
    qtbot.addWidget(dialog)
    return dialog


def field(dialog: AssumptionsDialog, name: str) -> NumberField:
    fields = dialog.findChildren(NumberField)
    return next(each for each in fields if each.accessibleName().startswith(name))


def test_every_number_is_shown_in_its_own_unit(dialog: AssumptionsDialog) -> None:
    assert field(dialog, "Focal length").text() == "0.50 %"
    assert field(dialog, "Scale").text() == "10.0 ppm"
    assert field(dialog, "Form error").text() == "0.20 \N{MICRO SIGN}m"
    assert field(dialog, "Pen temperature").placeholderText() == "not measured"


def test_what_is_typed_is_assumed_at_once(
    qtbot: QtBot, dialog: AssumptionsDialog
) -> None:
    with qtbot.waitSignal(dialog.value_changed):
        type_number(field(dialog, "Form error"), 1.5)
    assert dialog.value() == replace(USUAL, form_error=0.0015)


def test_the_rest_of_the_camera_goes_with_its_focal_length(
    dialog: AssumptionsDialog,
) -> None:
    type_number(field(dialog, "Focal length"), 1.0)
    assert dialog.value().focal_length == pytest.approx(0.01)
    assert dialog.value().principal_point == pytest.approx(10.0)


def test_a_measured_temperature_has_an_uncertainty_of_its_own(
    dialog: AssumptionsDialog,
) -> None:
    assert not field(dialog, "Uncertainty").isEnabled()
    type_number(field(dialog, "Pen temperature"), 23.5)
    assert dialog.value().temperature_c == 23.5
    assert field(dialog, "Uncertainty").isEnabled()
    assert not field(dialog, "Temperature difference").isEnabled()


def test_the_usual_values_come_back(dialog: AssumptionsDialog) -> None:
    dialog.set_value(replace(USUAL, warmth=9.0, temperature_c=25.0))
    buttons = dialog.findChild(QDialogButtonBox)
    assert isinstance(buttons, QDialogButtonBox)
    buttons.button(QDialogButtonBox.StandardButton.RestoreDefaults).click()
    assert dialog.value() == USUAL
