"""Start: what is typed is remembered, and what there is already is shown."""

import shutil
import subprocess
from collections.abc import Callable, Iterator
from dataclasses import replace
from datetime import timedelta
from pathlib import Path
from typing import TypeAlias

import numpy as np
import pytest
from benchmarks.small_records import small_record
from msgspec import structs
from PySide6.QtCore import QPoint, QPointF, Qt, QThreadPool
from PySide6.QtGui import QWheelEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QApplication,
    QCheckBox,
    QComboBox,
    QLabel,
    QLineEdit,
    QPushButton,
    QWidget,
)
from pytestqt.qtbot import QtBot
from tests.app.blank_page import BlankPage
from tests.app.room import scrolled_sideways
from tests.app.typed_numbers import type_number
from tests.app.undressed import undressed
from tests.simulated_centers import simulate_centers

from lightpen.estimation.reports.verdict import Grade
from lightpen.live.sources import SourceEnvironment
from lightpen.local_time import local_now
from lightpen.model.limits import SwingLimits
from lightpen.model.names import Origin
from lightpen.record.results.result_folder import FolderArchive
from lightpen.record.results.results import Result
from lightpen.record.swings.header import Names
from lightpen.record.swings.reading import DISCARDED, open_record
from lightpen.record.swings.writing import RecordWriter
from lightpen.swing.preparation import NO_SOURCE, SourceChoice, SourceKind
from lightpen.swing.swing_recorder import record_header
from lightpen_app.look.theme import Tone
from lightpen_app.shell.main_window import MainWindow
from lightpen_app.shell.sidebar import subject_of
from lightpen_app.steps.start.day_view import DayView, TemperatureField
from lightpen_app.steps.start.interrupted_panel import InterruptedPanel, InterruptedRow
from lightpen_app.steps.start.page import StartPage
from lightpen_app.steps.start.result_panel import LastResultPanel
from lightpen_app.steps.start.setup_view import TYPING_PAUSE_MS
from lightpen_app.widgets.bars import QuestionBar
from lightpen_app.widgets.page import MainAction
from lightpen_app.widgets.state_banner import SignLabel
from lightpen_app.work.settings import Preferences, Settings
from lightpen_app.work.workbench import Workbench
from lightpen_extensions.simulator.swings import swing_poses

Key = Qt.Key
LEFT = Qt.MouseButton.LeftButton
BLACK = np.zeros((8, 8), np.uint8)
NAMES = Names("Hall 2", "Ann", "LP-04", "T-10", "C-1", 10.0)
NOON = local_now().replace(hour=12, minute=0)  # in a test no day ends


class Opened:
    """A Start page on the screen, driven as an operator does."""

    def __init__(self, qtbot: QtBot, workbench: Workbench) -> None:
        with undressed():
            self.page = StartPage(workbench)
        self.notices: list[str] = []
        self.statuses: list[str] = []
        self.steps: list[str] = []
        workbench.notifications.status_changed.connect(self.statuses.append)
        self.page.step_requested.connect(self.steps.append)
        workbench.notifications.raised.connect(
            lambda text, _: self.notices.append(text)
        )
        qtbot.addWidget(self.page)
        self.page.resize(1000, 640)
        self.page.show()
        self.page.entered()
        self.page.show_setup()
        self.settle()

    def field(self, name: str) -> QWidget:
        """Return the visible control of an accessible name."""
        (found,) = [
            widget
            for widget in self.page.findChildren(QWidget)
            if widget.accessibleName() == name and widget.isVisibleTo(self.page)
        ]
        return found

    def type_into(self, name: str, text: str, end: Key | None = Key.Key_Tab) -> None:
        """Replace the text of a field by keys, and leave it."""
        field = self.field(name)
        field.setFocus()
        edit = focused()
        QTest.keyClick(edit, Key.Key_A, Qt.KeyboardModifier.ControlModifier)
        QTest.keyClick(edit, Key.Key_Delete)
        QTest.keyClicks(edit, text)
        if end is not None:
            QTest.keyClick(edit, end)

    def text_of(self, name: str) -> str:
        field = self.field(name)
        match field:
            case QComboBox():
                return field.currentText()
            case QLineEdit():
                return field.text() or field.placeholderText()
        raise TypeError(name)

    def press(self, text: str) -> None:
        """Press the first visible button of a text."""
        button = next(
            button
            for button in self.page.findChildren(QPushButton)
            if button.text() == text and button.isVisibleTo(self.page)
        )
        QTest.mouseClick(button, LEFT)

    def settle(self) -> None:
        """Let what is looked up in the background be shown."""
        for _ in range(2):
            QApplication.processEvents()
            QThreadPool.globalInstance().waitForDone()
        QApplication.processEvents()

    def last(self) -> tuple[str, ...]:
        """Return what is said of the last calibration, but for its origin."""
        (panel,) = self.page.findChildren(LastResultPanel)
        return tuple(word for word in panel.words() if word != "SIMULATED")

    def answer(self, text: str) -> None:
        """Press a button of the question about an interrupted swing."""
        asked = self.page.findChildren(QuestionBar)[1]
        (button,) = (b for b in asked.findChildren(QPushButton) if b.text() == text)
        button.click()

    def rows(self) -> tuple[InterruptedRow, ...]:
        (panel,) = self.page.findChildren(InterruptedPanel)
        rows = panel.findChildren(InterruptedRow)
        assert panel.isVisibleTo(self.page) is bool(rows)
        return tuple(rows)

    def buttons(self) -> list[str]:
        """Return what can be pressed of the swings and below."""
        return [
            button.text()
            for button in self.page.findChildren(QPushButton)
            if button.isVisibleTo(self.page)
            and button.text() in ("Resume", "Discard", "Search again")
        ]

    @property
    def why_not(self) -> str:
        return self.page.main_action().why_not


