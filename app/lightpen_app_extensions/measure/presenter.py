"""View state of the step Verify, computed from the status of the verification."""

from dataclasses import dataclass, field

from PySide6.QtCore import QObject

from lightpen.cameras.protocol import Connection
from lightpen.estimation.reports.verdict import Grade
from lightpen.formats.opened_files import InputFile
from lightpen.model.names import Origin
from lightpen.record.library.tip_library import TipStatus
from lightpen_app.look.languages import worded
from lightpen_app.look.phrases import GRADE_MARKS, Instruction, grade_text
from lightpen_app.look.signs import Sign
from lightpen_app.look.theme import Tone
from lightpen_app.look.words import PARTED, moment_text, shortened
from lightpen_app.widgets.operator_view import OperatorValue
from lightpen_app.widgets.page import MainAction
from lightpen_app.widgets.state_banner import State, status_text
from lightpen_app_extensions.measure.check_list import CheckRow, value_text
from lightpen_app_extensions.measure.part_view import FigureValue, posture_value
from lightpen_app_extensions.measure.service import MeasureService, VerificationRun
from lightpen_extensions.comparisons.assessment import (
    CALIBRATE_AGAIN,
    VerificationAssessment,
)
from lightpen_extensions.measure.probing.probing import SETTLING, ProbingPhase
from lightpen_extensions.measure.session import (
    BROKEN_OFF,
    ReadingState,
    SessionSetup,
    SessionState,
    VerificationStatus,
    bands_so_far,
    fraction_done,
    instruction,
    is_at_rest,
)
from lightpen_extensions.measure.tasks.registry import TASKS, AnyTask
from lightpen_extensions.measure.tasks.task import Band, rule_of


@dataclass(frozen=True, eq=False)
class VerifyView:
    """Content of the page of a verification, except the results."""

    operator: OperatorValue = field(default_factory=OperatorValue)
    rows: tuple[CheckRow, ...] = ()  # checks, or features of a part
    current: int = 0  # row of what is probed now
    task: AnyTask | None = None  # the current one
    pause: str = ""
    can_start_over: bool = False
    can_undo: bool = False
    has_report: bool = False


