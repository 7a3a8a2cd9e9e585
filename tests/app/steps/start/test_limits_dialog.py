"""Tests of the limits of a station, and of who may change them."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QDialogButtonBox, QLineEdit
from pytestqt.qtbot import QtBot
from tests.app.typed_numbers import type_number

from lightpen.model.limits import (
    LIMITS,
    DueRule,
    StationLimits,
    SwingLimits,
    VerificationLimits,
)
from lightpen.record.library.supervision import Signature, Supervision
from lightpen_app.steps.start.limits_dialog import LimitsDialog
from lightpen_app.widgets.bars import ReasonBar
from lightpen_app.widgets.fields import ChoiceField, SupervisorFields
from lightpen_app.widgets.number_field import NumberField
from lightpen_app.work.workbench import Workbench

TIGHT = StationLimits(
    *(SwingLimits(0.008, 80, 200), VerificationLimits(radius=0.005), DueRule(7))
)


@pytest.fixture
def dialog(qtbot: QtBot) -> LimitsDialog:
    dialog = LimitsDialog()
    qtbot.addWidget(dialog)
    dialog.show()
    return dialog


def field(dialog: LimitsDialog, name: str) -> NumberField:
    (found,) = (
        each
        for each in dialog.findChildren(NumberField)
        if each.accessibleName() == name
    )
    return found


def sign(dialog: LimitsDialog) -> None:
    for name, text in (("Supervisor", "Eve"), ("Supervisor password", "secret")):
        (edit,) = (
            each
            for each in dialog.findChildren(QLineEdit)
            if each.accessibleName() == name
        )
        edit.setText(text)


def test_the_limits_that_are_shown_are_those_that_were_given(
    dialog: LimitsDialog,
) -> None:
    dialog.set_value(TIGHT, is_guarded=True)

    assert dialog.value() == TIGHT


def test_every_limit_is_in_the_dialog(dialog: LimitsDialog) -> None:
    fields = [*dialog.findChildren(NumberField), *dialog.findChildren(ChoiceField)]
    shown = {each.accessibleName() for each in fields}

    assert shown == {str(limit.label) for limit in LIMITS}


def test_limits_are_laid_down_only_with_a_signature(
    dialog: LimitsDialog, qtbot: QtBot
) -> None:
    dialog.set_value(TIGHT, is_guarded=True)
    buttons = dialog.findChild(QDialogButtonBox)
    assert isinstance(buttons, QDialogButtonBox)
    save = buttons.button(QDialogButtonBox.StandardButton.Save)
    assert not save.isEnabled()
    type_number(field(dialog, "Length: error"), 0.01)
    sign(dialog)
    reported: list[Any] = []
    dialog.signed.connect(lambda *what: reported.append(what))
    save.click()

    wanted = replace(TIGHT.verification, length=0.01)
    expected = replace(TIGHT, verification=wanted), Signature("Eve", "secret"), ""
    assert reported == [expected]


def enter_the_signature(dialog: LimitsDialog) -> None:
    supervisor = dialog.findChild(SupervisorFields)
    assert isinstance(supervisor, SupervisorFields)
    supervisor.entered.emit()


def enter_the_new_password(dialog: LimitsDialog) -> None:
    (new,) = (
        each
        for each in dialog.findChildren(QLineEdit)
        if each.accessibleName().startswith("New password")
    )
    new.setFocus()
    QTest.keyClick(new, Qt.Key.Key_Return)


@pytest.mark.parametrize("enter", [enter_the_signature, enter_the_new_password])
def test_limits_are_laid_down_once_however_often_enter_is_pressed(
    dialog: LimitsDialog, enter: Callable[[LimitsDialog], None]
) -> None:
    dialog.set_value(TIGHT, is_guarded=True)
    sign(dialog)
    reported: list[Any] = []
    dialog.signed.connect(lambda *what: reported.append(what))
    for _ in range(2):
        enter(dialog)
    assert len(reported) == 1

    dialog.show_fault("The password is not that of the supervisors.")
    sign(dialog)
    enter(dialog)
    assert len(reported) == 2


def test_what_is_laid_down_counts_for_its_station_alone(workbench: Workbench) -> None:
    workbench.selection.set_supervision(Supervision(limits={"Hall 2": TIGHT}))
    assert workbench.selection.preparation.limits == TIGHT.swing
    assert workbench.selection.limits.verification == TIGHT.verification

    workbench.selection.choose_station("Hall 3")
    assert workbench.selection.preparation.limits == SwingLimits()
    assert workbench.selection.limits.verification == VerificationLimits()


def test_a_supervisor_is_asked_for_name_and_password(qtbot: QtBot) -> None:
    bar = ReasonBar()
    qtbot.addWidget(bar)
    reported: list[Any] = []
    bar.given.connect(lambda *what: reported.append(what))
    bar.ask(of_supervisor=True)
    reason, name, password = bar.findChildren(QLineEdit)
    reason.setText("It will do.")
    password.setText("secret")
    password.returnPressed.emit()
    assert reported == []
    name.setText("Eve")
    password.returnPressed.emit()

    assert reported == [("It will do.", Signature("Eve", "secret"))]