def focused() -> QWidget:
    widget = QApplication.focusWidget()
    assert widget is not None
    return widget


Show: TypeAlias = Callable[[Workbench], Opened]


@pytest.fixture(scope="module")
def around(around: SourceEnvironment) -> SourceEnvironment:
    """Return what is around everywhere, always at the same moment."""
    return replace(around, now=lambda: NOON)


@pytest.fixture
def fresh(settings: Settings, tmp_path: Path) -> Iterator[Workbench]:
    """A workbench on which nothing was ever chosen."""
    workbench = Workbench(settings, tmp_path / "data")
    yield workbench
    workbench.shut_down()


@pytest.fixture
def show(qtbot: QtBot) -> Iterator[Show]:
    pages: list[StartPage] = []

    def opened(workbench: Workbench) -> Opened:
        result = Opened(qtbot, workbench)
        pages.append(result.page)
        return result

    yield opened
    for page in pages:
        page.shut_down()
    QThreadPool.globalInstance().waitForDone()


@pytest.fixture
def start(show: Show, workbench: Workbench) -> Opened:
    return show(workbench)


def accepted(
    workbench: Workbench,
    age: timedelta,
    pen: str | None = None,
    tip: str | None = None,
    grade: Grade = Grade.PASS,
    reason: str = "",
    ball: float | None = None,
) -> None:
    """Put a tip in force that was accepted some time ago."""
    named = workbench.selection.preparation.names
    names = replace(named, pen=pen or named.pen, tip=tip or named.tip)
    result = Result(
        names=replace(names, ball_diameter=ball or named.ball_diameter),
        accepted=NOON - age,
        grade=grade,
        record=workbench.run.records_folder / "elsewhere",
        images=(),
        calibration=small_record(
            {
                "tip_pen_mm": [-1.31823, -90.40951, -23.85483],
                "expanded_uncertainty_mm": [0.0031, 0.0121, 0.0998],
                "cone_cam_mm": [0.0, 0.0, 1000.0],
                "covariance": np.diag(6 * [0.001**2]).tolist(),
                "nominal_tip_mm": [-1.3, -90.4, -23.9],
            }
        ),
        origin=workbench.selection.preparation.origin,
        reason=reason,
    )
    workbench.run.archive.store(result)


def interrupted(
    workbench: Workbench,
    name: str,
    hours_ago: float = 1.0,
    n_images: int = 12,
    names: Names | None = None,
) -> Path:
    """Leave a swing without a verdict on the disk."""
    now = workbench.selection.preparation
    given = replace(now, names=names or now.names)
    created = NOON - timedelta(hours=hours_ago)
    setup, rng = given.swing_setup(), np.random.default_rng(5)
    swing = swing_poses(n_images, rng)
    pixels = simulate_centers(
        setup.camera, setup.pen, swing.rotations, swing.translations, 0.05, rng
    )
    folder = workbench.run.records_folder / name
    header = structs.replace(record_header(given), created=created)
    with RecordWriter.create(folder, header) as writer:
        for index in range(n_images):
            pose = swing.rotations[index], swing.translations[index]
            writer.append(BLACK, pixels[index], *pose, 0.05 * index)
    return folder


# Names


def test_at_first_each_missing_name_is_asked_for_in_turn(
    show: Show, fresh: Workbench
) -> None:
    start = show(fresh)
    asked = []
    for name in ("Station", "Operator", "Pen serial number", "Probe tip", "Cone"):
        asked.append(start.why_not)
        assert not start.page.is_complete()
        start.type_into(name, "A-1")

    assert asked == [
        "Enter the name of the station.",
        "Enter the name of the operator.",
        "Enter the serial number of the pen.",
        "Enter the name of the probe tip.",
        "Enter the name of the cone.",
    ]
    assert start.page.is_complete()
    assert start.page.main_action() == MainAction("Continue to the camera")


def test_the_last_name_counts_before_its_field_is_left(start: Opened) -> None:
    """Else the main button would stay grey, and could not be pressed."""
    start.type_into("Cone", "", end=None)
    assert start.why_not

    QTest.keyClicks(start.field("Cone"), "C")

    assert start.why_not == ""


def test_what_is_typed_is_taken_over_by_itself(
    start: Opened, workbench: Workbench, qtbot: QtBot
) -> None:
    start.type_into("Operator", " Bea ", end=None)

    qtbot.wait_until(lambda: workbench.selection.preparation.names.operator == "Bea")

    assert start.text_of("Operator") == " Bea "  # more may be typed


