"""The step History shows what the archive tells, and enters what is added to it."""

import sqlite3
import threading
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import pyqtgraph as pg
import pytest
from benchmarks.small_records import record_of, small_record
from PySide6.QtCore import QItemSelectionModel, QModelIndex, Qt, QThreadPool
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QApplication,
    QComboBox,
    QFileDialog,
    QLabel,
    QLineEdit,
    QMenu,
    QPushButton,
    QTabWidget,
    QWidget,
)
from pytestqt.qtbot import QtBot
from tests.app.pictures import data_of, ranges_of
from tests.app.room import scrolled_sideways
from typing_extensions import override

from lightpen.archive.chains import Event, Kind, append
from lightpen.archive.checks import ArchiveCheckResult, check_archive
from lightpen.archive.lazy_logbook import LazyLogbook
from lightpen.archive.store import Database
from lightpen.estimation.reports.verdict import Grade
from lightpen.model.limits import DueRule, StationLimits
from lightpen.model.names import Origin
from lightpen.record.library.entered_files import ARCHIVE
from lightpen.record.library.library_changes import Author, add_item
from lightpen.record.library.supervision import Signature, save_limits
from lightpen.record.library.tip_library import ListedTip
from lightpen.record.results.result_folder import FolderArchive
from lightpen.record.results.results import Result
from lightpen.record.swings.header import Names
from lightpen_app.face import Service
from lightpen_app.look.languages import LanguageSwitch
from lightpen_app.look.words import unbroken
from lightpen_app.steps.history.archive_panel import ArchivePanel, DuePanel
from lightpen_app.steps.history.entry_panel import EntryPanel
from lightpen_app.steps.history.history_table import (
    PEN,
    STATION,
    TIP,
    WHAT,
    WHEN,
    WORDS,
    HistoryTable,
    X,
)
from lightpen_app.steps.history.page import HistoryPage
from lightpen_app.widgets.fields import DateField
from lightpen_app.widgets.state_banner import SignLabel
from lightpen_app.widgets.tables import NumberTable
from lightpen_app.widgets.trend_panel import TrendPanel
from lightpen_app.work.job import Report
from lightpen_app.work.workbench import Workbench
from lightpen_program.extensions import faces
from lightpen_resources import languages

if TYPE_CHECKING:
    from tests.app.conftest import HoldBack

W = TypeVar("W", bound=QWidget)
NOON = datetime(2026, 1, 2, 12, tzinfo=UTC)
TRENDS, ENTRY, SELECTION, DUE, WHOLE = 0, 1, 2, -2, -1  # places of tabs
MANY = 450
FLAGS = QItemSelectionModel.SelectionFlag


def names(tip: str) -> Names:
    return Names("Hall 2", "Ann", "LP-04", tip, "C-1", 10.0)


class VerifiedKinds(Service):
    """An extension that knows the kinds of two tasks."""

    @override
    def event_text(self, event: Event) -> str:
        kind = event.settings.get("verified")
        return {"part": "Part", "fixed point": "Tip check"}.get(str(kind), "")


