"""What the step Start says of the tip in force."""

from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from benchmarks.small_records import small_record
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QLineEdit
from pytestqt.qtbot import QtBot

from lightpen.estimation.reports.verdict import Grade
from lightpen.model.limits import DueRule
from lightpen.record.library.supervision import Signature
from lightpen.record.results.results import Result
from lightpen.record.swings.header import Names
from lightpen_app.steps.start.result_panel import LastResult, LastResultPanel
from lightpen_app.widgets.bars import WithdrawalBar
from lightpen_app.widgets.controls import PushButton
from lightpen_app.widgets.fields import SupervisorFields

NOON = datetime(2026, 1, 2, 12, tzinfo=UTC)


def test_where_there_is_a_password_revoking_asks_for_a_supervisor(
    qtbot: QtBot, tmp_path: Path
) -> None:
    panel = LastResultPanel(lambda: NOON)
    qtbot.addWidget(panel)
    panel.set_value(LastResult(accepted(tmp_path)))
    panel.set_guarded(True)
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
    with qtbot.waitSignal(panel.take_back_requested) as blocker:
        QTest.keyClick(password, Qt.Key.Key_Return)
    assert blocker.args is not None
    assert blocker.args[1:] == ["Bent.", Signature("Eve", "correct horse")]


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
    qtbot: QtBot, tmp_path: Path
) -> None:
    panel = LastResultPanel(lambda: NOON + timedelta(days=40))
    qtbot.addWidget(panel)
    panel.set_value(LastResult(accepted(tmp_path)))
    assert (
        "Calibration is older than 30 days. Calibrate before you measure."
        in panel.words()
    )

    panel.set_rule(DueRule(60))

    assert not any("older than" in words for words in panel.words())


@pytest.mark.parametrize(
    ("days", "age"),
    [
        *((0, "Today"), (1, "Yesterday"), (2, "2 days ago"), (730, "730 days ago")),
        (-400, "In the future"),
    ],
)
def test_the_age_is_reported_in_words(
    qtbot: QtBot, tmp_path: Path, days: int, age: str
) -> None:
    panel = LastResultPanel(lambda: NOON + timedelta(days=days))
    qtbot.addWidget(panel)
    panel.set_value(LastResult(accepted(tmp_path)))

    assert panel.words()[0] == age
    assert ("Check the clock" in panel.words()[-1]) is (days < 0)