def test_what_is_typed_is_taken_over_when_the_page_is_left(
    start: Opened, workbench: Workbench
) -> None:
    start.type_into("Operator", "Bea", end=None)
    start.type_into("Ball diameter", "3.0005", end=None)

    start.page.left()

    assert workbench.selection.preparation.names.operator == "Bea"
    assert workbench.selection.preparation.names.ball_diameter == 3.0005


def test_a_known_tip_brings_its_ball_and_nominal_centre(
    start: Opened, workbench: Workbench, qtbot: QtBot
) -> None:
    accepted(workbench, timedelta(3), tip="T-99", ball=5.0)
    start.type_into("Probe tip", "T-99")

    qtbot.waitUntil(lambda: workbench.selection.preparation.names.ball_diameter == 5.0)
    now = workbench.selection.preparation
    assert now.names.tip == start.text_of("Probe tip") == "T-99"
    assert now.nominal_tip is not None
    assert now.nominal_tip.tolist() == [-1.3, -90.4, -23.9]


def test_a_tip_has_its_ball_again_after_another_was_chosen_from_the_list(
    start: Opened, workbench: Workbench, qtbot: QtBot
) -> None:
    accepted(workbench, timedelta(3), tip="T-99", ball=5.0)
    start.type_into("Probe tip", "T-98")
    view = start.page.findChild(DayView)
    assert view is not None
    pen = workbench.selection.preparation.names.pen

    view._choose(pen, "T-99")

    qtbot.waitUntil(lambda: workbench.selection.preparation.names.ball_diameter == 5.0)
    assert workbench.selection.preparation.names.tip == "T-99"


@pytest.mark.parametrize("pause_ms", [0, 2 * TYPING_PAUSE_MS])
@pytest.mark.parametrize("ball", ["10", "4.5"])  # as of the tip before, and another
@pytest.mark.parametrize("order", ["ball first", "tip first", "tip in parts"])
def test_a_ball_that_is_typed_with_another_tip_stays(
    start: Opened,
    workbench: Workbench,
    qtbot: QtBot,
    order: str,
    ball: str,
    pause_ms: int,
) -> None:
    accepted(workbench, timedelta(3), tip="T-9", ball=5.0)
    assert workbench.selection.preparation.names.ball_diameter == 10.0
    typed: dict[str, tuple[str, ...]] = {
        "Ball diameter": (ball,),
        "Probe tip": ("T-98",),
    }
    if order == "tip in parts":  # the first part is the name of another tip
        typed["Probe tip"] = ("T-9", "8")
    for name in sorted(typed, reverse=order == "tip first"):
        start.type_into(name, "", end=None)
        for part in typed[name]:
            QTest.keyClicks(focused(), part)
            qtbot.wait(pause_ms)
        QTest.keyClick(focused(), Key.Key_Tab)
        start.settle()

    assert workbench.selection.preparation.names.ball_diameter == float(ball)
    assert start.text_of("Ball diameter") == f"{float(ball):.4f} mm"
    start.page.left()
    start.type_into("Probe tip", "T-97")
    assert start.text_of("Ball diameter") == "Not specified"


def test_long_names_widen_no_field(show: Show, workbench: Workbench) -> None:
    start = show(workbench)
    for name in ("Station", "Operator", "Pen serial number", "Probe tip", "Cone"):
        start.type_into(name, 300 * "W")

    page = show(workbench).page
    page.resize(640, 460)  # as in a window of 800 x 600
    QApplication.processEvents()

    assert scrolled_sideways(page) == ()


# Stations


@pytest.mark.qt_log_ignore(
    "^This plugin does not support (raise|grabbing)", extend=True
)
def test_a_known_station_brings_back_all_that_was_chosen_there(
    start: Opened, workbench: Workbench, settings: Settings
) -> None:
    start.type_into("Station", "Hall 3")
    start.type_into("Operator", "Bea")
    start.type_into("Max. images", "99")
    combo = start.field("Station")
    assert isinstance(combo, QComboBox)
    assert [combo.itemText(i) for i in range(combo.count())] == ["Hall 2", "Hall 3"]

    combo.setFocus()
    QTest.keyClick(combo, Key.Key_Down)
    popup = combo.view()
    assert popup.isVisible()
    popup.setCurrentIndex(combo.model().index(0, 0))
    QTest.keyClick(popup, Key.Key_Return)

    assert start.text_of("Station") == "Hall 2"
    assert start.text_of("Operator") == "Ann"
    assert start.text_of("Max. images") == "300"
    assert workbench.selection.preparation.names.operator == "Ann"
    assert settings.last().station == "Hall 2"


def test_a_new_station_takes_over_the_present_choices(
    start: Opened, workbench: Workbench, settings: Settings
) -> None:
    before = workbench.selection.preparation

    start.type_into("Station", "Hall 3")

    assert workbench.selection.preparation.names == replace(
        before.names, station="Hall 3"
    )
    assert workbench.selection.preparation.limits is before.limits
    assert workbench.selection.preparation.source == NO_SOURCE  # it simulated
    assert workbench.selection.stations() == ("Hall 2", "Hall 3")
    assert settings.await_saved(120.0)
    assert Settings(settings.file).last().station == "Hall 3"