class Desk:
    """Somebody at the step History of a data folder."""

    def __init__(self, workbench: Workbench, qtbot: QtBot) -> None:
        self.workbench, self.qtbot = workbench, qtbot
        services = VerifiedKinds(workbench), *(make(workbench) for make in faces())
        self.page = HistoryPage(workbench, services)
        self.notices: list[str] = []
        self.statuses: list[str] = []
        notifications = workbench.notifications
        notifications.raised.connect(lambda text, _: self.notices.append(text))
        notifications.status_changed.connect(self.statuses.append)
        qtbot.addWidget(self.page)

    def enter(
        self,
        n_entries: int,
        tip: str = "T-10",
        first: int = 0,
        origin: Origin | None = None,
        of: Names | None = None,
    ) -> None:
        """Enter tips of which the x is their number, in mm."""
        logbook = self.workbench.run.logbook.opened()
        for n in range(first, first + n_entries):
            event = Event(
                kind=Kind.ACCEPTED,
                at=NOON + timedelta(days=n),
                names=of or names(tip),
                program="lightpen 1",
                grade=Grade.PASS,
                tip_pen_mm=(float(n), 0.0, -1.5),
                expanded_uncertainty_mm=(0.0031, 0.0041, 0.0061),
                settings={"max_uncertainty_mm": 0.012},
                origin=origin,
            )
            append(logbook.database, logbook.chain, event)

    def open(self) -> None:
        self.page.resize(1000, 700)
        self.page.show()
        self.page.entered()
        self.until(lambda: self.statuses)

    def until(self, condition: Callable[[], object]) -> None:
        self.qtbot.waitUntil(lambda: bool(condition()))

    def child(self, kind: type[W], number: int = 0) -> W:
        return self.page.findChildren(kind)[number]

    @property
    def table(self) -> HistoryTable:
        return self.child(HistoryTable)

    def column(self, column: int) -> list[str]:
        """Return what is shown in a column, as far as it is read."""
        model = self.table.model()
        return [
            model.index(row, column, QModelIndex()).data()
            for row in range(model.rowCount())
        ]

    def select(self, *rows: int) -> None:
        """Make rows the only ones that are selected, the first of them current."""
        chosen, model = self.table.selectionModel(), self.table.model()
        for row in reversed(rows):
            index = model.index(row, WHEN, QModelIndex())
            is_last = row == rows[-1]
            how = FLAGS.ClearAndSelect if is_last else FLAGS.Select
            chosen.setCurrentIndex(index, how | FLAGS.Rows)

    def show_tab(self, tab: int) -> None:
        tabs = self.child(QTabWidget)
        tabs.setCurrentIndex(tab % tabs.count())

    def button(self, text: str) -> QPushButton:
        """Return the button that is seen with a text."""
        (button,) = [
            each
            for each in self.page.findChildren(QPushButton)
            if each.isVisible() and each.text() == text
        ]
        return button

    def click(self, text: str) -> None:
        """Click a button that is seen, or choose from the menu of one."""
        for action in (a for m in self.page.findChildren(QMenu) for a in m.actions()):
            if action.text() == text:
                action.trigger()
                return
        QTest.mouseClick(self.button(text), Qt.MouseButton.LeftButton)

    def type_reason(self, text: str) -> None:
        (edit,) = [
            each
            for each in self.child(EntryPanel).findChildren(QLineEdit)
            if each.isVisible()
        ]
        QTest.keyClicks(edit, text)
        QTest.keyClick(edit, Qt.Key.Key_Return)

    def wait_idle(self) -> None:
        """Wait until nothing is under way with the archive as a whole."""
        buttons = self.child(ArchivePanel).findChildren(QPushButton)
        self.until(lambda: buttons[0].isEnabled())

    def choose_file(self, path: Path) -> None:
        dialog = self.page.findChildren(QFileDialog)[-1]
        dialog.fileSelected.emit(str(path))
        dialog.close()


def remarks_of(panel: ArchivePanel) -> list[str]:
    return [label.value().text for label in panel.findChildren(SignLabel)]


@pytest.fixture
def desk(workbench: Workbench, qtbot: QtBot) -> Iterator[Desk]:
    desk = Desk(workbench, qtbot)
    yield desk
    desk.page.shut_down()


def test_the_newest_entries_come_first_and_can_be_chosen_by_tip_and_day(
    desk: Desk,
) -> None:
    desk.enter(3)
    desk.enter(1, tip="T-11", first=3)
    desk.open()
    assert desk.column(TIP) == ["T-11", "T-10", "T-10", "T-10"]
    assert desk.column(X) == ["3.0000", "2.0000", "1.0000", "0.0000"]
    assert desk.column(WHAT)[:3] == [
        *("Calibration, current", "Calibration, current", "Calibration, replaced")
    ]

    tips = desk.child(QComboBox, 1)
    tips.setCurrentIndex(tips.findText("T-10"))
    desk.until(lambda: len(desk.column(TIP)) == 3)
    QTest.keyClicks(desk.child(DateField), "2026-01-03")
    desk.until(lambda: desk.column(X) == ["2.0000", "1.0000"])
    assert desk.statuses[-1] == "2 entries"


