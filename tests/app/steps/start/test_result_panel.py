"""What the step Start says of the tip in force."""

from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from benchmarks.small_records import small_record
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QLineEdit
from pytestqt.qtbot import QtBot

from lightpen.estimation.reports.verdict import Grade
from lightpen.model.limits import DueRule, StationLimits
from lightpen.record.library.supervision import PasswordVerifier, Signature, Supervision
from lightpen.record.results.results import Result
from lightpen.record.swings.header import Names
from lightpen_app.steps.start.result_panel import LastResultPanel
from lightpen_app.widgets.bars import WithdrawalBar
from lightpen_app.widgets.controls import PushButton
from lightpen_app.widgets.fields import SupervisorFields
from lightpen_app.work.workbench import Workbench

NOON = datetime(2026, 1, 2, 12, tzinfo=UTC)


@pytest.fixture
def panel(qtbot: QtBot, workbench: Workbench) -> Iterator[LastResultPanel]:
    panel = LastResultPanel(workbench)
    qtbot.addWidget(panel)
    yield panel
    panel.shut_down()


def test_where_there_is_a_password_revoking_asks_for_a_supervisor(
    panel: LastResultPanel, workbench: Workbench, qtbot: QtBot, tmp_path: Path
) -> None:
    guard = Supervision(PasswordVerifier("0" * 32, "0" * 64))
    workbench.selection.set_supervision(guard)
    panel.set_value(accepted(tmp_path))
    panel.show()
    revoke = next(
        each
        for each in panel.findChildren(PushButton)
        if each.text() == "Revoke acceptance..."
    )
    QTest.mouseClick(revoke, Qt.MouseButton.LeftButton)
    (bar,) = panel.findChildren(WithdrawalBar)
    assert bar.isVisible()

    name, password = bar.findChildren(SupervisorFields)[0].findChildren(QLineEdit)
    reason = next(
        each for each in bar.findChildren(QLineEdit) if each not in (name, password)
    )
    for field, text in ((reason, "Bent."), (name, "Eve"), (password, "correct horse")):
        QTest.keyClicks(field, text)
    with qtbot.waitSignal(bar.given) as blocker:
        QTest.keyClick(password, Qt.Key.Key_Return)
    assert blocker.args == ["Bent.", Signature("Eve", "correct horse")]


def accepted(folder: Path) -> Result:
    return Result(
        names=Names("Hall 2", "Ann", "LP-04", "T-10", "C-1", 10.0),
        accepted=NOON,
        grade=Grade.PASS,
        record=folder,
        images=(),
        calibration=small_record(
            {
                "tip_pen_mm": [1.0, 2.0, 3.0],
                "expanded_uncertainty_mm": [0.01, 0.01, 0.01],
            }
        ),
    )


def test_that_a_tip_is_too_old_is_said_by_the_rule_that_holds_now(
    panel: LastResultPanel, workbench: Workbench, tmp_path: Path
) -> None:
    panel._now = lambda: NOON + timedelta(days=40)
    panel.set_value(accepted(tmp_path))
    assert (
        "Calibration is older than 30 days. Calibrate before you measure."
        in panel.words()
    )

    limits = {"Hall 2": StationLimits(due=DueRule(60))}
    workbench.selection.set_supervision(Supervision(limits=limits))

    assert not any("older than" in words for words in panel.words())


@pytest.mark.parametrize(
    ("days", "age"),
    [
        *((0, "Today"), (1, "Yesterday"), (2, "2 days ago"), (730, "730 days ago")),
        (-400, "In the future"),
    ],
)
def test_the_age_is_reported_in_words(
    panel: LastResultPanel, tmp_path: Path, days: int, age: str
) -> None:
    panel._now = lambda: NOON + timedelta(days=days)
    panel.set_value(accepted(tmp_path))

    assert panel.words()[0] == age
    assert ("Check the clock" in panel.words()[-1]) is (days < 0)
