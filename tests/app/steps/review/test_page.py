"""The step Review: from the verdict to the accepted tip, and every way back."""

import json
import re
import shutil
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import numpy as np
import pyqtgraph as pg
import pytest
from benchmarks.small_records import small_record
from PySide6.QtCore import QEvent, QPoint, QPointF, Qt, QThreadPool, QUrl
from PySide6.QtGui import QMouseEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QApplication,
    QCheckBox,
    QComboBox,
    QFileDialog,
    QLabel,
    QLineEdit,
    QMenu,
    QPushButton,
    QTabBar,
    QTabWidget,
    QWidget,
)
from pytestqt.qtbot import QtBot
from tests.app.patience import PATIENCE_MS
from tests.app.pictures import coordinates_of, data_of
from tests.app.typed_numbers import type_number
from tests.app.undressed import undressed
from tests.simulated_plans import still_view

from lightpen.arrays import FloatArray
from lightpen.detection.pen_detection import detect_pen
from lightpen.detection.reasons import Reason
from lightpen.errors import CalibrationError
from lightpen.estimation.reports.report_warnings import result_of
from lightpen.estimation.reports.verdict import Grade
from lightpen.formats.opened_files import CameraFile, PenFile
from lightpen.model.limits import SwingLimits
from lightpen.model.names import Laboratory, Origin
from lightpen.record.library.library_changes import Author, add_item
from lightpen.record.library.tip_library import ListedTip
from lightpen.record.results.results import Result
from lightpen.record.swings.header import Names
from lightpen.record.swings.reading import DISCARDED, Record, open_record
from lightpen.record.swings.solving import Solution, solve_again, solve_record, source
from lightpen.record.swings.writing import RecordWriter
from lightpen.swing.capture.state import SwingState
from lightpen.swing.preparation import Preparation
from lightpen.swing.swing_recorder import (
    Resumable,
    read_resumable,
    record_header,
    recorded_setup,
)
from lightpen_app.look.languages import LanguageSwitch
from lightpen_app.look.theme import Tone
from lightpen_app.steps.review.image_table import ImageTable
from lightpen_app.steps.review.images_panel import ImagesPanel
from lightpen_app.steps.review.page import ReviewPage
from lightpen_app.steps.review.plots_panel import MethodsPanel
from lightpen_app.steps.review.residual_plots import MisfitPlot, ResidualView
from lightpen_app.steps.review.result_panel import (
    ResultPanel,
    StatusMessageList,
    TipReadout,
    TipSummary,
    TipValue,
)
from lightpen_app.widgets.bars import JobProgress, QuestionBar, ReasonBar, WithdrawalBar
from lightpen_app.widgets.controls import PushButton
from lightpen_app.widgets.figure import Figure
from lightpen_app.widgets.number_field import NumberField
from lightpen_app.widgets.page import MainAction
from lightpen_app.widgets.result_plots import BarPlot
from lightpen_app.widgets.state_banner import SignLabel, State, StateBanner
from lightpen_app.widgets.tables import NumberTable
from lightpen_app.work.workbench import Workbench
from lightpen_extensions.simulator.image_plans import ImagePlan, render_plan
from lightpen_extensions.simulator.scene_files import write_sample_files
from lightpen_extensions.simulator.scenes import Scene
from lightpen_extensions.simulator.swings import (
    PAPER_TIP,
    Postures,
    swing_from_postures,
)
from lightpen_program.extensions import faces

if TYPE_CHECKING:
    from tests.app.conftest import SolvingOn

W = TypeVar("W", bound=QWidget)

LEFT = Qt.MouseButton.LeftButton
N_IMAGES = 20
DAMAGED = 7
SLIPPED = 9
TURNED = 13
THEN = datetime.now().astimezone() - timedelta(days=99)