def test_a_column_that_is_not_wanted_stays_hidden(desk: Desk) -> None:
    desk.enter(3)
    desk.open()

    (tip,) = [each for each in desk.table.actions() if each.text() == "Tip"]
    tip.trigger()

    assert desk.table.isColumnHidden(TIP)
    assert desk.workbench.settings.last().hidden_columns == ("tip",)
    again = HistoryPage(desk.workbench)
    again.entered()
    (table,) = again.findChildren(HistoryTable)
    assert table.hidden_columns() == ("tip",)
    again.shut_down()
    QThreadPool.globalInstance().waitForDone()


def test_a_pass_that_was_not_accepted_and_the_tasks_of_a_verification_are_told_apart(
    desk: Desk,
) -> None:
    logbook = desk.workbench.run.logbook.opened()
    entries = [
        *((Kind.REFUSED, grade, {}) for grade in (Grade.PASS, Grade.REPEAT)),
        *(
            (Kind.VERIFICATION, Grade.PASS, {"verified": task})
            for task in ("conclusion", "part", "fixed point")
        ),
    ]
    for n, (kind, grade, settings) in enumerate(entries):
        event = Event(
            kind=kind,
            at=NOON + timedelta(days=n),
            names=names("T-10"),
            program="lightpen 1",
            grade=grade,
            swing=f"2026-01-0{n + 2}" if kind is Kind.REFUSED else "",
            settings=settings,
        )
        append(logbook.database, logbook.chain, event)
    desk.open()

    assert desk.column(WHAT) == [
        *("Tip check", "Part", "Verification", "Rejected", "Repeated")
    ]


def test_what_is_not_of_a_live_camera_is_marked_and_no_practice_is_in_force(
    desk: Desk,
) -> None:
    desk.enter(1)
    desk.enter(2, "T-11", 1, Origin.SIMULATED)
    desk.enter(1, "T-12", 3, Origin.RECORDED)
    desk.open()

    assert desk.column(WHAT) == [
        *("RECORDED, current", "SIMULATED, saved", "SIMULATED, replaced"),
        "Calibration, current",
    ]


@pytest.mark.slow
def test_limits_and_verifications_are_listed_and_can_be_chosen_by_what_they_are(
    desk: Desk,
) -> None:
    desk.enter(2)
    folder, eve = desk.workbench.folder, Signature("Eve", "correct horse")
    save_limits(folder, "Hall 2", StationLimits(), eve, "", NOON)
    desk.workbench.run.logbook.enter_owed()
    desk.open()
    assert sorted(desk.column(WHAT))[-2:] == ["Limits", "Limits"]

    kinds = desk.child(QComboBox, 3)
    kinds.setCurrentIndex(kinds.findText("Limits"))
    desk.until(lambda: desk.column(WHAT) == ["Limits", "Limits"])
    desk.select(0)
    limit = f"Radius error: {StationLimits().verification.radius}\u00a0mm"
    desk.until(lambda: limit in _words(desk))
    assert "_" not in _words(desk)  # no name of a stored setting
    desk.select(1)
    desk.until(lambda: "supervisor password changed" in _words(desk))
    assert "_" not in _words(desk)


def test_a_server_that_cannot_be_reached_is_reported_without_the_password(
    desk: Desk,
) -> None:
    from lightpen_extensions.plant.server import Replicator

    folder = desk.workbench.folder
    away = "postgresql://plant:secret-word@127.0.0.1:1/plant"
    desk.workbench.run.logbook = LazyLogbook(
        folder, lambda database, chain: Replicator(database, chain, away)
    )
    desk.enter(1)
    desk.open()
    desk.show_tab(WHOLE)
    panel = desk.child(ArchivePanel)

    def reported() -> str:
        desk.page.entered()
        return remarks_of(panel)[0]

    desk.until(lambda: "Entries not yet on the server;" in reported())
    assert "The archive postgresql" in reported()
    assert "secret-word" not in reported()
    desk.workbench.run.logbook.close()


