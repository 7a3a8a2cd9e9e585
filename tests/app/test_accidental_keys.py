"""A key pressed twice, or too early, decides nothing: the real window, real delays."""

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from PySide6.QtCore import Qt

from lightpen.model.names import Origin
from lightpen.record.results.result_folder import RECORDS

if TYPE_CHECKING:
    from tests.app.conftest import OpenWizard, Walker

Key = Qt.Key


@pytest.fixture(autouse=True)
def real_delays(unhurried: None, monkeypatch: pytest.MonkeyPatch) -> None:
    """The delays that an operator has, far longer than this test presses keys."""
    monkeypatch.setattr("lightpen_app.shell.page_area.GUARD_MS", 3000)
    monkeypatch.setattr("lightpen_app.steps.review.page.READING_MS", 1000)


@pytest.fixture
def done(
    open_wizard: "OpenWizard",
    tmp_path: Path,
    swung: Callable[..., Path],
    rewrite_header: Callable[..., None],
) -> "Walker":
    """The step Swing with a swing that passes."""
    record = tmp_path / "data" / RECORDS / "swing"
    shutil.copytree(swung(), record)
    limits = {"max_uncertainty": 1.0, "min_images": 10, "min_per_field": 0}
    rewrite_header(record, limits=limits, origin=Origin.LIVE)
    walker = open_wizard()
    walker.workbench.run.open_requested.emit(record)
    walker.until_shows("Swing")  # which ends by itself: it has images enough
    walker.until_says("PASS")
    walker.until_shows("Swing")
    return walker


@pytest.mark.slow
def test_a_second_enter_accepts_no_tip_that_was_not_shown(done: "Walker") -> None:
    walker = done
    walker.until(lambda: pressed(walker, Key.Key_Return))
    assert walker.title() == "Review"

    walker.press(Key.Key_Return)
    walker.press(Key.Key_PageDown)

    assert walker.workbench.run.status.result is None
    walker.until_says("Read the result first.")
    assert not walker.main_button().isEnabled()
    walker.until(walker.main_button().isEnabled)
    walker.press(Key.Key_Return)  # still too early for what the button does by now
    assert walker.workbench.run.status.result is None
    assert walker.title() == "Review"


def pressed(walker: "Walker", key: Key) -> bool:
    """Press a key until the step is another one."""
    walker.press(key)
    return walker.title() != "Swing"