def test_a_station_is_not_made_of_each_letter_that_is_typed(
    start: Opened, workbench: Workbench, qtbot: QtBot
) -> None:
    start.type_into("Station", "Hall 34", end=None)
    start.type_into("Operator", "Bea")

    assert workbench.selection.stations() == ("Hall 2", "Hall 34")


def test_the_start_of_a_known_name_is_a_name_of_its_own(
    start: Opened, workbench: Workbench
) -> None:
    start.type_into("Station", "Hall")

    assert workbench.selection.preparation.names.station == "Hall"


def test_a_station_that_was_emptied_is_asked_for_and_keeps_the_rest(
    start: Opened, workbench: Workbench
) -> None:
    start.type_into("Station", "")

    assert start.why_not == "Enter the name of the station."
    assert start.text_of("Operator") == "Ann"
    assert workbench.selection.stations() == ("Hall 2",)


def test_what_was_typed_before_stays_with_the_station_before(
    start: Opened, workbench: Workbench, settings: Settings
) -> None:
    station = settings.station("Hall 2")
    settings.set_station(
        "Hall 3", replace(station, names=replace(station.names, operator="Cy"))
    )
    start.type_into("Operator", "Bea", end=None)
    start.type_into("Station", "Hall 3")

    assert settings.station("Hall 2").names.operator == "Bea"
    assert start.text_of("Operator") == "Cy"


@pytest.mark.parametrize(
    "name",
    ["Station", "Ball diameter", "Max. images", "Max. expanded uncertainty U (k = 2)"],
)
def test_the_wheel_does_not_change_a_field_that_scrolls_by(
    start: Opened, workbench: Workbench, name: str
) -> None:
    before = workbench.selection.preparation
    start.field("Operator").setFocus()
    field = start.field(name)
    center = QPointF(field.rect().center())
    event = QWheelEvent(
        center, QPointF(field.mapToGlobal(field.rect().center())),
        QPointF(0, -120).toPoint(), QPointF(0, -120).toPoint(),
        Qt.MouseButton.NoButton, Qt.KeyboardModifier.NoModifier,
        Qt.ScrollPhase.NoScrollPhase, False,
    )  # fmt: skip

    QApplication.sendEvent(field, event)

    assert workbench.selection.preparation is before


# Numbers


def test_the_nominal_centre_is_that_of_the_led_file_unless_another_is_typed(
    start: Opened, workbench: Workbench
) -> None:
    (box,) = start.page.findChildren(QCheckBox)
    assert box.text() == "As in the LED file: 0.000  -90.000  -25.000 mm"
    assert workbench.selection.preparation.nominal_tip is None

    QTest.keyClick(box, Key.Key_Space)
    assert start.text_of("Nominal tip centre, y") == "-90.0000 mm"
    start.type_into("Nominal tip centre, x", "-1,25")
    start.type_into("Nominal tip centre, z", "-24.5")

    assert workbench.selection.preparation.nominal_tip is not None
    np.testing.assert_array_equal(
        workbench.selection.preparation.nominal_tip, [-1.25, -90, -24.5]
    )
    QTest.keyClick(box, Key.Key_Space)
    assert workbench.selection.preparation.nominal_tip is None


def test_without_an_led_file_no_centre_is_reported(
    show: Show, fresh: Workbench
) -> None:
    start = show(fresh)
    (box,) = start.page.findChildren(QCheckBox)
    assert box.text() == "As in the LED file"

    QTest.keyClick(box, Key.Key_Space)

    assert start.text_of("Nominal tip centre, x") == "0.0000 mm"


def test_the_least_and_the_most_images_do_not_move_each_other(
    start: Opened, workbench: Workbench
) -> None:
    start.type_into("Min. images", "80")
    start.type_into("Max. images", "100")
    assert workbench.selection.preparation.limits == SwingLimits(
        min_images=80, max_images=100
    )

    for name, text in (("Min. images", "99999"), ("Max. images", "20")):
        before = start.text_of("Min. images"), start.text_of("Max. images")
        start.type_into(name, text)
        after = start.text_of("Min. images"), start.text_of("Max. images")
        assert sum(one != other for one, other in zip(before, after, strict=True)) <= 1

    limits = workbench.selection.preparation.limits
    assert limits.min_images <= limits.max_images


def test_limits_that_make_no_sense_cannot_be_entered(
    start: Opened, workbench: Workbench
) -> None:
    start.type_into("Max. expanded uncertainty U (k = 2)", "0")
    start.type_into("Min. images", "0")

    assert workbench.selection.preparation.limits.max_uncertainty >= 0.0001
    assert workbench.selection.preparation.limits.min_images >= 10


# The last result


def test_a_pen_and_tip_that_were_never_calibrated_have_none_yet(start: Opened) -> None:
    assert start.last() == (
        "No result yet",
        "Accepted practice results are stored apart from real pens.",
    )