@pytest.mark.slow
@pytest.mark.parametrize("language", languages())
def test_at_the_usual_width_every_column_is_seen_and_reported_whole(
    desk: Desk, qapp: QApplication, language: str
) -> None:
    LanguageSwitch(qapp).set_language(language)
    desk.enter(21)  # more than are seen at once
    for n, origin in enumerate((Origin.SIMULATED, Origin.RECORDED), 1):
        desk.enter(2, f"T-{n}", 3 * n, origin)
    desk.open()
    desk.page.resize(976, 700)  # that of a window of 1280 px
    desk.until(lambda: desk.table.model().rowCount() == 25)

    assert desk.table.verticalScrollBar().isVisible()
    desk.until(lambda: not desk.table.horizontalScrollBar().isVisible())
    across = desk.table.horizontalHeader()
    for column in range(WORDS):
        if column != STATION:  # the only one
            needed = desk.table.sizeHintForColumn(column)
            assert across.sectionSize(column) >= needed, column
    assert desk.table.isColumnHidden(STATION)


@pytest.mark.slow
def test_a_block_that_is_read_computes_nothing_anew_of_what_is_selected(
    desk: Desk,
) -> None:
    desk.enter(MANY)
    desk.open()
    desk.select(0)
    reported: list[None] = []
    desk.table.selection_changed.connect(lambda: reported.append(None))

    scroll_to_the_end(desk)

    assert reported == []


def _words(desk: Desk) -> str:
    return " ".join(desk.child(EntryPanel).words()).replace("\u200b", "")


def test_what_is_no_day_is_marked_and_chooses_nothing(desk: Desk) -> None:
    desk.enter(2)
    desk.open()
    field = desk.child(DateField, 1)
    QTest.keyClicks(field, "2026-13")

    assert field.property("tone") == "bad"
    assert len(desk.column(TIP)) == 2


@pytest.mark.slow
def test_lines_are_read_when_they_are_seen(desk: Desk) -> None:
    desk.enter(MANY)
    desk.open()
    desk.qtbot.wait(20)
    assert len(desk.column(X)) < MANY

    scroll_to_the_end(desk)
    assert desk.column(X) == [f"{x:.4f}" for x in reversed(range(MANY))]


def scroll_to_the_end(desk: Desk) -> None:
    def is_read() -> bool:
        desk.table.scrollToBottom()
        return desk.table.model().rowCount() == MANY

    desk.until(is_read)


@pytest.mark.slow
def test_the_trend_is_of_the_tip_that_is_chosen(desk: Desk) -> None:
    desk.enter(4)
    desk.enter(1, tip="T-11", first=4)
    desk.open()
    desk.select(2)
    panel = desk.child(TrendPanel)
    desk.until(lambda: len(panel.value().tips) == 4)

    x, _, _, u = panel.plots()
    assert list(data_of(x, pg.PlotCurveItem)[1]) == [0.0, 1.0, 2.0, 3.0]
    assert list(data_of(u, pg.PlotCurveItem)[1]) == [0.0061] * 4
    assert [data_of(p, pg.ScatterPlotItem, 1)[0] for p in panel.plots()] == [[3]] * 4
    (left, right), (low, high) = ranges_of(u)
    assert left < 1 < 10 < right  # so few are not numbered in fractions
    assert low < 0.0061 < 0.012 < high  # the limit is in sight
    assert panel.words().startswith("Pen LP-04, tip T-10: 4 calibrations, 2026-01-02")
    desk.select(0)
    desk.until(lambda: len(panel.value().tips) == 1)
    assert panel.words().startswith("Pen LP-04, tip T-11: one calibration, 2026-01")


def said_in(panel: QWidget) -> str:
    labels = [each for each in panel.findChildren(QLabel) if each.isVisibleTo(panel)]
    return " ".join(unbroken(each.text()) for each in labels)


def test_two_that_are_selected_are_compared(desk: Desk) -> None:
    from lightpen_app_extensions.comparisons.selection_panel import SelectionPanel

    desk.enter(3)
    desk.open()
    desk.show_tab(SELECTION)
    panel = desk.child(SelectionPanel)
    assert "Select two entries" in said_in(panel)
    desk.until(lambda: panel.repeatability())
    desk.select(0, 2)

    found = panel.comparison()
    assert found is not None
    assert found.change.difference[0] == 2.0
    assert "Repeatability of the 2 selected calibrations" in said_in(panel)
    assert "The tip changed by 2.0000 mm since" in said_in(panel)
    assert "2 calibrations do not suffice for a verdict" in said_in(panel)