@pytest.fixture(scope="session")
def recorded(small_scene: Scene, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Record a swing that leans to all sides; copy it before it is changed."""
    return record_swing(small_scene, tmp_path_factory.mktemp("recorded"))


def record_swing(
    small_scene: Scene, folder: Path, turned: FloatArray | None = None
) -> Path:
    """Record a swing in whose last images the tip is ``turned`` by so much, mm."""
    files = write_sample_files(small_scene, folder / "files")
    preparation = Preparation(
        names=Names("Hall 2", "Ann", "LP-04", "T-10", "C-1", 10.0),
        camera_file=CameraFile.read(files.camera),
        pen_file=PenFile.read(files.pen),
        limits=SwingLimits(min_images=N_IMAGES),
    )
    camera, pen = small_scene.camera, small_scene.pen
    tilts = np.radians([2.0, 15.0, 28.0]).repeat(8)[4:]
    directions = np.radians(np.tile(np.arange(0, 360, 45), 3))[4:]
    turns = np.radians(np.resize([-25.0, 0.0, 25.0], N_IMAGES))
    swing = swing_from_postures(Postures(tilts, directions, turns))
    if turned is not None:
        swing.translations[TURNED:] -= swing.rotations[TURNED:] @ turned
    with RecordWriter.create(folder / "swing", record_header(preparation)) as writer:
        for i in range(N_IMAGES):
            R, t = swing.rotations[i], swing.translations[i]
            image_plan = ImagePlan(i, still_view(pen, R, t), small_scene.optics, R, t)
            image = render_plan(small_scene, image_plan)
            seen = detect_pen(image, camera, pen)
            writer.append(image, seen.pixels, seen.rotation, seen.translation, 0.1 * i)
    return folder / "swing"


class SolvedOnce:
    """Reads and solves each swing once, however often it is copied."""

    def __init__(self) -> None:
        self._resumed: dict[str, SwingState] = {}
        self._solved: dict[str, Solution] = {}

    def read(self, folder: Path) -> Resumable:
        """Return a swing as `read_resumable` does."""
        content = content_of(folder)
        if content not in self._resumed:
            self._resumed[content] = read_resumable(folder).state
        record = open_record(folder)
        return Resumable(record, recorded_setup(record), self._resumed[content])

    def solve(
        self, record: Record, report: Callable[[float], None] = lambda fraction: None
    ) -> Solution:
        """Return a solution as `solve_record` does."""
        content = content_of(record.folder)
        if content not in self._solved:
            self._solved[content] = solve_record(record, report)
        return replace(self._solved[content], source=source(record))


def content_of(folder: Path) -> str:
    """Return the checksum of all that state and tip of a swing depend on."""
    header = json.loads((folder / "header.json").read_bytes())
    del header["checksum"]
    for judged_by in ("limits", "origin"):
        del header[judged_by]
    checksum = sha256(json.dumps(header).encode())
    for file in sorted(folder.rglob("*")):
        if file.is_file() and file.name != "header.json":
            checksum.update(file.name.encode() + file.read_bytes())
    return checksum.hexdigest()


@dataclass(frozen=True)
class Bed:
    """Shows the page of a swing that was solved."""

    qtbot: QtBot
    workbench: Workbench
    swing: Path
    pages: list[ReviewPage]
    rewrite_header: Callable[..., None]
    solved_once: SolvedOnce
    origin: Origin = Origin.LIVE

    def solve(self, limit: float = 0.05) -> Workbench:
        """Solve the swing, with a limit of U, mm."""
        workbench = self.workbench
        folder = workbench.run.records_folder / "swing"
        limits = {"max_uncertainty": limit}
        self.rewrite_header(folder, limits=limits, origin=self.origin)
        before = workbench.run.status.assessment
        resumable = self.solved_once.read(folder)
        workbench.run.runner.ask(lambda workflow: workflow.continue_swing(resumable))
        workbench.run.runner.ask(lambda workflow: workflow.finish())
        self.qtbot.waitUntil(
            lambda: workbench.run.status.assessment not in (None, before)
        )
        return workbench

    def solve_uncertain(self) -> Workbench:
        """Solve the swing with a limit that its U is beyond."""
        solution = self.solve().run.status.solution
        assert solution is not None
        return self.solve(0.7 * solution.calibration.budget.weakest_uncertainty)

    def solve_after(self, difference: Sequence[float], pen: str = "LP-04") -> Workbench:
        """Solve the swing after another tip, so far away, was put in force, mm."""
        tip_then = tip(self.solve()) - difference
        put_in_force(self.workbench, tip_then, pen)
        return self.solve()

    def show(self) -> ReviewPage:
        """Show the page."""
        with undressed():
            services = [make(self.workbench) for make in faces()]
            page = ReviewPage(self.workbench, services)
        self.pages.append(page)
        self.qtbot.addWidget(page)
        page.resize(1000, 600)
        page.show()
        page.entered()
        choose_tab(page, "Images")
        self.qtbot.waitUntil(lambda: the(page, ResultPanel).value() is not None)
        self.qtbot.waitUntil(lambda: not is_unread(page))
        return page


@pytest.fixture(scope="module")
def solved_once() -> SolvedOnce:
    return SolvedOnce()


@pytest.fixture
def bed(
    qtbot: QtBot,
    workbench: Workbench,
    recorded: Path,
    rewrite_header: Callable[..., None],
    solved_once: SolvedOnce,
    monkeypatch: pytest.MonkeyPatch,
) -> Iterator[Bed]:
    """Lay a recorded swing ready."""
    monkeypatch.setattr("lightpen.swing.solving.solve_record", solved_once.solve)
    folder = workbench.run.records_folder / "swing"
    shutil.copytree(recorded, folder)
    bed = Bed(qtbot, workbench, folder, [], rewrite_header, solved_once)
    yield bed
    for page in bed.pages:
        page.shut_down()
    QThreadPool.globalInstance().waitForDone(PATIENCE_MS)


@pytest.fixture
def page(bed: Bed) -> ReviewPage:
    """Return the page of a good swing."""
    bed.solve()
    return bed.show()


def is_unread(page: ReviewPage) -> bool:
    return page.main_action().why_not == "Read the result first."


def the(parent: QWidget, kind: type[W]) -> W:
    """Return the only child of a kind."""
    children = parent.findChildren(kind)
    (found,) = [
        each
        for each in children
        if kind is WithdrawalBar or not isinstance(each, WithdrawalBar)
    ]
    return found


def texts_of(panel: ResultPanel) -> list[str]:
    labels = panel.findChildren(SignLabel)
    return [each.value().text for each in labels if not each.isHidden()]


def banner(page: ReviewPage) -> State:
    return the(page, StateBanner).value()


def table(page: ReviewPage) -> ImageTable:
    return the(page, ImageTable)


def remarks(page: ReviewPage) -> str:
    return " ".join(remark.text for remark in the(page, StatusMessageList).value())


def button(page: ReviewPage, text: str) -> QPushButton:
    """Return a button of the page, but for those that answer its questions."""
    asks = [the(page, kind) for kind in (QuestionBar, ReasonBar, WithdrawalBar)]
    return next(
        each
        for each in page.findChildren(QPushButton)
        if each.text() == text and not any(bar.isAncestorOf(each) for bar in asks)
    )


def answer(page: ReviewPage, text: str) -> None:
    found = the(page, QuestionBar).findChildren(QPushButton)
    (chosen,) = [each for each in found if each.text() == text]
    QTest.mouseClick(chosen, Qt.MouseButton.LeftButton)


def give_reason(page: ReviewPage, reason: str) -> None:
    """Click to accept a tip that is to be checked, type why, and press Enter."""
    click(page, "Accept...")
    (edit,) = (
        each
        for each in the(page, ReasonBar).findChildren(QLineEdit)
        if each.isVisible()
    )
    QTest.keyClicks(edit, reason)
    QTest.keyClick(edit, Qt.Key.Key_Return)


def click(page: ReviewPage, text: str) -> None:
    QTest.mouseClick(button(page, text), Qt.MouseButton.LeftButton)


def drag(canvas: QWidget, start: QPoint, end: QPoint) -> None:
    """Draw the mouse over a plot with its button held down."""
    QTest.mousePress(canvas, LEFT, pos=start)
    for share in (0.25, 0.5, 0.75, 1.0):
        place = QPointF(start) + QPointF(end - start) * share
        none = Qt.KeyboardModifier.NoModifier
        seen_at = QPointF(canvas.mapToGlobal(place))
        # That of QTest says of no button that it is held.
        kind = QEvent.Type.MouseMove
        move = QMouseEvent(kind, place, seen_at, Qt.MouseButton.NoButton, LEFT, none)
        QApplication.sendEvent(canvas, move)
    QTest.mouseRelease(canvas, LEFT, pos=end)


def choose_tab(page: ReviewPage, name: str) -> None:
    tabs = the(page, QTabWidget)
    names = [tabs.tabText(i) for i in range(tabs.count())]
    tabs.setCurrentIndex(names.index(name))


def look_at_all_tabs(page: ReviewPage) -> None:
    """Go through the tabs with the keyboard."""
    bar = the(the(page, QTabWidget), QTabBar)
    bar.setFocus()
    for _ in range(bar.count() - 1):
        QTest.keyClick(bar, Qt.Key.Key_Right)


def readout(page: ReviewPage) -> TipValue:
    value = the(page, TipReadout)._value
    assert value is not None
    return value


def reported_of_result(page: ReviewPage) -> str:
    """Return the messages below the figures."""
    signs = the(page, ResultPanel).findChildren(SignLabel)
    return " ".join(sign.value().text for sign in signs)


def included(n_used: int, *others: str) -> str:
    return "; ".join([f"{n_used} of {N_IMAGES} images included", *others])


def count(page: ReviewPage) -> str:
    """Return how many images are included, and why others are not."""
    texts = [sign.value().text for sign in page.findChildren(SignLabel)]
    included = [text for text in texts if text.endswith(" images included")]
    labels = [label.text() for label in the(page, ImagesPanel).findChildren(QLabel)]
    return "; ".join([*included, *filter(re.compile(r"\d+ [a-z]").match, labels)])


def centres(page: ReviewPage) -> list[list[float]]:
    """Return where rings are drawn, px."""
    return [[ring.x, ring.y] for ring in the(page, ResidualView).markers()]


def tip(workbench: Workbench) -> FloatArray:
    assert workbench.run.status.solution is not None
    return workbench.run.status.solution.calibration.joint.tip_pen


def u_x(workbench: Workbench) -> float:
    """U (k = 2) of the tip along x, mm."""
    assert workbench.run.status.solution is not None
    budget = workbench.run.status.solution.calibration.budget
    return float(budget.expanded_uncertainty[0])


def await_count(qtbot: QtBot, page: ReviewPage, words: str) -> None:
    """Wait until the tip is solved from other images than before."""
    qtbot.waitUntil(lambda: count(page) == words and not page.main_action().why_not)


def in_force(workbench: Workbench) -> Result | None:
    names = workbench.selection.preparation.names
    return workbench.run.archive.in_force(names.pen, names.tip)


def put_in_force(
    workbench: Workbench,
    tip_pen: FloatArray,
    pen: str = "LP-04",
    names: Names | None = None,
    origin: Origin | None = None,
    **entries: object,
) -> None:
    """Store a result of some time ago."""
    names = names or replace(workbench.run.status.names, pen=pen)
    tip = {"tip_pen_mm": tip_pen.tolist(), "expanded_uncertainty_mm": 3 * [0.002]}
    calibration = small_record({**tip, **entries})
    record = workbench.run.records_folder / "elsewhere"
    workbench.run.archive.store(
        Result(
            names=names,
            accepted=THEN,
            grade=Grade.PASS,
            record=record,
            images=(),
            calibration=calibration,
            origin=origin,
        )
    )


def slip(swing: Path) -> None:
    """Note of an image that the tip slipped in it."""
    with RecordWriter.resume(open_record(swing)) as writer:
        writer.exclude([SLIPPED], Reason.SLIPPED)


# What is shown


def test_the_step_is_closed_until_the_pen_was_swung(
    qtbot: QtBot, workbench: Workbench
) -> None:
    page = ReviewPage(workbench)
    qtbot.addWidget(page)

    assert page.why_closed() == "Swing the pen first."
    assert page.main_action().why_not == "Swing the pen first."
    assert page.unsaved() == ""
    assert not button(page, "Repeat swing").isEnabled()
    assert button(page, "Repeat swing").toolTip() == "Swing the pen first."
    page.run_main_action()
    assert not page.is_complete()


def test_a_good_swing_passes_with_its_reason_and_the_next_step(
    page: ReviewPage,
) -> None:
    state = banner(page)
    assert state.word == "PASS: Within limits"
    assert re.match(r"U \(k = 2\) of the tip is 0\.\d{4} mm in its", state.detail)
    assert page.lead().startswith("Next: accept the tip.")
    assert page.why_closed() == ""
    assert page.main_action() == MainAction("Accept", at_screen=True)


def test_every_remark_on_the_result_follows_the_language(
    page: ReviewPage, qtbot: QtBot, qapp: QApplication
) -> None:
    before = [label.value().text for label in page.findChildren(SignLabel)]
    LanguageSwitch(qapp).set_language("zh_CN")
    qtbot.wait(20)
    after = [label.value().text for label in page.findChildren(SignLabel)]

    assert any(text.startswith("Bending") for text in before)
    assert [text for text in after if text.isascii() and text] == []


def test_the_tip_is_shown_to_the_digit_of_its_uncertainty(
    page: ReviewPage, workbench: Workbench
) -> None:
    assert workbench.run.status.solution is not None
    uncertainty = workbench.run.status.solution.calibration.budget.expanded_uncertainty
    shown = coordinates_of(the(page, TipReadout))
    for text, value, u in zip(shown, tip(workbench), uncertainty[:3], strict=True):
        number, _, within = text.split()
        assert float(within) == pytest.approx(u, rel=0.05)  # two significant digits
        assert len(number.partition(".")[2]) == len(within.partition(".")[2])
        assert float(number) == pytest.approx(value, abs=0.5 * u)


@pytest.mark.slow
def test_an_uncertain_tip_is_to_be_checked_and_more_images_are_advised(
    bed: Bed,
) -> None:
    workbench = bed.solve_uncertain()
    page = bed.show()

    assert banner(page).word == "CHECK: Uncertainty too large"
    assert page.lead().startswith("Next: capture more images")
    assert page.main_action() == MainAction("Capture more")
    page.run_main_action()
    bed.qtbot.waitUntil(lambda: workbench.run.status.is_capturing)


@pytest.mark.slow
def test_the_settings_are_to_be_checked_where_no_file_makes_the_tip_uncertain(
    bed: Bed,
) -> None:
    folder = bed.workbench.run.records_folder / "swing"
    bed.rewrite_header(folder, assumptions={"form_error": 0.002})
    bed.solve_uncertain()
    page = bed.show()

    assert banner(page).word == "CHECK: Uncertainty too large"
    assert page.lead() == "Next: correct the stated cause, then repeat the swing."
    assert page.main_action() == MainAction("Check settings")
    with bed.qtbot.waitSignal(page.step_requested) as asked:
        page.run_main_action()
    assert asked.args == ["start"]


def test_a_tip_that_is_far_too_uncertain_cannot_be_accepted(bed: Bed) -> None:
    workbench = bed.solve(1e-6)
    page = bed.show()

    assert banner(page).word == "REPEAT: Uncertainty too large"
    assert page.main_action() == MainAction("Capture more")
    assert not button(page, "Accept...").isEnabled()
    assert button(page, "Accept...").toolTip().startswith("Result not acceptable.")
    workbench.run.runner.ask(lambda workflow: workflow.solving.accept("whatever"))
    with bed.qtbot.waitSignal(workbench.notifications.raised) as reported:
        pass
    assert reported.args[0].startswith("The tip cannot be accepted.")
    assert not page.is_complete()
    assert in_force(workbench) is None


def test_the_part_before_a_tip_turned_is_used_by_one_click(
    bed: Bed, small_scene: Scene, tmp_path: Path
) -> None:
    turned = record_swing(small_scene, tmp_path, np.array([0.06, 0.0, -0.08]))
    shutil.rmtree(bed.swing)
    shutil.copytree(turned, bed.swing)
    workbench = bed.solve()
    page = bed.show()

    assert banner(page).word == "REPEAT: Moved during the swing"
    assert f"before image {TURNED + 1}. Images 1 to {TURNED}" in banner(page).detail
    assert page.main_action() == MainAction("Use longer part")
    page.run_main_action()

    left_out = f"{N_IMAGES - TURNED} outside the part that is used"
    await_count(bed.qtbot, page, included(TURNED, left_out))
    assert np.linalg.norm(tip(workbench) - PAPER_TIP) < 0.01
    assert banner(page).word == "CHECK: More images"


def test_one_number_is_large_and_the_page_has_one_unit(
    page: ReviewPage, workbench: Workbench
) -> None:
    page.resize(1040, 640)
    solution, setup = workbench.run.status.solution, workbench.run.status.setup
    assert solution is not None
    assert setup is not None
    summary = the(page, TipSummary)
    labels = [label for label in summary.findChildren(QLabel) if label.isVisible()]
    largest = max(labels, key=lambda label: label.fontMetrics().height())
    u = solution.calibration.budget.weakest_uncertainty
    limit = setup.limits.max_uncertainty

    assert largest.text() == f"{u:.4f} mm"
    assert f"limit {limit:.4f} mm" in [label.text() for label in labels]
    tabs = the(page, QTabWidget)
    assert not tabs.isAncestorOf(summary)
    for index in range(tabs.count()):
        tabs.setCurrentIndex(index)
        shown = [each for each in page.findChildren(QLabel) if each.isVisible()]
        figures = [each for each in page.findChildren(Figure) if each.isVisible()]
        words = [each.text() for each in shown]
        words += [each.accessibleName() for each in figures]
        assert not [text for text in words if "\u00b5m" in text]


def test_without_an_earlier_result_that_is_reported(page: ReviewPage) -> None:
    assert readout(page).previous == readout(page).change == ()
    assert "No earlier result" in reported_of_result(page)
    assert page.lead() == "Next: accept the tip."  # none is in force until then
    figure = r"-?0\.\d{4}\s\u00b1\s0\.\d{4}"
    figures = f"x\\s{figure}, y\\s{figure}, z\\s{figure}\u00a0mm"
    agree = f"Odd and even images agree: {figures}"
    assert re.search(agree, reported_of_result(page)), reported_of_result(page)
    assert remarks(page) == ""


def test_a_small_change_since_the_last_result_is_reported_in_the_unit_of_the_page(
    bed: Bed,
) -> None:
    u = u_x(bed.solve())
    bed.solve_after([1.0, 1.0, 1.0], pen="another")
    bed.solve_after([0.5 * u, 0.0, 0.0])
    page = bed.show()

    shown = readout(page)
    assert shown.since == f"{THEN:%Y-%m-%d}"
    x, y, z = (float(each.split()[0]) for each in shown.change)
    assert (x, y, z) == pytest.approx((0.5 * u, 0.0, 0.0), abs=0.0005)
    assert banner(page).word == "PASS: Within limits"


def test_a_change_that_u_does_not_explain_is_to_be_checked(bed: Bed) -> None:
    bed.solve_after([0.42, 0.0, 0.0])
    page = bed.show()

    assert banner(page).word == "CHECK: Tip has changed"
    assert banner(page).detail.startswith(
        f"The tip changed by 0.4200 mm since {THEN:%Y-%m-%d}: along x 0.4200 mm"
    )
    assert page.lead().startswith(
        "Next: check that the right tip is fitted, clean and tight, then repeat the "
        "swing."
    )
    assert page.main_action() == MainAction("Repeat swing")


def test_the_result_says_which_tip_it_is_of(bed: Bed, workbench: Workbench) -> None:
    bed.solve()
    page = bed.show()
    texts = [each.text() for each in page.findChildren(QLabel)]
    assert "Tip T-10 in the frame of pen LP-04 / mm, U\xa0(k\xa0=\xa02)" in texts
    assert remarks(page) == ""

    names = replace(workbench.selection.preparation.names, tip="T-11")
    workbench.selection.set_preparation(
        replace(workbench.selection.preparation, names=names)
    )
    page.left()
    page.entered()

    assert remarks(page) == (
        "This swing belongs to tip T-10, pen LP-04; the step Start now shows "
        "tip T-11, pen LP-04."
    )


@pytest.mark.slow
def test_a_tip_far_from_its_nominal_place_is_asked_about(bed: Bed) -> None:
    bed.rewrite_header(bed.swing, nominal_tip_mm=[3.0, -90.0, -20.0])
    bed.solve()

    said = remarks(bed.show())
    assert re.search(r"The tip is \d\.\d mm from its nominal centre", said)


def test_what_comes_into_force_meanwhile_is_compared_before_it_is_replaced(
    bed: Bed,
) -> None:
    workbench = bed.solve()
    page = bed.show()
    put_in_force(workbench, tip(workbench) - [0.42, 0.0, 0.0])
    with bed.qtbot.waitSignal(workbench.notifications.raised) as reported:
        page.run_main_action()

    assert "Enter a reason to accept it." in reported.args[0]
    bed.qtbot.waitUntil(lambda: banner(page).word == "CHECK: Tip has changed")
    assert not page.is_complete()
    assert button(page, "Accept...").isVisibleTo(page)


# Accepting with a reason, and taking back


def test_a_tip_to_be_checked_is_accepted_with_a_reason_and_stays_amber(
    bed: Bed,
) -> None:
    workbench = bed.solve_after([0.42, 0.0, 0.0])
    page = bed.show()
    give_reason(page, "New ball mounted.")
    bed.qtbot.waitUntil(page.is_complete)

    result = in_force(workbench)
    assert result is not None
    assert (result.grade, result.reason) == (Grade.CHECK, "New ball mounted.")
    assert result.change is not None
    assert result.change.difference_mm[0] == pytest.approx(0.42)
    state = banner(page)
    assert (state.word, state.tone) == ("ACCEPTED", Tone.WARN)
    assert "New ball mounted." in state.detail
    assert page.is_doubtful()


def test_without_a_reason_a_tip_to_be_checked_is_not_accepted(bed: Bed) -> None:
    workbench = bed.solve_after([0.42, 0.0, 0.0])
    page = bed.show()
    give_reason(page, "  ")

    bar = the(page, ReasonBar)
    (give,) = [
        each
        for each in bar.findChildren(QPushButton)
        if each.text() == "Accept with reason"
    ]
    assert bar.isVisibleTo(page)
    assert not give.isEnabled()
    (decline,) = [
        each for each in bar.findChildren(QPushButton) if each.text() == "Do not accept"
    ]
    QTest.mouseClick(decline, Qt.MouseButton.LeftButton)
    assert not bar.isVisibleTo(page)
    found = in_force(workbench)
    assert found is not None
    assert found.accepted == THEN


def test_an_acceptance_is_taken_back_and_the_tip_before_is_in_force(bed: Bed) -> None:
    workbench = bed.solve_after([0.42, 0.0, 0.0])
    page = bed.show()
    give_reason(page, "New ball mounted.")
    bed.qtbot.waitUntil(page.is_complete)
    click(page, "Revoke acceptance...")
    edit = the(page, WithdrawalBar).findChildren(QLineEdit)[0]
    QTest.keyClicks(edit, "Wrong pen.")
    QTest.keyClick(edit, Qt.Key.Key_Return)
    bed.qtbot.waitUntil(lambda: not page.is_complete())

    found = in_force(workbench)
    assert found is not None
    assert found.accepted == THEN
    assert banner(page).word == "CHECK: Tip has changed"
    assert len(list(workbench.run.archive.folder.glob("*.json"))) == 3
    assert "Acceptance revoked." in page.unsaved()
    assert ") are saved;" not in page.unsaved()


def test_the_tip_as_found_is_reported_against_its_limit(bed: Bed) -> None:
    listed = ListedTip(id="T-10", max_change_mm=0.05)
    add_item(bed.workbench.folder, listed, Author(), THEN)
    bed.solve_after([0.0, 0.06, 0.08])

    remarks = [each.value() for each in bed.show().findChildren(SignLabel)]
    (found,) = [each for each in remarks if each.text.startswith("As found")]
    assert re.fullmatch(
        r"As found: 0\.100\d* mm from the previous calibration, limit 0\.05 mm",
        found.text,
    )
    assert found.tone is Tone.WARN


@pytest.mark.slow
def test_of_practice_no_older_tip_is_said_to_stay_in_force(bed: Bed) -> None:
    reported = "Until then the previous result remains current."
    bed.solve_after([0.0, 0.0, 0.001])
    assert reported in bed.show().lead()

    practice = replace(bed, origin=Origin.SIMULATED)
    tip_then = tip(practice.solve())
    put_in_force(practice.workbench, tip_then, origin=Origin.SIMULATED)
    practice.solve()
    status = practice.workbench.run.status
    assert status.assessment is not None
    assert status.assessment.last is not None
    assert reported not in practice.show().lead()


# What is taken along


def test_the_tip_is_copied_in_millimetres(
    page: ReviewPage, workbench: Workbench
) -> None:
    click(page, "Copy tip")

    copied = QApplication.clipboard().text().split("\t")
    assert list(map(float, copied)) == tip(workbench).tolist()


def test_the_folder_of_the_swing_is_opened(
    bed: Bed, monkeypatch: pytest.MonkeyPatch
) -> None:
    opened: list[str] = []
    can_show = True

    def open_url(url: QUrl) -> bool:
        opened.append(url.toLocalFile())
        return can_show

    monkeypatch.setattr("PySide6.QtGui.QDesktopServices.openUrl", open_url)
    bed.solve()
    page = bed.show()
    reported: list[str] = []
    bed.workbench.notifications.status_changed.connect(reported.append)

    choose(page, "Open folder")
    assert opened == [str(bed.swing)]
    assert reported[-1] == ""

    can_show = False
    choose(page, "Open folder")
    assert reported[-1] == f"No file manager found. Folder: {bed.swing}"


def choose(page: ReviewPage, what: str) -> None:
    """Choose from the menu of the button that saves."""
    menus = button(page, "Save...").findChildren(QMenu)
    actions = [each for menu in menus for each in menu.actions()]
    (action,) = [each for each in actions if each.text() == what]
    action.trigger()


def save(bed: Bed, page: ReviewPage, what: str, folder: Path) -> None:
    """Choose what to save from the menu, and the folder."""
    choose(page, what)
    (dialog,) = [d for d in page.findChildren(QFileDialog) if d.isVisible()]
    with bed.qtbot.waitSignal(bed.workbench.notifications.status_changed):
        dialog.fileSelected.emit(str(folder))
    dialog.close()


@pytest.mark.slow
def test_all_is_saved_at_once_under_pen_tip_and_date_and_nothing_overwritten(
    bed: Bed, tmp_path: Path
) -> None:
    workbench = bed.solve()
    page = bed.show()
    folder = tmp_path / "saved"
    folder.mkdir()
    for _ in range(2):
        save(bed, page, "Record and tables...", folder)

    stem = f"LP-04_T-10_{workbench.around.now():%Y-%m-%d}"
    names = {path.name for path in folder.iterdir()}
    assert all(name.startswith(stem) for name in names)
    for end in ("calibration", "calibration-2"):
        written = json.loads((folder / f"{stem}_{end}.json").read_bytes())
        assert written["tip_pen_mm"] == tip(workbench).tolist()
        assert written["origin"] == "live camera"
    rows = (folder / f"{stem}_images.csv").read_text().splitlines()
    assert len(rows) == N_IMAGES + 1
    assert "live camera" in (folder / f"{stem}_tip.csv").read_text()
    assert workbench.settings.last().export_folder == str(folder)


def test_all_formats_are_offered_and_a_certificate_asks_for_the_laboratory(
    bed: Bed, tmp_path: Path
) -> None:
    from lightpen_app_extensions.exports.laboratory_dialog import LaboratoryDialog
    from lightpen_extensions.exports.formats import FORMATS

    workbench = bed.solve()
    page = bed.show()
    menus = button(page, "Save...").findChildren(QMenu)
    actions = {each.text(): each for menu in menus for each in menu.actions()}
    first = [each.text() for each in menus[0].actions() if each.text()]
    assert first[0] == "Calibration report..."
    assert first[3:] == ["Other formats", "Open folder"]
    assert {f"{each.label}..." for each in FORMATS} <= set(actions)

    actions["Digital Calibration Certificate (XML)..."].trigger()
    (dialog,) = page.findChildren(LaboratoryDialog)
    (save_button,) = [
        each for each in dialog.findChildren(QPushButton) if each.text() == "Save..."
    ]
    edits = dialog.findChildren(QLineEdit)
    for edit, text in zip(
        edits, ("Hall 2", "a@b.de", "Berlin", "Germany", "", "", "WI 7"), strict=True
    ):
        edit.setText(text)
    assert not save_button.isEnabled()
    edits[3].setText("DE")
    dialog.findChildren(QComboBox)[0].setCurrentIndex(1)
    save_button.click()
    (folder_dialog,) = [d for d in page.findChildren(QFileDialog) if d.isVisible()]
    with bed.qtbot.waitSignal(workbench.notifications.status_changed):
        folder_dialog.fileSelected.emit(str(tmp_path))
    folder_dialog.close()

    (written,) = tmp_path.glob("*_dcc.xml")
    assert "<dcc:city>Berlin</dcc:city>" in written.read_text("utf-8")
    assert "LP-04" in written.read_text("utf-8")
    laboratory = Laboratory(
        *("Hall 2", "a@b.de", "Berlin", "DE"), procedure="WI 7", place="customer"
    )
    assert workbench.settings.last().laboratory == laboratory


@pytest.mark.slow
def test_the_change_since_nominal_is_shown_where_it_is_known(bed: Bed) -> None:
    bed.rewrite_header(bed.swing, nominal_tip_mm=[-1.0, -90.0, -24.0])
    workbench = bed.solve()
    page = bed.show()

    deviation = tip(workbench) - [-1.0, -90.0, -24.0]
    shown = list(map(float, readout(page).deviation))
    assert shown == pytest.approx(deviation.tolist(), abs=1e-3)
    assert readout(page).nominal == ("-1.0000", "-90.0000", "-24.0000")


@pytest.mark.slow
def test_the_budget_is_checked_by_monte_carlo_on_request(
    page: ReviewPage, qtbot: QtBot
) -> None:
    from lightpen_app_extensions.comparisons.monte_carlo_row import MonteCarloRow

    choose_tab(page, "Uncertainty")
    row = the(page, MonteCarloRow)
    type_number(the(row, NumberField), 20)
    start = button(page, "Monte Carlo check")
    (cancel,) = the(row, JobProgress).findChildren(PushButton)
    start.click()
    figures, progress = the(row, NumberTable), the(row, JobProgress)
    qtbot.waitUntil(lambda: figures.isVisibleTo(page), timeout=PATIENCE_MS)
    found = figures.value()

    type_number(the(row, NumberField), 5000)
    start.click()
    qtbot.waitUntil(lambda: progress.words()[:2] != "0%", timeout=PATIENCE_MS)
    cancel.click()
    QThreadPool.globalInstance().waitForDone()
    QApplication.processEvents()
    assert start.isVisibleTo(page)
    assert not progress.isVisible()
    assert figures.isVisibleTo(page)
    assert figures.value() == found
    by_trials, _, by_budget, difference = figures.value().cells
    for one, other, in_precision in zip(by_trials, by_budget, difference, strict=True):
        # Of 20 trials a standard deviation is known to a sixth.
        assert abs(float(in_precision)) < 4
        assert 0.4 < float(one) / float(other) < 2.0


# Images


@pytest.mark.slow
def test_images_are_listed_worst_first_with_their_reasons(bed: Bed) -> None:
    (bed.swing / "images" / f"{DAMAGED:06d}.png").write_bytes(b"no image")
    slip(bed.swing)
    bed.solve()
    page = bed.show()

    model = table(page).model()
    rows = [
        [model.index(row, column).data() for column in range(4)]
        for row in range(model.rowCount())
    ]
    assert rows[0] == [str(DAMAGED), "", "0", "unreadable"]
    states = {number: state for number, _, _, state in rows}
    assert states[str(SLIPPED)] == "tip slipped"
    misfits = [float(misfit) for _, misfit, _, _ in rows[1:]]
    assert misfits == sorted(misfits, reverse=True)
    assert count(page) == included(N_IMAGES - 2, "1 unreadable", "1 tip slipped")

    table(page).choose(SLIPPED)  # which may be put back
    click(page, "Include")
    await_count(bed.qtbot, page, included(N_IMAGES - 1, "1 unreadable"))


def test_the_chosen_image_is_shown_with_its_leds_and_residuals(
    page: ReviewPage, workbench: Workbench, qtbot: QtBot
) -> None:
    table(page).choose(3)

    assert workbench.run.status.solution is not None
    points = workbench.run.status.solution.observations.seen_pixels[2]
    seen = points[np.isfinite(points[:, 0])].tolist()
    qtbot.waitUntil(lambda: centres(page) == seen)
    shown = the(page, ResidualView)
    assert (
        shown.image_size().width() == workbench.run.status.solution.source.camera.width
    )
    assert len(shown._arrows.residuals) == len(seen)
    assert shown._zoom > 1  # the pen fills the view
    assert data_of(the(page, MisfitPlot), pg.ScatterPlotItem)[0] == [3]


def test_of_images_passed_over_quickly_the_last_is_shown(
    page: ReviewPage, workbench: Workbench, qtbot: QtBot
) -> None:
    for _ in range(8):
        QTest.keyClick(table(page), Qt.Key.Key_Down)
    number = table(page).number()

    assert number == table(page).value()[8].number
    assert workbench.run.status.solution is not None
    points = workbench.run.status.solution.observations.seen_pixels[number - 1]
    seen = points[np.isfinite(points[:, 0])].tolist()
    qtbot.waitUntil(lambda: centres(page) == seen)


def test_the_image_of_another_record_takes_the_place_of_one_of_the_same_number(
    page: ReviewPage, workbench: Workbench, qtbot: QtBot
) -> None:
    panel, view = the(page, ImagesPanel), the(page, ResidualView)
    qtbot.waitUntil(lambda: bool(view.markers()))
    solution, number = workbench.run.status.solution, table(page).number()
    assert solution is not None
    other = replace(solution, source=replace(solution.source))

    panel.set_value(other)
    assert table(page).number() == number
    assert view.image_size().isEmpty()
    panel.set_value(replace(other, source=replace(other.source)))  # while it is read

    qtbot.waitUntil(lambda: not view.image_size().isEmpty())
    assert table(page).number() == number
    assert view.markers()


def test_of_another_swing_the_worst_image_is_shown_first(
    page: ReviewPage, workbench: Workbench
) -> None:
    panel, solution = the(page, ImagesPanel), workbench.run.status.solution
    assert solution is not None
    worst = table(page).value()[0].number
    table(page).choose(table(page).value()[4].number)
    panel.set_value(solution)
    assert table(page).number() != worst  # it stays chosen

    source = replace(solution.source, folder=solution.source.folder / "other")
    panel.set_value(replace(solution, source=source))
    assert table(page).number() == worst
    assert len(table(page).selected()) == 1


def test_a_bug_while_an_image_is_read_is_reported_and_other_images_are_shown(
    bed: Bed, monkeypatch: pytest.MonkeyPatch
) -> None:
    caught: list[BaseException] = []
    monkeypatch.setattr("sys.excepthook", lambda _, error, __: caught.append(error))
    bed.solve()
    with monkeypatch.context() as broken:
        broken.setattr(
            "lightpen_app.steps.review.images_panel.load_image", lambda *_: 1 / 0
        )
        page = bed.show()
        view, numbers = the(page, ResidualView), table(page)
        bed.qtbot.waitUntil(
            lambda: "Image not available" in view.accessibleDescription()
        )
    assert isinstance(caught[0], ZeroDivisionError)
    assert view.image_size().isEmpty()
    first = numbers.number()

    for key in (Qt.Key.Key_Down, Qt.Key.Key_Up):
        QTest.keyClick(numbers, key)
        bed.qtbot.waitUntil(lambda: bool(view.markers()))
    bed.qtbot.waitUntil(lambda: not view.image_size().isEmpty())
    assert numbers.number() == first
    assert "Image not available" not in view.accessibleDescription()


def test_a_click_on_the_misfit_chooses_the_image(
    page: ReviewPage, qtbot: QtBot
) -> None:
    the(page, MisfitPlot).number_chosen.emit(11)

    assert table(page).number() == 11


@pytest.mark.slow
def test_keys_take_several_images_out_and_put_them_back(
    page: ReviewPage, workbench: Workbench, qtbot: QtBot
) -> None:
    table(page).setFocus()
    shift = Qt.KeyboardModifier.ShiftModifier
    for _ in range(2):
        QTest.keyClick(table(page), Qt.Key.Key_Down, shift)
    three_fewer = included(N_IMAGES - 3, "3 excluded manually")

    QTest.keyClick(table(page), Qt.Key.Key_Delete)
    await_count(qtbot, page, three_fewer)
    assert len(table(page).selected()) == 3
    QTest.keyClick(table(page), Qt.Key.Key_Insert)
    await_count(qtbot, page, included(N_IMAGES))


def test_an_image_that_cannot_be_read_says_why_and_cannot_be_put_back(bed: Bed) -> None:
    (bed.swing / "images" / f"{DAMAGED:06d}.png").write_bytes(b"no image")
    bed.solve()
    page = bed.show()

    assert table(page).number() == DAMAGED
    assert not button(page, "Include").isEnabled()
    why = "Excluded automatically: unreadable"
    assert button(page, "Include").toolTip() == why
    assert not button(page, "Exclude").isEnabled()
    view = the(page, ResidualView)
    bed.qtbot.waitUntil(lambda: "wrong checksum" in view.accessibleDescription())
    assert view.image_size().isEmpty()


def test_a_computation_shows_its_progress_and_can_be_cancelled(
    bed: Bed, monkeypatch: pytest.MonkeyPatch, solving_on: "SolvingOn"
) -> None:
    monkeypatch.setattr("lightpen_app.steps.review.view.PATIENCE_MS", 0)
    workbench = bed.solve()
    page = bed.show()
    before = workbench.run.status.solution

    with solving_on():
        workbench.run.runner.ask(lambda workflow: workflow.solving.solve())
        bed.qtbot.waitUntil(lambda: button(page, "Cancel").isVisible())
        click(page, "Cancel")
        bed.qtbot.waitUntil(lambda: not workbench.run.status.is_solving)

    assert not button(page, "Cancel").isVisible()
    assert workbench.run.status.solution is before
    assert page.main_action().why_not == ""


# Plots


@pytest.mark.slow
def test_the_two_stage_method_stands_beside_the_joint_fit(
    page: ReviewPage, workbench: Workbench
) -> None:
    look_at_all_tabs(page)
    shown = the(the(page, MethodsPanel), NumberTable).value()
    rows = dict(zip(shown.rows, shown.cells, strict=True))

    assert workbench.run.status.solution is not None
    calibration = workbench.run.status.solution.calibration
    joint = [float(cell) for cell in rows["Joint fit"][:3]]
    paper = [float(cell) for cell in rows["Two-stage (paper)"][:3]]
    assert joint == pytest.approx(calibration.joint.tip_pen.tolist(), abs=1e-3)
    assert paper == pytest.approx(calibration.two_stage.tip_pen.tolist(), abs=1e-3)
    assert float(rows["Two-stage (paper)"][3]) == pytest.approx(
        calibration.two_stage.rms, abs=1e-4
    )


@pytest.mark.slow
def test_the_two_stage_tip_can_be_reported_and_stays_chosen_at_the_station(
    bed: Bed,
) -> None:
    solution = bed.solve().run.status.solution
    assert solution is not None
    found = solution.calibration
    paper = result_of(found, "two-stage").budget.weakest_uncertainty
    run = bed.solve(0.9 * paper).run
    page, choices = bed.show(), bed.workbench.selection
    look_at_all_tabs(page)
    box = the(the(page, MethodsPanel), QCheckBox)
    assert not box.isChecked()

    box.click()

    bed.qtbot.waitUntil(lambda: banner(page).word == "CHECK: Two-stage tip uncertain")
    shown = the(page, ResultPanel).value()
    assert shown is not None
    np.testing.assert_allclose(shown.tip_pen, found.two_stage.tip_pen)
    station = choices.preparation.names.station
    assert bed.workbench.settings.station(station).method == "two-stage"

    assert page.main_action().text == "Report joint fit"
    page.run_main_action()

    bed.qtbot.waitUntil(lambda: not box.isChecked())
    assert run.status.solution is not None
    assert run.status.solution.calibration.method == "joint"
    assert choices.preparation.method == "joint"


# What next


def accept(page: ReviewPage, qtbot: QtBot) -> None:
    """Press the main button, and wait until the tip is in force."""
    page.run_main_action()
    qtbot.waitUntil(page.is_complete)


def test_an_accepted_tip_is_in_force_and_said_to_be(
    page: ReviewPage, workbench: Workbench, qtbot: QtBot
) -> None:
    assert page.unsaved().startswith("Tip not accepted.")
    assert in_force(workbench) is None

    accept(page, qtbot)

    result = in_force(workbench)
    assert result is not None
    np.testing.assert_array_equal(result.tip_pen, tip(workbench))
    state = banner(page)
    assert state.word == "ACCEPTED"
    assert f"{result.accepted.astimezone():%Y-%m-%d %H:%M}" in state.detail
    assert page.is_complete()
    assert page.unsaved() == ""
    assert "No earlier result" in reported_of_result(page)  # not compared with itself
    assert open_record(workbench.run.records_folder / "swing").verdict == Grade.PASS


@pytest.mark.slow
def test_the_record_on_paper_is_of_the_result_on_the_disk(
    page: ReviewPage, bed: Bed, qtbot: QtBot
) -> None:
    from lightpen_app_extensions.report.control import PrintReportWindow

    entry = next(
        action
        for menu in page.findChildren(QMenu)
        for action in menu.actions()
        if action.text() == "Calibration report..."
    )
    assert not entry.isEnabled()
    assert entry.toolTip().startswith("Accept the tip first")

    accept(page, qtbot)
    entry.trigger()
    qtbot.waitUntil(lambda: bool(page.findChildren(PrintReportWindow)))

    window = the(page, PrintReportWindow)
    qtbot.waitUntil(lambda: window._pages.pageCount() > 2)
    window.close()


def test_a_press_test_begins_a_swing_and_stands_below_the_tip(
    page: ReviewPage, workbench: Workbench, qtbot: QtBot
) -> None:
    pytest.importorskip("lightpen_extensions.comparisons")
    run = workbench.run
    first = run.status
    assert first.solution is not None
    firm = solve_again(first.solution, {2: str(Reason.TAKEN_OUT)})
    panel = the(page, ResultPanel)
    assert any("0.004 mm assumed" in each for each in texts_of(panel))

    run.post(replace(first, pressed=firm, origin=Origin.LIVE), ())
    qtbot.waitUntil(lambda: any("Press test:" in each for each in texts_of(panel)))
    tip, library = first.names.tip, workbench.library
    qtbot.waitUntil(lambda: tip in library.library.tips)
    kept = library.library.tips[tip].bending
    assert kept is not None
    assert kept.due > kept.measured
    run.post(replace(first, origin=Origin.LIVE), ())
    qtbot.waitUntil(lambda: any("by press test of" in t for t in texts_of(panel)))
    run.post(first, ())
    shown = panel.value()
    assert shown is not None
    assert shown.solution is first.solution
    folder, setup = first.record_folder, first.setup
    assert folder is not None
    assert setup is not None
    chosen = replace(
        workbench.selection.preparation,
        names=first.names,
        camera_file=CameraFile.read(next(folder.glob("camera.*"))),
        pen_file=PenFile.read(next(folder.glob("pen.*"))),
        image_size=setup.camera.image_size,
    )
    run.runner.ask(lambda workflow: workflow.choose(chosen))
    run.runner.ask(lambda workflow: workflow.keep_choices())
    with qtbot.waitSignal(page.step_requested, timeout=20000) as asked:
        click(page, "Press test")

    assert asked.args == ["swing"]
    assert run.status.setup is not None
    assert run.status.setup.is_press_test
    assert not any("Press test" in each for each in texts_of(panel))


def test_an_accepted_swing_is_changed_no_more(
    page: ReviewPage, workbench: Workbench, qtbot: QtBot
) -> None:
    accept(page, qtbot)
    why = "Tip accepted. Start the next calibration."

    for text in ("Exclude", "Include", "Capture more", "Repeat swing"):
        assert not button(page, text).isEnabled()
        assert button(page, text).toolTip() == why
    table(page).setFocus()
    QTest.keyClick(table(page), Qt.Key.Key_Delete)
    assert not workbench.run.status.is_solving


def test_after_acceptance_the_next_calibration_starts(
    page: ReviewPage, workbench: Workbench, qtbot: QtBot
) -> None:
    accept(page, qtbot)
    # The second click of a double one must not go on.
    assert page.main_action() == MainAction("Back to Start", "Tip accepted.")
    qtbot.waitUntil(lambda: not page.main_action().why_not)

    with qtbot.waitSignal(page.step_requested) as asked:
        page.run_main_action()

    assert asked.args == ["start"]
    qtbot.waitUntil(lambda: page.why_closed() == "Swing the pen first.")


def test_a_repetition_is_asked_for_and_keeps_the_images_of_the_swing(
    page: ReviewPage, workbench: Workbench, qtbot: QtBot
) -> None:
    click(page, "Repeat swing")
    asks = the(page, QuestionBar)
    assert asks.words() == (
        "Repeat the swing from the start? These images remain on the disk."
    )
    answer(page, "Continue with these")
    assert asks.words() == ""
    assert workbench.run.status.solution is not None

    click(page, "Repeat swing")
    with qtbot.waitSignal(page.step_requested) as asked:
        answer(page, "Repeat swing")
    assert asked.args == ["swing"]
    record = open_record(workbench.run.records_folder / "swing")
    assert record.verdict == DISCARDED
    assert len(record.images) == N_IMAGES
    assert workbench.run.status.solution is None


# What is asked


def test_whether_to_repeat_is_asked_no_more_once_the_tip_is_accepted(bed: Bed) -> None:
    bed.solve()
    page = bed.show()
    click(page, "Repeat swing")
    page.run_main_action()
    bed.qtbot.waitUntil(page.is_complete)

    assert the(page, QuestionBar).words() == ""


# Without a tip


@pytest.fixture
def failed(bed: Bed, monkeypatch: pytest.MonkeyPatch) -> ReviewPage:
    """The page of a swing whose fit does not converge."""

    def diverges(record: Record, report: Callable[[float], None]) -> Solution:
        raise CalibrationError("joint.not-settled", n_steps=100)

    monkeypatch.setattr("lightpen.swing.solving.solve_record", diverges)
    workbench, folder = bed.workbench, bed.workbench.run.records_folder / "swing"
    resumable = bed.solved_once.read(folder)
    workbench.run.runner.ask(lambda workflow: workflow.continue_swing(resumable))
    workbench.run.runner.ask(lambda workflow: workflow.finish())
    bed.qtbot.waitUntil(lambda: workbench.run.status.failure is not None)
    with undressed():
        page = ReviewPage(workbench)
    bed.pages.append(page)
    bed.qtbot.addWidget(page)
    page.resize(1000, 600)
    page.show()
    page.entered()
    return page


def test_a_swing_without_a_tip_shows_its_cause_once_and_its_residuals(
    failed: ReviewPage,
) -> None:
    tabs = the(failed, QTabWidget)

    assert failed.why_closed() == ""
    assert banner(failed).word == "NO TIP"
    assert "did not converge" in banner(failed).detail
    assert "did not converge" not in remarks(failed)
    assert "did not converge" not in failed.lead()
    assert tabs.tabText(tabs.currentIndex()) == "Residuals"
    assert [tabs.isTabEnabled(i) for i in range(tabs.count())] == [
        tabs.tabText(i) in ("Result", "Residuals") for i in range(tabs.count())
    ]
    (leds,) = failed.findChildren(BarPlot)
    items = leds.findChildren(pg.PlotWidget)[0].getPlotItem().items
    rms = next(each for each in items if isinstance(each, pg.BarGraphItem))
    assert (rms.opts["height"] > 0).all()
    assert failed.main_action() == MainAction("Capture more")
    assert button(failed, "Repeat swing").isEnabled()
    assert not button(failed, "Copy tip").isEnabled()