def test_the_tip_in_force_is_shown_with_age_verdict_and_uncertainty(
    show: Show, workbench: Workbench
) -> None:
    accepted(workbench, timedelta(days=12))

    age, verdict, when, *table = show(workbench).last()

    assert (age, verdict) == ("12 days ago", "PASS")
    assert when.endswith("  \u00b7  Ann")
    assert table == ["x -1.3182 0.0031", "y -90.4095 0.0121", "z -23.8548 0.0998"]


def test_a_tip_that_was_to_be_checked_stays_amber_with_its_reason(
    show: Show, workbench: Workbench
) -> None:
    accepted(workbench, timedelta(days=1), grade=Grade.CHECK, reason="New ball.")
    start = show(workbench)

    assert start.last()[1] == "CHECK"
    assert start.last()[-1] == "Accepted. Reason: New ball."
    tones = {
        each.value().text: each.value().tone
        for each in start.page.findChildren(SignLabel)
    }
    assert tones["CHECK"] is tones["Accepted. Reason: New ball."] is Tone.WARN


def test_the_last_acceptance_is_taken_back_here_too(
    show: Show, workbench: Workbench, qtbot: QtBot
) -> None:
    accepted(workbench, timedelta(days=9))
    accepted(workbench, timedelta(days=1))
    start = show(workbench)
    start.page.show_day()
    assert start.last()[0] == "Yesterday"

    start.press("Revoke acceptance...")
    QTest.keyClicks(focused(), "Wrong pen.")
    start.press("Revoke acceptance")
    qtbot.waitUntil(lambda: start.last()[0] == "9 days ago")
    assert len(list(workbench.folder.rglob("results/*.json"))) == 3


def test_another_pen_or_tip_shows_its_own_result(
    start: Opened, workbench: Workbench
) -> None:
    accepted(workbench, timedelta(days=5), pen="LP-05")
    accepted(workbench, timedelta(days=7), tip="T-3")

    start.type_into("Pen serial number", "LP-05")
    start.settle()
    assert start.last()[0] == "5 days ago"

    start.type_into("Pen serial number", "LP-04")
    start.type_into("Probe tip", "T-3")
    start.settle()
    assert start.last()[0] == "7 days ago"

    start.type_into("Probe tip", "")
    start.settle()
    assert start.last() == ("Select a pen and a tip to see the last calibration.",)


def test_a_result_accepted_meanwhile_is_shown_on_return(
    start: Opened, workbench: Workbench
) -> None:
    start.page.left()
    accepted(workbench, timedelta(0))

    start.page.entered()
    start.settle()

    assert start.last()[0] == "Today"


def test_a_damaged_result_is_reported_where_the_result_would_be(
    show: Show, workbench: Workbench
) -> None:
    accepted(workbench, timedelta(days=12))
    (file,) = workbench.folder.rglob("results/*.json")
    file.write_text("{")

    (sentence,) = show(workbench).last()

    assert sentence.startswith(f"The file {file} was changed before it was entered")


# Interrupted swings


def test_the_page_is_there_before_the_swings_are_looked_for(
    qtbot: QtBot, workbench: Workbench
) -> None:
    interrupted(workbench, "a")
    page = StartPage(workbench)
    qtbot.addWidget(page)
    page.entered()
    QThreadPool.globalInstance().waitForDone()
    QApplication.processEvents()
    (panel,) = page.findChildren(InterruptedPanel)
    assert panel.findChildren(InterruptedRow) == []

    page.show()

    qtbot.wait_until(lambda: len(panel.findChildren(InterruptedRow)) == 1)
    page.shut_down()


@pytest.mark.slow
def test_a_swing_goes_on_with_its_images_at_the_step_swing(
    show: Show, workbench: Workbench, qtbot: QtBot
) -> None:
    names = replace(NAMES, pen="LP-05", operator="Bea")
    folder = interrupted(workbench, "a", names=names)
    workbench.camera.open()
    start = show(workbench)

    start.press("Resume")
    qtbot.wait_until(lambda: start.steps == ["swing"])

    assert workbench.run.status.record_folder == folder
    assert workbench.run.status.state is not None
    assert workbench.run.status.state.n_kept == 12
    assert (
        workbench.run.status.names.pen
        == workbench.selection.preparation.names.pen
        == "LP-05"
    )
    assert start.text_of("Operator") == "Bea"
    subject = subject_of(
        *(workbench.run.status, workbench.selection.preparation),
        workbench.library.statuses,
    )
    assert subject.names.pen == "LP-05"
    assert subject.origin is Origin.SIMULATED
    assert start.notices == []


def test_a_swing_of_another_station_goes_on_there(
    show: Show, workbench: Workbench, settings: Settings, qtbot: QtBot
) -> None:
    there = replace(settings.station("Hall 2"), limits=SwingLimits(max_images=123))
    settings.set_station("Hall 3", there)
    interrupted(workbench, "a", names=replace(NAMES, station="Hall 3"))
    workbench.camera.open()
    start = show(workbench)

    start.press("Resume")
    qtbot.wait_until(lambda: start.steps == ["swing"])

    assert start.text_of("Station") == "Hall 3"
    assert workbench.selection.preparation.limits.max_images == 123