def files_in(folder: Path) -> dict[Path, int]:
    """Return the files in a folder with their sizes."""
    found = (each for each in folder.rglob("*") if each.is_file())
    return {each: each.stat().st_size for each in found}


@pytest.mark.slow
def test_a_note_is_entered_and_shown_with_its_entry(desk: Desk) -> None:
    desk.enter(2)
    desk.open()
    desk.show_tab(ENTRY)
    desk.select(1)
    desk.click("Add comment...")
    desk.type_reason("Dropped on the floor.")

    desk.until(lambda: len(desk.column(WHAT)) == 3)
    assert desk.column(WHAT)[0] == "Comment"
    assert desk.column(WORDS)[0] == "Dropped on the floor."
    desk.select(2)
    panel = desk.child(EntryPanel)
    desk.until(lambda: any("Comment" in words for words in panel.words()))
    assert any("Ann: Dropped on the floor." in words for words in panel.words())


def test_a_note_is_entered_while_the_archive_is_checked(
    desk: Desk, monkeypatch: pytest.MonkeyPatch
) -> None:
    is_entered = threading.Event()

    def check_slowly(
        database: Database, folder: Path, report: Report
    ) -> ArchiveCheckResult:
        is_entered.wait()
        return check_archive(database, folder, report)

    place = "lightpen_app.steps.history.archive_panel.check_archive"
    monkeypatch.setattr(place, check_slowly)
    desk.enter(1)
    desk.open()
    desk.show_tab(WHOLE)
    desk.click("Check the archive")
    try:
        desk.show_tab(ENTRY)
        desk.select(0)
        desk.click("Add comment...")
        desk.type_reason("Dropped on the floor.")
        desk.until(lambda: desk.column(WHAT)[0] == "Comment")
    finally:
        is_entered.set()
    desk.wait_idle()


def test_a_change_of_the_tip_library_is_shown_with_what_it_says(desk: Desk) -> None:
    tip = ListedTip(
        id="T-10", ball_diameter_mm=6.0, max_change_mm=0.02, is_retired=True
    )
    add_item(desk.workbench.folder, tip, Author("Hall 2", "Ann", "chipped"), NOON)
    desk.workbench.run.logbook.opened().enter_owed()
    desk.open()

    assert desk.column(WHAT) == ["Tip library"]
    assert (desk.column(TIP), desk.column(WORDS)) == (["T-10"], ["chipped"])
    desk.show_tab(ENTRY)
    reported = desk.child(EntryPanel).words()
    parts = ("T-10", "ball 6.0 mm", "max. change 0.02 mm", "retired", "chipped")
    assert "  \N{MIDDLE DOT}  ".join(parts) in reported


def store(folder: Path, n: int) -> Result:
    """Put a tip in force whose x is n mm."""
    result = Result(
        names=names("T-10"),
        accepted=NOON + timedelta(days=n),
        grade=Grade.PASS,
        record=folder / "records" / "gone",
        images=(),
        calibration=small_record(
            {
                "tip_pen_mm": [float(n), 2.0, 3.0],
                "expanded_uncertainty_mm": [0.1, 0.1, 0.1],
                "cone_cam_mm": [1.0, 2.0, 3.0],
                "covariance": [[0.25] * 6] * 6,
            }
        ),
        origin=Origin.LIVE,
    )
    FolderArchive(folder).store(result)
    return result


@pytest.mark.slow
def test_what_was_accepted_here_is_put_on_paper_as_its_file_has_it(
    desk: Desk, stated: dict[str, Any]
) -> None:
    from lightpen_app_extensions.report.control import PrintReportWindow

    folder = desk.workbench.folder
    result = replace(store(folder, 0), calibration=record_of(stated))
    FolderArchive(folder).store(result)
    desk.workbench.run.logbook.enter_owed()
    desk.open()
    desk.show_tab(ENTRY)
    desk.click("Calibration report...")
    desk.until(lambda: desk.page.findChildren(PrintReportWindow))

    window = desk.child(PrintReportWindow)
    desk.until(lambda: window._pages.pageCount() > 2)
    window.close()

    first = FolderArchive(folder).all_files()[0]
    first.write_bytes(first.read_bytes()[:-10])
    desk.select(1)
    desk.click("Calibration report...")
    desk.until(lambda: desk.notices)
    assert "000001" in desk.notices[0]


