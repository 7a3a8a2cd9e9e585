"""What the step Start says of the tip in force."""

from datetime import UTC, datetime, timedelta
from pathlib import Path

from benchmarks.small_records import small_record
from pytestqt.qtbot import QtBot

from lightpen.estimation.reports.verdict import Grade
from lightpen.model.limits import DueRule
from lightpen.record.results.results import Result
from lightpen.record.swings.names import Names
from lightpen_app.steps.start.result_panel import LastResult, LastResultPanel

NOON = datetime(2026, 1, 2, 12, tzinfo=UTC)


def test_that_a_tip_is_too_old_is_said_by_the_rule_that_holds_now(
    qtbot: QtBot, tmp_path: Path
) -> None:
    panel = LastResultPanel(lambda: NOON + timedelta(days=40))
    qtbot.addWidget(panel)
    result = Result(
        names=Names("Hall 2", "Ann", "LP-04", "T-10", "C-1", 10.0),
        accepted=NOON,
        grade=Grade.PASS,
        record=tmp_path,
        images=None,
        calibration=small_record(
            {
                "tip_pen_mm": [1.0, 2.0, 3.0],
                "expanded_uncertainty_mm": [0.01, 0.01, 0.01],
            }
        ),
    )
    panel.set_value(LastResult(result))
    assert (
        "Calibration is older than 30 days. Calibrate before you measure."
        in panel.words()
    )

    panel.set_rule(DueRule(60))

    assert not any("older than" in words for words in panel.words())