def test_a_closed_camera_is_opened_for_the_swing(
    show: Show, workbench: Workbench, qtbot: QtBot
) -> None:
    interrupted(workbench, "a")
    start = show(workbench)
    assert not workbench.live.is_open

    start.press("Resume")
    qtbot.wait_until(lambda: start.steps == ["swing"])

    assert workbench.live.is_open


@pytest.mark.parametrize("is_recorded", [False, True])
def test_a_swing_goes_on_with_its_own_source(
    show: Show, workbench: Workbench, qtbot: QtBot, tmp_path: Path, is_recorded: bool
) -> None:
    simulated = workbench.selection.preparation
    recorded = SourceChoice(SourceKind.RECORDED, str(tmp_path / "monday"))
    (tmp_path / "monday").mkdir()
    chosen = [simulated, replace(simulated, source=recorded)]
    workbench.selection.set_preparation(chosen[is_recorded])
    interrupted(workbench, "a")
    workbench.selection.set_preparation(chosen[not is_recorded])
    workbench.camera.open()
    start = show(workbench)

    start.press("Resume")
    qtbot.wait_until(lambda: bool(start.steps))

    assert start.steps == ["swing"]
    assert workbench.selection.preparation.source == chosen[is_recorded].source
    assert workbench.run.status.state is not None


@pytest.mark.slow
def test_a_swing_of_two_cameras_takes_up_the_second_again(
    show: Show, workbench: Workbench, qtbot: QtBot, swung: Callable[..., Path]
) -> None:
    shutil.copytree(swung(14, by_two=True), workbench.run.records_folder / "two")
    workbench.camera.open()
    assert workbench.live.n_cameras == 1
    start = show(workbench)

    start.press("Resume")
    qtbot.wait_until(lambda: bool(start.steps or start.notices))

    assert start.notices == []
    assert start.steps == ["swing"]
    assert workbench.live.n_cameras == 2
    simulated = SourceChoice(SourceKind.SIMULATED)
    now = workbench.selection.preparation
    assert now.sources == (simulated, simulated)
    assert now.rig_file is not None
    assert now.rig_file.rig.n_cameras == 2


def test_a_swing_does_not_go_on_with_images_of_another_size(
    show: Show, workbench: Workbench, qtbot: QtBot
) -> None:
    interrupted(workbench, "a")
    workbench.camera.open()
    qtbot.wait_until(lambda: workbench.selection.preparation.image_size is not None)
    workbench.live.close()
    workbench.selection.set_preparation(
        replace(workbench.selection.preparation, image_size=(640, 480))
    )
    start = show(workbench)

    start.press("Resume")
    qtbot.wait_until(lambda: bool(start.notices))

    assert start.notices[-1].startswith(
        "The image size is 640 x 480 px; the swing was captured with 1224 x 1024 px."
    )
    assert start.steps == []


def test_a_swing_that_was_damaged_since_is_reported_and_no_longer_offered(
    show: Show, workbench: Workbench, qtbot: QtBot
) -> None:
    folder = interrupted(workbench, "a")
    workbench.camera.open()
    start = show(workbench)
    (folder / "journal.jsonl").write_bytes(b"{\n{\n{\n")

    start.press("Resume")
    qtbot.wait_until(lambda: bool(start.notices))
    qtbot.wait_until(lambda: start.rows()[0].words()[0] == "Damaged: a")

    assert "Line 1 of" in start.notices[-1]
    assert start.steps == []


def damage_line(folder: Path) -> str:
    journal = folder / "journal.jsonl"
    lines = journal.read_bytes().split(b"\n")
    lines[4] = lines[4][:50]
    journal.write_bytes(b"\n".join(lines))
    return f"Line 5 of {journal} is damaged. Restore the file from a copy"


def remove_header(folder: Path) -> str:
    (folder / "header.json").unlink()
    return f"{folder} contains images of a swing, but no header.json."


@pytest.mark.parametrize("damage", [damage_line, remove_header])
def test_a_damaged_swing_is_reported_until_it_is_mended(
    show: Show,
    workbench: Workbench,
    qtbot: QtBot,
    damage: Callable[[Path], str],
    tmp_path: Path,
) -> None:
    folder = interrupted(workbench, "a")
    shutil.copytree(folder, tmp_path / "copy")
    sentence = damage(folder)
    start = show(workbench)

    (row,) = start.rows()
    assert row.words()[0] == "Damaged: a"
    assert row.words()[1].startswith(sentence)
    assert start.buttons() == ["Discard", "Search again"]

    shutil.copytree(tmp_path / "copy", folder, dirs_exist_ok=True)
    start.press("Search again")
    qtbot.wait_until(lambda: start.rows()[0].words()[0] != "Damaged: a")
    assert start.buttons() == ["Resume", "Discard"]


def test_a_damaged_swing_can_be_discarded_and_keeps_its_images(
    show: Show, workbench: Workbench, qtbot: QtBot
) -> None:
    folder = interrupted(workbench, "a")
    remove_header(folder)
    start = show(workbench)

    start.press("Discard")
    asked = start.page.findChildren(QuestionBar)[1]
    sentence = "Discard this swing? Its images remain on the disk."
    assert asked.words() == f"Damaged: a: {sentence}"
    start.answer("Discard")
    qtbot.wait_until(lambda: start.rows() == ())

    assert len(list((folder / "images").iterdir())) == 12
    assert start.statuses[-1] == f"Swing discarded. The images remain in {folder}."
    assert start.notices == []