def test_a_check_tells_notes_that_prove_no_change(desk: Desk) -> None:
    desk.enter(2)
    library = desk.workbench.folder / "library"
    library.mkdir()
    (library / "000001.json").write_text("{}")
    desk.open()
    desk.show_tab(WHOLE)
    desk.click("Check the archive")
    panel = desk.child(ArchivePanel)
    desk.until(lambda: panel.found is not None)

    reported = " ".join(remarks_of(panel))
    assert "No changes in 2 entries" in reported
    assert "library/000001.json is not entered in the archive" in reported


def test_a_check_that_is_cancelled_leaves_the_one_before(
    desk: Desk, hold_back: "HoldBack"
) -> None:
    desk.enter(2)
    desk.open()
    desk.show_tab(WHOLE)
    desk.click("Check the archive")
    panel = desk.child(ArchivePanel)
    desk.until(lambda: panel.found is not None)
    before = panel.found
    desk.until(lambda: not panel.progress.is_running)
    may_begin = hold_back("lightpen_app.steps.history.archive_panel.check_archive")

    desk.click("Check the archive")
    assert panel.progress.is_running
    desk.click("Cancel")
    may_begin.set()
    QThreadPool.globalInstance().waitForDone()
    QApplication.processEvents()

    assert panel.found is before
    assert not panel.progress.is_running


def test_a_repeatability_is_kept_entered_and_put_on_paper(desk: Desk) -> None:
    from lightpen_app_extensions.comparisons.selection_panel import SelectionPanel
    from lightpen_app_extensions.report.control import PrintReportWindow

    desk.enter(5)
    desk.open()
    desk.until(lambda: desk.child(SelectionPanel).repeatability() is not None)
    desk.show_tab(SELECTION)

    desk.click("Repeatability report...")
    desk.until(lambda: desk.page.findChildren(PrintReportWindow))
    window = desk.child(PrintReportWindow)
    desk.until(lambda: window._pages.pageCount() > 0)
    window.close()
    desk.until(lambda: len(desk.column(WHAT)) == 6)
    assert desk.notices == []


def test_a_verification_has_a_report_of_its_own(desk: Desk) -> None:
    from lightpen_app_extensions.report.control import PrintReportWindow
    from lightpen_extensions.comparisons.assessment import (
        USE_TIP,
        VERIFY_AGAIN,
        VerificationAssessment,
        keep_verification,
        verification_record,
    )

    verdict = VerificationAssessment(Grade.CHECK, USE_TIP, VERIFY_AGAIN)
    entries = {"pen": "LP-04", "tip": "T-10", "moved_mm": [0.001, 0.002, 0.003]}
    record = verification_record("drift", entries, verdict, {"drift": 0.02}, {})
    keep_verification(desk.workbench.folder, record, is_simulated=False)
    desk.workbench.run.logbook.enter_owed()
    desk.open()
    desk.show_tab(ENTRY)

    desk.click("Verification report...")
    desk.until(lambda: desk.page.findChildren(PrintReportWindow))
    window = desk.child(PrintReportWindow)
    desk.until(lambda: window._pages.pageCount() > 0)
    assert window.windowTitle() == "Verification report"
    window.close()
    assert desk.notices == []


def test_what_is_not_accepted_has_no_record_on_paper(desk: Desk) -> None:
    pytest.importorskip("lightpen_app_extensions.report")
    desk.enter(1)
    logbook = desk.workbench.run.logbook.opened()
    append(logbook.database, logbook.chain, Event(Kind.NOTE, NOON, names(""), "1"))
    desk.open()
    desk.show_tab(ENTRY)

    why_not = {}
    for row, tip in enumerate(desk.column(TIP)):
        desk.select(row)
        button = desk.button("Calibration report...")
        why_not[tip] = "" if button.isEnabled() else button.toolTip()
    assert why_not == {
        "T-10": "",
        "": "Only accepted tips and verifications have a report.",
    }


LONG = 200 * "W"


