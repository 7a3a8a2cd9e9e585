"""Tests of what the steps Verify and Measure show of touches and values."""

import numpy as np
import pytest
from PySide6.QtGui import QImage
from pytestqt.qtbot import QtBot

from lightpen.model.coverage import Decision
from lightpen.model.rigid import Posture
from lightpen_app.look.signs import Sign
from lightpen_app.look.theme import Tone, colors_of
from lightpen_app_extensions.measure.check_list import (
    BandChart,
    CheckList,
    CheckRow,
    value_text,
)
from lightpen_app_extensions.measure.part_view import dial_of
from lightpen_extensions.measure.tasks.task import Band


def test_a_field_of_the_dial_is_full_that_was_touched_in() -> None:
    dial = dial_of(
        [Posture(0.0, 0.0, 0.0), Posture(0.25, 0.0, 0.0), Posture(0.25, 0.0, 0.0)], None
    )

    assert (dial.n_fields, dial.n_full) == (2, 2)
    assert dial.n_upright == 1


def columns_of(image: QImage, color: str) -> np.ndarray:
    """Columns in which pixels have exactly a colour."""
    wanted = int(color.removeprefix("#"), 16)
    rows = range(image.height())
    shown = [
        any(image.pixel(x, y) & 0xFFFFFF == wanted for y in rows)
        for x in range(image.width())
    ]
    return np.flatnonzero(shown)


@pytest.mark.parametrize(
    ("value", "decision", "is_beyond"),
    [(24.1, Decision.ACCEPTED, False), (24.4, Decision.REJECTED, True)],
)
def test_a_bar_ends_beyond_the_limit_only_if_the_value_is_beyond_it(
    qtbot: QtBot, value: float, decision: Decision, is_beyond: bool
) -> None:
    chart = BandChart()
    qtbot.addWidget(chart)
    chart.resize(800, 30)
    band = Band("hole", value, 0.01, 23.8, 24.2, 24.0, decision)
    chart.set_bands((band,))
    image, colors = chart.grab().toImage(), colors_of(chart.palette())

    tone = colors.good if decision is Decision.ACCEPTED else colors.bad
    bar = columns_of(image.copy(250, 0, 260, 30), tone)
    limits = columns_of(image.copy(250, 0, 260, 30), colors.edge)
    assert (bar.max() > limits.max()) == is_beyond
    assert chart.accessibleName() == f"hole {value_text(band)}"


@pytest.mark.parametrize("height", [41, 45, 49, 56])
def test_the_limits_below_the_last_bar_are_seen_whole(
    qtbot: QtBot, height: int
) -> None:
    chart = BandChart()
    qtbot.addWidget(chart)
    chart.set_bands((Band("hole", 24.1, 0.01, 23.8, 24.2, 24.0, Decision.ACCEPTED),))
    chart.resize(800, height)
    image = chart.grab().toImage()

    def is_blank(y: int) -> bool:
        return len({image.pixel(x, y) for x in range(image.width())}) == 1

    assert is_blank(0)
    assert is_blank(image.height() - 1)
    assert not is_blank(image.height() - 6)  # they are there


def test_a_value_has_the_decimals_of_its_uncertainty() -> None:
    band = Band("hole", 24.00312, 0.0517)

    assert value_text(band) == "24.003 \N{PLUS-MINUS SIGN} 0.052"


def test_the_list_says_value_and_verdict_and_keeps_its_place(qtbot: QtBot) -> None:
    checks = CheckList()
    qtbot.addWidget(checks)
    now = CheckRow("bore", "now", Sign.PLAY, Tone.ACTIVE)
    checks.set_rows((CheckRow("top"), now))
    checks.show_row(1)
    done = CheckRow("flatness top", "0.003", Sign.CHECK, Tone.GOOD, "OK")

    with qtbot.assertNotEmitted(checks.chosen):
        checks.set_rows((done, now, CheckRow("dome")))

    texts = [checks.item(i).text() for i in range(checks.count())]
    assert texts == ["flatness top: 0.003 OK", "bore: now", "dome"]
    assert checks.currentRow() == 1
    with qtbot.waitSignal(checks.chosen) as chosen:
        checks.setCurrentRow(2)
    assert chosen.args == [2]