def test_the_whole_sentence_of_a_damage_is_seen(
    show: Show, workbench: Workbench, qtbot: QtBot
) -> None:
    damage_line(interrupted(workbench, "20260930-100000_LP-04-of-Hall-2_T-10-of-80-mm"))
    start = show(workbench)

    (label,) = [
        label
        for label in start.rows()[0].findChildren(QLabel)
        if label.text().startswith("Line 5")
    ]

    assert label.height() >= label.heightForWidth(label.width())
    assert label.visibleRegion().boundingRect() == label.rect()
    assert label.minimumSizeHint().width() <= label.width()


@pytest.mark.slow
def test_a_swing_that_another_program_captures_is_no_offer_until_it_is_killed(
    show: Show,
    workbench: Workbench,
    qtbot: QtBot,
    holding: Callable[[Path], "subprocess.Popen[str]"],
) -> None:
    folder = interrupted(workbench, "a")
    interrupted(workbench, "b", hours_ago=3)
    other = holding(folder)
    start = show(workbench)

    qtbot.wait_until(lambda: len(start.rows()) == 2)
    assert [row.words()[1] for row in start.rows()] == [
        "LP-04  \u00b7  T-10  \u00b7  12 images",
        "In use by another program",
    ]
    assert start.buttons() == ["Resume", "Discard", "Search again"]

    other.kill()
    other.wait()
    workbench.camera.open()
    start.press("Search again")
    qtbot.wait_until(lambda: start.buttons().count("Resume") == 2)
    start.press("Resume")
    qtbot.wait_until(lambda: start.steps == ["swing"])

    assert workbench.run.status.record_folder == folder


def test_to_discard_asks_and_keeps_by_default(show: Show, workbench: Workbench) -> None:
    folder = interrupted(workbench, "a")
    start = show(workbench)

    start.press("Discard")
    focused = QApplication.focusWidget()
    assert isinstance(focused, QPushButton)
    assert focused.text() == "Keep"
    QTest.keyClick(focused, Key.Key_Space)

    assert not focused.isVisible()
    assert open_record(folder).verdict is None


def test_a_double_click_discards_nothing(
    show: Show, workbench: Workbench, qtbot: QtBot
) -> None:
    folder = interrupted(workbench, "a")
    start = show(workbench)
    button = start.rows()[0].findChildren(QPushButton)[1]
    place = button.mapTo(start.page, button.rect().center())
    assert button.text() == "Discard"

    QTest.mouseClick(button, LEFT)
    QApplication.processEvents()  # the question comes up elsewhere
    second = start.page.childAt(place)
    assert isinstance(second, QPushButton)
    QTest.mouseClick(second, LEFT)
    start.settle()

    assert second is button
    assert open_record(folder).verdict is None


@pytest.mark.slow
@pytest.mark.parametrize("also_searching", [False, True])
@pytest.mark.parametrize(
    ("word", "broken_part"),
    [("Resume", "read_resumable"), ("Discard", "discard_swing")],
)
def test_after_a_bug_the_swing_is_offered_as_before(
    show: Show,
    workbench: Workbench,
    qtbot: QtBot,
    monkeypatch: pytest.MonkeyPatch,
    word: str,
    broken_part: str,
    also_searching: bool,
) -> None:
    caught: list[BaseException] = []
    monkeypatch.setattr("sys.excepthook", lambda _, error, __: caught.append(error))
    folder = interrupted(workbench, "a")
    workbench.camera.open()
    start = show(workbench)
    broken_parts = [broken_part] + ["find_unfinished"] * also_searching
    with monkeypatch.context() as broken:
        for part in broken_parts:
            name = f"lightpen_app.steps.start.interrupted_panel.{part}"
            broken.setattr(name, lambda *_: 1 / 0)
        start.press(word)
        if word == "Discard":
            start.answer(word)
        qtbot.wait_until(lambda: len(caught) == len(broken_parts))
        start.settle()
    assert start.steps == start.statuses == []
    assert open_record(folder).verdict is None
    (row,) = start.rows()
    buttons = [b for b in row.findChildren(QPushButton) if b.isVisibleTo(row)]
    assert all(button.isEnabled() and not button.toolTip() for button in buttons)

    start.press(word)
    if word == "Resume":
        qtbot.wait_until(lambda: start.steps == ["swing"])
        return
    start.answer(word)
    qtbot.wait_until(lambda: start.rows() == ())
    assert open_record(folder).verdict == DISCARDED


def test_a_bug_in_the_lookup_leaves_no_result_of_another_pen(
    show: Show, workbench: Workbench, monkeypatch: pytest.MonkeyPatch
) -> None:
    caught: list[BaseException] = []
    monkeypatch.setattr("sys.excepthook", lambda _, error, __: caught.append(error))
    accepted(workbench, timedelta(days=12))
    start = show(workbench)
    before = start.last()
    with monkeypatch.context() as broken:
        broken.setattr(FolderArchive, "in_force", lambda *_: 1 / 0)
        start.type_into("Pen serial number", "LP-05")
        start.settle()
    assert len(caught) == 1
    assert start.last() == ("Last calibration not available",)

    start.type_into("Pen serial number", "LP-04")
    start.settle()
    assert start.last() == before


