"""The step Swing: hands-free from the seat to the verdict, whatever happens."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pyqtgraph as pg
import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QAction
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QAbstractButton, QApplication, QTabBar
from pytestqt.qtbot import QtBot
from tests.app.blank_page import BlankPage
from tests.app.patience import PATIENCE_MS
from tests.app.pictures import data_of
from tests.faulty_camera import FaultyCamera, scene_of

from lightpen.cameras.protocol import CameraSettings
from lightpen.formats.opened_files import OpenedFiles
from lightpen.live.sources import SourceEnvironment
from lightpen.model.limits import SwingLimits
from lightpen.model.rigid import Posture
from lightpen.record.swings.header import Names
from lightpen.record.swings.interrupted import find_unfinished
from lightpen.record.swings.reading import DISCARDED, Record, open_record
from lightpen.swing.capture.state import Pause, Phase, SwingState
from lightpen.swing.preparation import SourceChoice
from lightpen_app.look.phrases import grade_text, phrase
from lightpen_app.look.sounds import Sound, Sounds
from lightpen_app.shell.main_window import MainWindow
from lightpen_app.steps.swing.page import SwingPage
from lightpen_app.widgets.bars import QuestionBar
from lightpen_app.widgets.operator_view import OperatorValue
from lightpen_app.widgets.plots import TracePlot
from lightpen_app.work.settings import Preferences, Settings
from lightpen_app.work.workbench import Workbench
from lightpen_app_extensions.simulator.service import SimulatorService
from lightpen_extensions.simulator.hand import SimulatedOperator

if TYPE_CHECKING:
    from tests.app.conftest import SolvingOn

Key = Qt.Key
NAMES = Names("Hall 2", "Ann", "LP-04", "T-10", "C-1", 10.0)
SHORT = SwingLimits(
    max_uncertainty=0.015, min_images=12, max_images=50, min_per_field=0
)
LONG = SwingLimits(max_uncertainty=1e-5, min_images=5000, max_images=5000)
VERDICTS = {"PASS", "CHECK", "REPEAT", "NO TIP"}


class Recorder(Sounds):
    """Remembers what was played."""

    def __init__(self) -> None:
        super().__init__(Path())
        self.played: list[tuple[Sound, float]] = []

    def play(self, sound: Sound, progress: float = 0.0) -> None:
        self.played.append((sound, progress))

    def sounds(self) -> list[Sound]:
        return [sound for sound, _ in self.played]


class Desk:
    """The window with the step Swing between two blank ones."""

    def __init__(self, workbench: Workbench, settings: Settings) -> None:
        self.workbench, self.run = workbench, workbench.run
        self.recorder = Recorder()
        self.page = SwingPage(workbench, self.recorder, (SimulatorService(workbench),))
        pages = (BlankPage("leds"), self.page, BlankPage("review"))
        self.window = MainWindow(
            pages, settings, Preferences(), workbench.notifications
        )
        self.window.resize(1280, 800)
        self.window.show()
        self.shown: list[OperatorValue] = []
        self.page.operator_value_changed.connect(self.shown.append)

    @property
    def state(self) -> SwingState:
        assert self.run.status.state is not None
        return self.run.status.state

    @property
    def operator(self) -> SimulatedOperator:
        assert isinstance(self.workbench.live.operator, SimulatedOperator)
        return self.workbench.live.operator

    @property
    def value(self) -> OperatorValue:
        """What the operator sees now."""
        return self.shown[-1]

    @property
    def posture(self) -> Posture | None:
        """Where the dial draws the pen."""
        return None if self.value.dial is None else self.value.dial.posture

    @property
    def main_button(self) -> QAbstractButton:
        button = self.window.findChild(QAbstractButton, "main_button")
        assert isinstance(button, QAbstractButton)
        return button

    def words(self) -> str:
        return " ".join(self.window.words())

    def offers(self, text: str) -> bool:
        return any(each.text() == text for each in self._buttons())

    def click(self, text: str) -> None:
        (button,) = (each for each in self._buttons() if each.text() == text)
        QTest.mouseClick(button, Qt.MouseButton.LeftButton)

    def choose(self, text: str) -> None:
        """Choose an entry of a menu."""
        actions = self.page.findChildren(QAction)
        (action,) = (each for each in actions if each.text() == text)
        action.trigger()

    def let_operator_swing(self) -> None:
        text = "Let the simulated operator swing"
        (button,) = (each for each in self._buttons() if each.text() == text)
        if not button.isChecked():
            QTest.mouseClick(button, Qt.MouseButton.LeftButton)

    def finish(self) -> None:
        QTest.mouseClick(self.main_button, Qt.MouseButton.LeftButton)
        self.click("Finish now")

    def type(self, key: Key) -> None:
        self.window.activateWindow()
        QTest.keyClick(self.window.focusWidget() or self.window, key)

    def has_reported(self, instruction: str) -> bool:
        return any(value.instruction == instruction for value in self.shown)

    def close(self) -> None:
        self.page.shut_down()
        self.window.setParent(None)
        self.window.deleteLater()
        self.workbench.shut_down()
        QApplication.sendPostedEvents()

    def _buttons(self) -> list[QAbstractButton]:
        found = self.window.findChildren(QAbstractButton)
        return [each for each in found if each.isVisible()]


def open_camera(qtbot: QtBot, workbench: Workbench) -> None:
    workbench.camera.open()
    qtbot.waitUntil(
        lambda: not workbench.selection.preparation.camera_missing_inputs(),
        timeout=PATIENCE_MS,
    )


def until_verdict(qtbot: QtBot, desk: Desk) -> None:
    until(qtbot, lambda: desk.value.state.word in VERDICTS)


def asked(desk: Desk) -> str:
    """What the page asks now."""
    bar = desk.page.findChild(QuestionBar)
    assert isinstance(bar, QuestionBar)
    return bar.words()


def interrupted(desk: Desk) -> tuple[Record, ...]:
    return find_unfinished(desk.run.records_folder).interrupted


def until(qtbot: QtBot, happened: Callable[[], bool]) -> None:
    qtbot.waitUntil(happened, timeout=PATIENCE_MS)


@pytest.fixture
def desk(qtbot: QtBot, workbench: Workbench, settings: Settings) -> Iterator[Desk]:
    """The step before Swing is shown; images come, a short swing is enough."""
    workbench.selection.set_preparation(
        replace(workbench.selection.preparation, limits=SHORT)
    )
    open_camera(qtbot, workbench)
    desk = Desk(workbench, settings)
    yield desk
    desk.close()


@pytest.fixture(scope="module")
def shared_desk(
    tmp_path_factory: pytest.TempPathFactory,
    around: SourceEnvironment,
    samples: OpenedFiles,
    dressed: QApplication,
) -> Iterator[Desk]:
    """A desk at which one test goes on where the last has left off."""
    folder = tmp_path_factory.mktemp("shared")
    settings = Settings(folder / "lightpen.json")
    workbench = Workbench(settings, folder / "data", around)
    workbench.selection.set_preparation(
        replace(
            workbench.selection.preparation,
            names=NAMES,
            limits=SHORT,
            camera_file=samples.camera_file,
            pen_file=samples.pen_file,
            source=SourceChoice(),
        )
    )
    with pytest.MonkeyPatch.context() as unhurried:  # that of each test comes later
        unhurried.setattr("lightpen_app.steps.swing.page.PLOTTING_MS", 300)
        desk = Desk(workbench, settings)
    yield desk
    desk.close()


@pytest.fixture
def at_verdict(qtbot: QtBot, shared_desk: Desk) -> Desk:
    """A short swing that was solved."""
    desk = shared_desk
    show(qtbot, desk)
    desk.let_operator_swing()
    until_verdict(qtbot, desk)
    return desk


@pytest.fixture
def capturing(qtbot: QtBot, shared_desk: Desk) -> Desk:
    """A swing that goes on and on, captured without a disturbance."""
    desk, workbench = shared_desk, shared_desk.workbench
    if workbench.selection.preparation.limits is SHORT:
        short = desk.run.status.record_folder
        workbench.selection.set_preparation(
            replace(workbench.selection.preparation, limits=LONG)
        )
        # the next may begin at once
        desk.run.runner.ask(lambda workflow: workflow.discard())
        until(
            qtbot,
            lambda: (
                desk.run.status.state is None or desk.run.status.record_folder != short
            ),
        )
    show(qtbot, desk)
    desk.let_operator_swing()
    keep_on(qtbot, desk)
    return desk


def show(qtbot: QtBot, desk: Desk) -> None:
    """Show the step Swing, with images coming."""
    if not desk.workbench.live.is_open:
        open_camera(qtbot, desk.workbench)
    if desk.run.status.state is None:
        desk.window.go_to(0)  # a swing begins when its step is entered
    desk.window.go_to(1)
    until(qtbot, lambda: desk.run.status.state is not None)


def keep_on(qtbot: QtBot, desk: Desk, n_more: int = 3) -> None:
    """Wait until some more images are kept."""
    until(qtbot, lambda: desk.run.status.state is not None)
    n_before = desk.state.n_kept
    until(
        qtbot,
        lambda: (
            desk.state.phase is Phase.CAPTURING
            and desk.state.n_kept >= n_before + n_more
        ),
    )


# Before there is a swing


def test_the_step_is_closed_while_something_is_missing(desk: Desk) -> None:
    desk.workbench.selection.set_preparation(
        replace(desk.workbench.selection.preparation, pen_file=None)
    )

    desk.window.go_to(1)

    assert desk.window.page() is not desk.page
    assert "Open the LED geometry file." in desk.words()


def test_enter_presses_the_filled_button_before_there_is_an_image(
    qtbot: QtBot, desk: Desk
) -> None:
    desk.window.go_to(1)
    until(qtbot, lambda: desk.run.status.state is not None)

    desk.type(Key.Key_Return)

    until(qtbot, lambda: desk.state.n_kept > 0)


# A short swing, from beginning to end


def test_no_key_is_needed_from_the_seat_to_the_verdict(at_verdict: Desk) -> None:
    desk = at_verdict

    for instruction in (
        *(
            "Hold the pen in view",
            "Seat the tip",
            "Seated",
            "Starts in 3",
            "Tilt RIGHT",
        ),
        *("Capture ended",),
    ):
        assert desk.has_reported(instruction), instruction
    verdict = desk.run.status.verdict
    assert verdict is not None
    assert desk.value.state.word == grade_text(verdict.grade)
    assert desk.value.state.detail == phrase(verdict.reason, desk.state.heading).hint
    assert desk.main_button.text() == "Review"
    assert desk.main_button.isEnabled()
    sounds = desk.recorder.sounds()
    assert sounds[0] is Sound.SEATED
    assert sounds[-2:] == [Sound.CAPTURED, Sound.DONE]
    rises = [progress for sound, progress in desk.recorder.played if sound == "kept"]
    assert len(rises) == desk.state.n_kept
    assert rises[-1] > rises[0]


def test_a_pen_that_leans_after_the_verdict_waits(
    qtbot: QtBot, at_verdict: Desk
) -> None:
    desk = at_verdict
    desk.operator.lean_towards(0.4, 0.0, 0.0)
    until(qtbot, lambda: desk.value.state.fraction is None)
    qtbot.wait(1000)  # four seconds of the operator's

    assert desk.window.page() is desk.page


def test_holding_the_pen_upright_and_still_after_the_verdict_shows_the_review(
    qtbot: QtBot, at_verdict: Desk
) -> None:
    desk = at_verdict
    desk.choose("Hold")
    desk.operator.lean_towards(0.0, 0.0, 0.0)

    until(qtbot, lambda: desk.window.page().key == "review")
    filled = [value.state.fraction for value in desk.shown if value.state.fraction]
    assert filled[-1] > 0.5  # the ring was seen to fill


def test_the_residuals_of_swing_and_review_agree(at_verdict: Desk) -> None:
    solution = at_verdict.run.status.solution
    assert solution is not None
    during = at_verdict.state.kept.misfits
    after = solution.misfits[solution.calibration.used]

    # The review solves anew with more unknowns, hundreds of centres for each.
    assert np.median(during) == pytest.approx(np.median(after), rel=0.2)


@pytest.mark.slow
def test_enter_after_pause_does_not_ask_for_more_images_once_the_swing_is_complete(
    qtbot: QtBot, at_verdict: Desk
) -> None:
    desk = at_verdict
    desk.click("Capture more")
    until(qtbot, lambda: desk.value.state.word == "CAPTURING")
    desk.click("Pause (Space)")
    until(qtbot, lambda: desk.value.state.word == "PAUSED")
    assert isinstance(desk.window.focusWidget(), QAbstractButton)
    desk.run.runner.ask(lambda workflow: workflow.finish())
    until(qtbot, lambda: desk.offers("Capture more"))

    assert not isinstance(desk.window.focusWidget(), QAbstractButton)


@pytest.mark.slow
def test_computing_can_be_stopped_and_begun_again(
    qtbot: QtBot, at_verdict: Desk, solving_on: "SolvingOn"
) -> None:
    desk = at_verdict
    desk.let_operator_swing()
    desk.click("Capture more")
    until(qtbot, lambda: desk.value.state.word == "CAPTURING")
    with solving_on():
        desk.finish()
        until(qtbot, lambda: desk.run.status.is_solving)
        until(qtbot, lambda: desk.offers("Stop computing"))

        desk.click("Stop computing")

        until(qtbot, lambda: desk.value.instruction == "Not computed")
    assert desk.value.state.word == "STOPPED"
    assert "Tip not computed yet" in desk.words()
    assert ") are saved;" in desk.page.unsaved()

    desk.click("Compute again")

    until_verdict(qtbot, desk)


# A long swing, disturbed


@pytest.mark.slow
def test_a_covered_pen_is_reported_and_the_swing_goes_on_by_itself(
    qtbot: QtBot, capturing: Desk
) -> None:
    n_reported, n_played = len(capturing.shown), len(capturing.recorder.played)

    def lost() -> list[OperatorValue]:
        return [v for v in capturing.shown[n_reported:] if v.state.word == "PEN LOST"]

    capturing.choose("Cover")

    until(qtbot, lambda: bool(lost()))
    assert lost()[0].instruction == "Pen not detected"
    assert Sound.LOST in capturing.recorder.sounds()[n_played:]
    keep_on(qtbot, capturing)


def test_a_slip_is_said_in_a_sentence_although_images_are_kept_again(
    qtbot: QtBot, capturing: Desk
) -> None:
    n_reported = len(capturing.shown)
    capturing.choose("Slip")

    def said() -> list[OperatorValue]:
        return [
            value
            for value in capturing.shown[n_reported:]
            if value.hint.startswith("Tip slipped") and "rejected" in value.hint
        ]

    until(qtbot, lambda: bool(said()))
    keep_on(qtbot, capturing)


def test_the_plots_can_be_read(qtbot: QtBot, capturing: Desk) -> None:
    plots = capturing.page.findChildren(TracePlot)
    choice = capturing.page.findChild(QTabBar)
    assert isinstance(choice, QTabBar)

    def names() -> list[str]:
        seen = [plot for plot in plots if plot.isVisible()]
        assert all(plot.height() >= 120 for plot in seen)
        assert all(plot.toolTip() for plot in seen)
        until(qtbot, lambda: all(data_of(p, pg.PlotCurveItem).size for p in seen))
        return [plot.accessibleName() for plot in seen]

    assert names() == ["Residual of each image", "Uncertainty of the tip"]

    choice.setCurrentIndex(1)

    assert names() == ["Tip of each image", "Estimate of the tip"]
    choice.setCurrentIndex(0)


def test_space_pauses_and_goes_on(qtbot: QtBot, capturing: Desk) -> None:
    capturing.type(Key.Key_Space)
    until(qtbot, lambda: capturing.value.state.word == "PAUSED")
    assert capturing.value.hint == "Press Space to continue."
    assert capturing.offers("Continue (Space)")

    capturing.type(Key.Key_Space)
    keep_on(qtbot, capturing)


@pytest.mark.slow
def test_left_and_right_are_learnt_anew_where_they_are_swapped(
    qtbot: QtBot, capturing: Desk
) -> None:
    swapped = "Left and right are swapped"
    until(qtbot, lambda: capturing.offers(swapped))

    capturing.click(swapped)

    until(qtbot, lambda: not capturing.offers(swapped))
    assert capturing.state.heading is None
    until(qtbot, lambda: capturing.offers(swapped))
    assert capturing.state.heading is not None


def test_leaving_the_step_pauses_and_coming_back_goes_on(
    qtbot: QtBot, capturing: Desk
) -> None:
    capturing.type(Key.Key_PageUp)
    assert capturing.window.page().key == "leds"
    until(qtbot, lambda: capturing.state.pause is Pause.BY_USER)

    capturing.window.go_to(1)
    keep_on(qtbot, capturing)


def test_a_damaged_image_is_not_taken_for_the_reason_of_a_pause(
    qtbot: QtBot, capturing: Desk
) -> None:
    camera = FaultyCamera(
        scene_of(capturing.workbench.around), capturing.workbench.around.clock
    )
    capturing.workbench.live.open(
        [camera], CameraSettings(), capturing.workbench.around.clock
    )
    keep_on(qtbot, capturing, 1)
    capturing.type(Key.Key_Space)
    until(qtbot, lambda: capturing.value.state.word == "PAUSED")

    camera.spoil_frames(1)

    until(qtbot, lambda: "was incomplete and was discarded." in capturing.words())
    assert capturing.value.hint == "Press Space to continue."
    capturing.type(Key.Key_Space)


def test_a_camera_that_was_closed_can_be_opened_here(
    qtbot: QtBot, capturing: Desk
) -> None:
    n_before = capturing.state.n_kept
    folder = capturing.run.status.record_folder
    capturing.workbench.live.close()
    until(qtbot, lambda: capturing.offers("Open the camera"))

    capturing.click("Open the camera")
    keep_on(qtbot, capturing)

    assert capturing.run.status.record_folder == folder
    assert capturing.state.n_kept > n_before


def test_finishing_early_says_what_is_missing_and_can_be_declined(
    qtbot: QtBot, capturing: Desk
) -> None:
    QTest.mouseClick(capturing.main_button, Qt.MouseButton.LeftButton)

    question = asked(capturing)
    assert f"Images captured: {capturing.state.n_kept} of 5000 (minimum)" in question
    assert capturing.state.phase is not Phase.SOLVING

    capturing.click("Continue swinging")

    assert asked(capturing) == ""
    keep_on(qtbot, capturing)


def test_closing_the_window_asks_and_names_the_images(
    qtbot: QtBot, capturing: Desk
) -> None:
    capturing.run.runner.ask(lambda workflow: workflow.pause())
    until(qtbot, lambda: capturing.state.phase is Phase.PAUSED)

    said = capturing.page.unsaved()
    # Other tests use this swing.
    capturing.run.runner.ask(lambda workflow: workflow.resume())
    assert f"captured images ({capturing.state.n_kept}) are saved" in said


def test_enter_presses_the_main_button_unless_another_was_chosen(
    capturing: Desk,
) -> None:
    capturing.window.go_to(0)
    capturing.window.go_to(1)

    focused = capturing.window.focusWidget()

    assert focused is not None
    assert not isinstance(focused, QAbstractButton)
    capturing.type(Key.Key_Return)
    assert asked(capturing)
    capturing.click("Continue swinging")


@pytest.mark.slow
def test_starting_over_asks_and_keeps_the_images_of_the_old_swing(
    qtbot: QtBot, capturing: Desk
) -> None:
    old = capturing.run.status.record_folder
    assert old is not None
    n_before = capturing.state.n_kept

    capturing.click("Start over")
    assert f"The images of this swing ({n_before})" in asked(capturing)
    assert capturing.run.status.record_folder == old
    capturing.click("Restart swing")
    # Enter shall press the main button, not begin anew once more.
    assert not isinstance(capturing.window.focusWidget(), QAbstractButton)

    until(qtbot, lambda: capturing.run.status.record_folder not in (None, old))
    until(qtbot, lambda: open_record(old).verdict == DISCARDED)
    assert len(open_record(old).used_images) >= n_before
    keep_on(qtbot, capturing)
    assert old not in {each.folder for each in interrupted(capturing)}