def test_long_names_are_not_scrolled_sideways_in_a_small_window(desk: Desk) -> None:
    desk.enter(2, of=Names("Hall 2", LONG, LONG, LONG, LONG))
    desk.open()
    desk.page.resize(710, 540)  # that of a window of 800 x 600
    for tab in TRENDS, ENTRY, SELECTION, DUE, WHOLE:
        desk.show_tab(tab)
        QApplication.processEvents()
        assert scrolled_sideways(desk.page) == ()


def test_the_current_tips_are_listed_with_their_due_dates(desk: Desk) -> None:
    desk.enter(3)
    desk.open()
    table = desk.child(DuePanel).findChildren(NumberTable)[0]
    desk.until(lambda: table.value().rows)

    assert table.value().cells[0][:2] == ("2026-01-04", "2026-02-03")


@pytest.mark.slow
def test_what_a_supervisor_laid_down_tells_when_tips_are_due(desk: Desk) -> None:
    desk.enter(3)
    folder, eve = desk.workbench.folder, Signature("Eve", "correct horse")
    limits = StationLimits(due=DueRule(7))
    names = replace(desk.workbench.selection.preparation.names, station="Hall 2")
    desk.workbench.selection.set_preparation(
        replace(desk.workbench.selection.preparation, names=names)
    )
    desk.open()
    laid_down = save_limits(folder, "Hall 2", limits, eve, "", NOON)
    desk.workbench.selection.set_supervision(laid_down)

    panel = desk.child(DuePanel)
    table = panel.findChildren(NumberTable)[0]
    desk.until(lambda: table.value().rows)
    desk.until(lambda: table.value().cells[0][1] == "2026-01-11")


def test_what_was_changed_is_said_in_the_list_and_by_a_check(desk: Desk) -> None:
    desk.enter(3)
    path = desk.workbench.folder / ARCHIVE
    with closing(sqlite3.connect(path)) as connection, connection:
        connection.execute(
            "UPDATE archive_entries SET text = replace(text, 'Ann', 'Bob') "
            "WHERE number = 2"
        )
    desk.open()
    assert desk.column(WHAT)[1] == "Modified after entry"
    assert desk.column(PEN)[1] == ""
    assert not desk.page.is_doubtful()

    desk.show_tab(WHOLE)
    desk.click("Check the archive")
    desk.until(desk.page.is_doubtful)
    reported = remarks_of(desk.child(ArchivePanel))
    assert any("Entry 2 of chain" in text for text in reported)


@pytest.mark.slow
def test_entries_are_saved(desk: Desk, tmp_path: Path) -> None:
    desk.enter(2)
    desk.open()
    desk.show_tab(WHOLE)
    desk.click("Save listed entries (CSV)...")
    desk.choose_file(tmp_path / "shown.csv")
    desk.until(lambda: "2 entries saved" in desk.statuses[-1])
    assert len((tmp_path / "shown.csv").read_text("utf-8").splitlines()) == 3
    assert desk.notices == []


def test_saving_that_is_cancelled_leaves_no_file(
    desk: Desk, tmp_path: Path, hold_back: "HoldBack"
) -> None:
    desk.enter(3)
    desk.open()
    desk.show_tab(WHOLE)
    folder = tmp_path / "saved"
    folder.mkdir()
    panel, n_said = desk.child(ArchivePanel), len(desk.statuses)
    may_go_on = hold_back("lightpen.archive.history.newest")

    desk.click("Save listed entries (CSV)...")
    desk.choose_file(folder / "entries")
    desk.until(may_go_on.is_reached.is_set)
    desk.click("Cancel")
    may_go_on.set()
    desk.wait_idle()
    QThreadPool.globalInstance().waitForDone()

    assert not panel.progress.is_running
    assert list(folder.iterdir()) == []
    assert (desk.notices, desk.statuses[n_said:]) == ([], [])


@pytest.mark.slow
def test_no_trend_is_left_of_what_is_no_longer_looked_for(desk: Desk) -> None:
    desk.enter(3)
    desk.open()
    panel = desk.child(TrendPanel)
    desk.until(lambda: len(panel.value().entries) == 3)
    QTest.keyClicks(desk.child(DateField), "2030-01-01")
    desk.until(lambda: desk.statuses[-1] == "0 entries")

    assert panel.value().entries == ()
    assert panel.words().startswith("Select an entry with a tip to see its trend.")