@pytest.mark.slow
def test_buttons_wait_while_a_swing_is_read(
    show: Show, workbench: Workbench, qtbot: QtBot
) -> None:
    interrupted(workbench, "a")
    workbench.camera.open()
    start = show(workbench)
    start.press("Resume")

    buttons = start.rows()[0].findChildren(QPushButton)
    assert not any(button.isEnabled() for button in buttons)
    assert {button.toolTip() for button in buttons} == {"Reading the swing"}

    qtbot.wait_until(lambda: start.steps == ["swing"])
    assert all(button.isEnabled() for button in buttons)


def test_what_waits_for_an_answer_comes_first(show: Show, workbench: Workbench) -> None:
    interrupted(workbench, "a")
    start = show(workbench)
    (panel,) = start.page.findChildren(InterruptedPanel)
    station = start.field("Station")

    def place(widget: QWidget) -> QPoint:
        return widget.mapTo(start.page, QPoint())

    for size in ((720, 400), (1000, 640)):
        start.page.resize(*size)
        start.settle()

        assert place(panel).y() < place(station).y()
        assert place(panel).y() + panel.height() < start.page.height()


# Keys, names, languages


@pytest.fixture
def window(
    qtbot: QtBot, workbench: Workbench, settings: Settings
) -> Iterator[MainWindow]:
    page = StartPage(workbench)
    window = MainWindow(
        [page, BlankPage("camera")], settings, Preferences(), workbench.notifications
    )
    qtbot.addWidget(window)
    window.show()
    qtbot.waitActive(window).__enter__()
    page.show_setup()
    yield window
    window.close()


def test_enter_after_a_name_of_a_station_only_takes_it_over(
    window: MainWindow, workbench: Workbench
) -> None:
    """The operator must see what came back with it before going on."""
    QTest.keyClicks(focused(), "b")
    QTest.keyClick(focused(), Key.Key_Return)
    assert window.page().key == "start"
    assert workbench.selection.preparation.names.station != "Hall 2"

    QTest.keyClick(focused(), Key.Key_Return)

    assert window.page().key == "camera"


def test_every_label_leads_to_its_field(start: Opened) -> None:
    texts = {
        label.text(): label.buddy()
        for label in start.page.findChildren(QLabel)
        if label.buddy() is not None
    }

    assert texts["Operator"] is start.field("Operator")
    assert texts["Ball diameter"] is start.field("Ball diameter")


# What is reported as long as it holds


def test_a_station_without_a_temperature_is_offered_none_and_no_slip_confirms_one(
    workbench: Workbench, qtbot: QtBot
) -> None:
    selection, answers = workbench.selection, list[float | None]()
    live = selection.preparation.with_source(SourceChoice("aravis", "1"))
    limits = SwingLimits(requires_temperature=True)
    selection.set_preparation(replace(live, limits=limits))
    selection.changed.connect(
        lambda _: answers.append(selection.preparation.assumptions.temperature_c)
    )
    view = DayView(workbench, ())
    qtbot.addWidget(view)
    view.start()
    view.show()
    (field,) = view.findChildren(TemperatureField)
    (confirm,) = (b for b in view.findChildren(QPushButton) if b.text() == "Confirm")

    assert field.text() == ""
    confirm.click()
    assert answers == [None]

    type_number(field, "2l")
    confirm.click()
    assert field.text() == "2l"
    assert field.reason()
    assert answers == [None]

    type_number(field, "21")
    assert answers == [None, 21.0]
    view.stop()


def test_the_temperature_is_asked_once_a_day_where_a_camera_is_live(
    start: Opened, workbench: Workbench
) -> None:
    selection = workbench.selection
    name = "Pen temperature today"
    view = start.page.findChild(DayView)
    asked = start.page.findChild(TemperatureField)
    assert view is not None
    assert asked is not None
    start.page.show_day()
    assert not asked.isVisible()

    source = SourceChoice("aravis", "1")
    selection.set_preparation(
        replace(selection.preparation, source=source, camera_file=None, pen_file=None)
    )
    assert start.text_of(name) == "not measured"
    start.type_into(name, "21.5", Key.Key_Return)
    assert not asked.isVisible()
    assert selection.preparation.assumptions_today.temperature_c == 21.5
    reported = [item.message.text for item in view._ready.items()]
    assert "Pen at 21.5 \N{DEGREE SIGN}C" in reported

    # The next day the last answer is offered again, and none is one, too.
    old = replace(selection.preparation, temperature_day="2020-01-01")
    selection.set_preparation(old)
    assert asked.value() == 21.5
    assert selection.preparation.assumptions_today.temperature_c is None
    start.type_into(name, "-50", Key.Key_Return)
    assert not asked.isVisible()

    limits = SwingLimits(requires_temperature=True)
    selection.set_preparation(replace(selection.preparation, limits=limits))
    assert asked.isVisible()
    assert "temperature" in [item.step for item in view._ready.items() if item.is_amber]
