"""What the window of main learns of verifications."""

from datetime import UTC, datetime

import pytest

from lightpen.archive.chains import Event, Kind
from lightpen.record.swings.header import Names
from lightpen_app.work.workbench import Workbench
from lightpen_app_extensions.measure.service import MeasureService


@pytest.mark.parametrize(
    ("task", "text"),
    [("fixed point", "Tip check"), ("part", "Part"), ("conclusion", "")],
)
def test_an_entry_is_named_by_its_task(
    workbench: Workbench, task: str, text: str
) -> None:
    event = Event(
        kind=Kind.VERIFICATION,
        at=datetime(2026, 1, 2, tzinfo=UTC),
        names=Names(),
        program="lightpen 1",
        settings={"verified": task},
    )

    assert MeasureService(workbench).event_text(event) == text


def test_a_swing_needs_no_drift_reference(workbench: Workbench) -> None:
    (item,) = MeasureService(workbench).readiness()

    assert item.message.text == "No drift reference"
    assert not item.is_amber
