"""Tests of what the step Verify shows of touches."""

import math

import pytest
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from lightpen.model.posture import Posture
from lightpen.verification.tasks.circle import CIRCLE
from lightpen_app.look.languages import LanguageSwitch
from lightpen_app.steps.verify.findings import dial_of
from lightpen_app.steps.verify.ring_view import RingValue, RingView
from lightpen_app.steps.verify.task_form import SurfaceField, TaskForm


def test_what_is_covered_begins_behind_the_largest_gap() -> None:
    ring = RingValue(tuple(math.radians(a) for a in (350.0, 10.0, 100.0)))

    assert ring.start == pytest.approx(math.radians(350.0))


def test_a_ring_says_how_much_of_it_is_covered(qtbot: QtBot) -> None:
    view = RingView()
    qtbot.addWidget(view)
    view.set_value(RingValue((0.0, 1.0, 2.0), 114.6))

    assert view.accessibleName() == "Ring: 114 of 270 degrees, points: 3"


def test_a_ring_that_is_not_quite_covered_is_not_said_to_be(qtbot: QtBot) -> None:
    view = RingView()
    qtbot.addWidget(view)
    view.set_value(RingValue((0.0, 1.0, 2.0), 269.9))

    assert view.accessibleName() == "Ring: 269 of 270 degrees, points: 3"


def test_a_field_of_the_dial_is_full_that_was_touched_in() -> None:
    dial = dial_of(
        [Posture(0.0, 0.0, 0.0), Posture(0.25, 0.0, 0.0), Posture(0.25, 0.0, 0.0)], None
    )

    assert (dial.n_fields, dial.n_full) == (2, 2)
    assert dial.n_upright == 1


def test_a_strip_is_laid_out_alike_whatever_language_came_before(
    qtbot: QtBot, qapp: QApplication
) -> None:
    def opened() -> TaskForm:
        strip = TaskForm(CIRCLE)
        qtbot.addWidget(strip)
        strip.show()
        return strip

    def least_width(strip: TaskForm) -> int:
        (field,) = strip.findChildren(SurfaceField)
        return field.minimumSizeHint().width()

    strip = opened()
    in_english = least_width(strip)
    LanguageSwitch(qapp).set_language("zh_CN")
    qtbot.waitUntil(lambda: least_width(strip) < in_english)

    assert least_width(strip) == least_width(opened())