class VerifyPresenter(QObject):
    """Computes the view from the status of runner, camera and station."""

    tasks: tuple[AnyTask, ...] = TASKS

    def __init__(self, service: MeasureService, run: VerificationRun) -> None:
        super().__init__()
        workbench = service.workbench
        self._service = service
        self._selection, self._tips = workbench.selection, workbench.library
        self._verification, self._live = run, workbench.live
        # Values and grade of the present tip, by task.
        self._results: dict[str, tuple[tuple[Band, ...], Grade]] = {}
        self._tip_file: InputFile | None = None

    def view(self) -> VerifyView:
        """Return the view."""
        status = self._status
        return VerifyView(
            operator=self.operator_value(),
            rows=self.rows(),
            current=self.current_row(),
            task=None if status.refusal is not None else status.task,
            pause=(
                self.tr("Continue (Space)")
                if status.is_paused
                else self.tr("Pause (Space)")
            ),
            has_report=status.is_done and bool(status.files),
            can_start_over=status.state is not None and status.state.is_begun,
            can_undo=status.state is not None and bool(status.state.touches),
        )

    def is_doubtful(self) -> bool:
        """Return whether something was found against the tip."""
        found = self._status.assessment
        return found is not None and not found.is_accepted

    def next_step(self) -> str:
        """Return the key of the step after this one; empty for another check."""
        found = self._status.assessment
        if found is not None and found.is_accepted:
            return "measure"
        again = found is not None and found.next_step.code == CALIBRATE_AGAIN.code
        return "swing" if again else ""

    def rows(self) -> tuple[CheckRow, ...]:
        """Return the checks, each with its value and verdict once it is done."""
        self._keep_result()
        return tuple(map(self._row, self.tasks))

    def current_row(self) -> int:
        """Return the row of what is probed now, or was last."""
        setup = self._status.setup
        chosen = None if setup is None else setup.task
        return self.tasks.index(chosen) if chosen in self.tasks else 0

    def figure(self, row: int) -> FigureValue:
        """Return the figure of a row."""
        setup, state, task = self._status.setup, self._status.state, self.tasks[row]
        title, purpose = worded(task.title), worded(task.purpose)
        if setup is None or state is None or task is not setup.task:
            bands, _ = self._results.get(task.kind, ((), None))
            return FigureValue(title, purpose, bands=bands, action=self.tr("Do now"))
        bands = bands_so_far(setup, state)
        if state.done is not None:
            return FigureValue(title, bands=bands)
        return FigureValue(title, purpose, posture_value(setup, state), bands[:1])

    def operator_value(self) -> OperatorValue:
        """Return the content of page and operator view."""
        status, (instruction, banner) = self._status, self._now()
        setup, state, task = status.setup, status.state, status.task
        if setup is None or state is None or task is None or status.refusal is not None:
            return OperatorValue(instruction.short, instruction.hint, banner)
        return OperatorValue(
            instruction=instruction.short,
            hint=instruction.hint,
            state=banner,
            count=worded(task.counted(setup.choices, state.progress(setup, task))),
            fraction=fraction_done(setup, state),
            keys=(
                self.tr("Space: continue")
                if status.is_paused
                else self.tr("Space: pause")
            ),
            dial=posture_value(setup, state) if task.is_of_tip else None,
        )

    @property
    def _status(self) -> VerificationStatus:
        return self._verification.status

    # State of the page

    def lead(self) -> str:
        """Return the line below the title: the tip, its status and files."""
        status = self._status
        if status.tip is None:
            return self._purpose()
        tip = status.tip
        is_practice = self._selection.preparation.origin is Origin.SIMULATED
        words = (
            self.tr("Practice tip {0} of pen {1}, saved {2}")
            if is_practice
            else self.tr("Tip {0} of pen {1}, in use since {2}")
        ).format(
            shortened(tip.names.tip),
            shortened(tip.names.pen),
            moment_text(tip.calibration.when),
        )
        doubt = grade_text(Grade.CHECK) if self.tip_is_doubted() else ""
        files = ", ".join(file.name for file in status.files)
        kept = self.tr("saved as {0}").format(files) if files else ""
        parts = words, doubt, self._tip_status(), kept
        return PARTED.join(filter(None, parts))

    def _purpose(self) -> str:
        return self.tr("Verify the current tip on reference artefacts.")

    def tip_is_doubted(self) -> bool:
        """Return whether the tip was accepted though its grade is CHECK."""
        tip = self._status.tip
        return tip is not None and tip.calibration.grade == Grade.CHECK

    def _tip_status(self) -> str:
        """Return the status of a tip; nothing of a valid one."""
        tip, statuses = self._status.tip, self._tips.statuses
        if tip is None or self._selection.preparation.origin is Origin.SIMULATED:
            return ""
        overdue = statuses.overdue(tip.names.pen, tip.names.tip)
        if overdue is not None:
            return worded(overdue)
        status = statuses.of_tip(tip.names.pen, tip.names.tip)
        return "" if status in (None, TipStatus.VALID) else status_text(status)

    def action(self) -> MainAction:
        """Return the main action of the page."""
        status = self._status
        if status.is_done:
            words = {
                "measure": self.tr("Measure a part"),
                "swing": self.tr("Calibrate again"),
                "": self.tr("Check again"),
            }
            return MainAction(words[self.next_step()])
        has_points = status.state is not None and status.state.is_begun
        why_not = "" if has_points else self.tr("No point is recorded yet.")
        return MainAction(self.tr("Finish early"), why_not, is_early=True)

    def _keep_result(self) -> None:
        """Remember what the checks of the present tip found."""
        status, tip = self._status, self._status.tip
        if tip is not None and tip.tip_file != self._tip_file:
            self._results, self._tip_file = {}, tip.tip_file
        setup, state, found = status.setup, status.state, status.assessment
        if setup is not None and state is not None and found is not None:
            bands = bands_so_far(setup, state)
            self._results[setup.choices.kind] = bands, found.grade

    def _row(self, task: AnyTask) -> CheckRow:
        status, name = self._status, worded(task.title)
        if task is status.task:
            return CheckRow(name, self.tr("now"), Sign.PLAY, Tone.ACTIVE)
        result = self._results.get(task.kind)
        if result is None:
            return CheckRow(name, "", Sign.RING, Tone.QUIET)
        bands, grade = result
        value = f"{self._grade_text(grade)} {value_text(bands[0])}"
        return CheckRow(name, value, *GRADE_MARKS[grade])

    def _grade_text(self, grade: Grade) -> str:
        """Return a grade; REPEAT refers to the verification, not to a swing."""
        return self.tr("REPEAT") if grade is Grade.REPEAT else grade_text(grade)

    # What the operator has to do

    def _now(self) -> tuple[Instruction, State]:
        """Return the instruction and the state that go with the status."""
        status = self._status
        setup, state = status.setup, status.state
        wait = Sign.WAIT, Tone.ACTIVE
        if status.reading is ReadingState.IMAGES:
            hint = self.tr("Measuring the points in the recorded images.")
            reading = State(self.tr("READING"), "", *wait, self._verification.progress)
            return Instruction(self.tr("Reading images"), hint), reading
        if status.refusal is not None:
            hint = worded(status.refusal)
            if status.tip is not None:  # an input is missing
                missing = State(self.tr("NOT READY"), "", Sign.WARNING, Tone.WARN)
                return Instruction(self._missing(), hint), missing
            impossible = State(self.tr("NOT POSSIBLE"), "", Sign.CROSS, Tone.BAD)
            return Instruction(self._refused(), hint), impossible
        if setup is None or state is None:
            hint = self.tr("Reading the current tip.")
            reading = State(self.tr("READING"), "", *wait)
            return Instruction(self.tr("Wait"), hint), reading
        if status.assessment is not None and status.is_done:
            return self._concluded(setup, status.assessment)
        if self._live.connection is not Connection.STREAMING:
            hint = self.tr(
                "The camera sends no images. Probing continues when they arrive."
            )
            lacking = State(self.tr("NO IMAGES"), "", Sign.CROSS, Tone.BAD)
            return Instruction(self.tr("No images"), hint), lacking
        if status.is_paused:
            hint = self.tr("Press Space to continue.")
            paused = State(self.tr("PAUSED"), "", Sign.PAUSE, Tone.WARN)
            return Instruction(self.tr("Paused"), hint), paused
        short, shown = self._probing(setup, state)
        return Instruction(short, worded(instruction(setup, state))), shown

    def _concluded(
        self, setup: SessionSetup, found: VerificationAssessment
    ) -> tuple[Instruction, State]:
        rule = worded(rule_of(setup.choices, setup.choices.limits))
        why, mark = f"{worded(found.reason)} {rule}", GRADE_MARKS[found.grade]
        shown = State(self._grade_text(found.grade), why, *mark)
        return Instruction(self._verdict(found), worded(found.next_step)), shown

    def _missing(self) -> str:
        return self.tr("Enter the value")

    def _refused(self) -> str:
        return self.tr("Nothing to verify")

    def _verdict(self, found: VerificationAssessment) -> str:
        if found.grade is Grade.REPEAT:
            return self.tr("Not verified")
        if found.grade is Grade.CHECK:
            return self.tr("Check needed")
        if found.grade is Grade.STEADY:
            return self.tr("Nothing moved")
        return self.tr("Tip verified")

    def _probing(self, setup: SessionSetup, state: SessionState) -> tuple[str, State]:
        """Return a few words on what to do, and what is seen of the pen."""
        task, touching = setup.task, state.touching
        doubt = Sign.WARNING, Tone.WARN
        is_holding = touching.phase is ProbingPhase.HOLDING
        if is_holding and len(touching.held) >= SETTLING:  # and not recorded yet
            fraction = touching.progress(setup.rules)
            active = Sign.RECORD, Tone.ACTIVE, fraction
            return self.tr("Hold still"), State(self.tr("STEADY"), "", *active)
        if touching.phase is ProbingPhase.KNOWN:
            return (
                self.tr("Probe elsewhere"),
                State(self.tr("PROBED BEFORE"), "", *doubt),
            )
        if state.fault is not None and not is_at_rest(state):
            is_broken = state.fault.code == BROKEN_OFF.code
            short = self.tr("Not recorded") if is_broken else self.tr("Not counted")
            return short, State(self.tr("NOT RECORDED"), "", *doubt)
        is_next = touching.phase is ProbingPhase.RECORDED
        short = worded(task.headline(state.progress(setup, task), is_next=is_next))
        if is_at_rest(state):
            short = self.tr("Pick up the pen")
        if is_next:
            return short, State(self.tr("POINT RECORDED"), "", Sign.CHECK, Tone.GOOD)
        if touching.n_lost or not (touching.held or touching.path):
            return short, State(self.tr("WAITING"), "", Sign.WAIT, Tone.QUIET)
        return short, State(self.tr("PEN DETECTED"), "", Sign.EYE, Tone.ACTIVE)
