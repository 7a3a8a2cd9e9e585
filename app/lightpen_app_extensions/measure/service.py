"""Verification and measuring in the window: runs, choices, and what Start shows."""

from collections.abc import Callable
from dataclasses import replace
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QCoreApplication, QObject, Signal
from typing_extensions import override

from lightpen.record.folder import VERIFIED
from lightpen.record.results.result_folder import FolderArchive
from lightpen_app.face import (
    DemoStep,
    InterruptedWork,
    ReadinessItem,
    RowWords,
    Service,
    SimulatorControls,
)
from lightpen_app.look.languages import worded
from lightpen_app.look.layouts import horizontal_layout
from lightpen_app.look.signs import Sign
from lightpen_app.look.theme import GRID, Tone, set_styled
from lightpen_app.look.words import PARTED, breakable, moment_text, shortened
from lightpen_app.widgets.state_banner import StatusMessage
from lightpen_app.work.job import Notifications
from lightpen_app.work.swing_run import RunView
from lightpen_app.work.workbench import Workbench
from lightpen_extensions.measure.probing_operator import (
    PLATE_WORDS,
    ProbingOperator,
    plate_plan,
)
from lightpen_extensions.measure.session import SessionEventKind, VerificationStatus
from lightpen_extensions.measure.storage.session_files import abandon_interrupted
from lightpen_extensions.measure.storage.session_record import (
    InterruptedVerification,
    find_interrupted,
)
from lightpen_extensions.measure.tasks.drift import DRIFT
from lightpen_extensions.measure.tasks.part import PART
from lightpen_extensions.measure.tasks.registry import ALL_TASKS, task_of
from lightpen_extensions.measure.tasks.task import VerificationChoices
from lightpen_extensions.measure.workflow import VerificationRunner
from lightpen_extensions.simulator.hand import SimulatedOperator

if TYPE_CHECKING:
    from lightpen.archive.chains import Event  # takes long to be imported

KEY = "measure"
LONGEST = 16  # characters of a name

translate = QCoreApplication.translate


class VerificationRun(RunView[VerificationStatus, SessionEventKind]):
    """Status and events of a verification as Qt signals; commands go to its `runner`.

    `progressed` reports recorded images that are read.
    """

    files_changed = Signal()  # a verification was kept in files

    def __init__(
        self,
        archive: FolderArchive,
        folder: Path,
        now: Callable[[], datetime],
        notifications: Notifications,
        parent: QObject | None = None,
    ) -> None:
        super().__init__(VerificationStatus(), notifications, parent)
        self.probing_operator: ProbingOperator | None = None  # leads a simulated hand
        self.runner = VerificationRunner(archive, folder, self, now)

    def shut_down(self) -> None:
        """Write the results and end; its signals start nothing more."""
        self.blockSignals(True)
        self.runner.shut_down()

    def await_end(self, timeout_s: float) -> bool:
        """Wait for the end after `shut_down` and return whether it came."""
        return self.runner.await_end(timeout_s)

    def on_verification(
        self, status: VerificationStatus, events: tuple[SessionEventKind, ...]
    ) -> None:
        """Forward the newest status and every event, on a thread of the runner."""
        operator, setup, state = self.probing_operator, status.setup, status.state
        if operator is not None and setup is not None and state is not None:
            operator.follow(setup, state)
        self.post(status, events)

    @override
    def _compare(self, before: VerificationStatus, now: VerificationStatus) -> None:
        if before.files != now.files:
            self.files_changed.emit()


class MeasureService(Service):
    """Verifies tips and measures parts; its pages are those of `MeasureFace`."""

    verify_step = "verify"

    def __init__(self, workbench: Workbench) -> None:
        super().__init__(workbench)
        self.workbench, self._selection = workbench, workbench.selection
        archive, folder = workbench.run.archive, workbench.folder
        now, notices = workbench.around.now, workbench.notifications
        self.verification = VerificationRun(archive, folder, now, notices, self)
        self.measuring = VerificationRun(archive, folder, now, notices, self)
        self._resumed: InterruptedVerification | None = None

        # Connections
        workbench.selection.changed.connect(self._update_runners)
        workbench.live.connection_changed.connect(self._on_connection_changed)
        for run in (self.verification, self.measuring):
            workbench.live.add_capture(run.runner)
            workbench.parts.append(run)
            run.files_changed.connect(workbench.archive_writer.enter_owed)
            run.changed.connect(self._on_run_changed)
            run.refused.connect(self._on_run_refused)

        self._update_runners()

    @property
    def choices(self) -> VerificationChoices:
        """Choices for a verification, with the limits of the station."""
        choices = self._selection.of_extension(KEY, VerificationChoices())
        return replace(choices, limits=self._selection.limits.verification)

    def set_choices(self, choices: VerificationChoices) -> None:
        """Take over other choices for verifications, and remember them."""
        self._selection.set_of_extension(KEY, choices)

    def set_touching(self, touches: bool) -> None:
        """Set whether the simulated operator probes."""
        operator = self.workbench.live.operator
        for run in (self.verification, self.measuring):
            is_led = touches and run.runner.status.is_here
            run.probing_operator = (
                ProbingOperator(operator)
                if is_led and isinstance(operator, SimulatedOperator)
                else None
            )

    @property
    @override
    def is_here(self) -> bool:
        return self.verification.status.is_here

    @override
    def readiness(self) -> tuple[ReadinessItem, ...]:
        name = translate("DayView", "Drift reference")
        action = translate("DayControl", "Verify the tip")
        return (ReadinessItem("verify", name, self._reference_message(), action),)

    @override
    def event_text(self, event: "Event") -> str:
        kind = event.settings.get(VERIFIED)
        return next((worded(task.title) for task in ALL_TASKS if task.kind == kind), "")

    @override
    def find_interrupted(self) -> tuple[InterruptedWork, ...]:
        found = find_interrupted(self.workbench.folder)
        return tuple(map(partial(_Interrupted, self), found))

    @override
    def demo_steps(self) -> tuple[DemoStep, ...]:
        text = translate(
            "Demo", "Demo: the simulated operator measures a plate of ten features."
        )
        begin, is_done = self._begin_demo, self._is_demo_done
        return (DemoStep("measure", text, begin, is_done),)

    def resume(self, found: InterruptedVerification) -> None:
        """Go on with a verification, with its choices."""
        under_way = found.under_way
        assert under_way is not None
        chosen, is_part = self.choices, under_way.choices.kind == PART.kind
        kind = chosen.kind if is_part else under_way.choices.kind
        again = replace(under_way.choices, kind=kind, limits=chosen.limits)
        self.set_choices(again)  # as in the session
        self._resumed = found
        run = self.measuring if is_part else self.verification
        run.runner.ask(lambda workflow: workflow.continue_session(found))

    def _update_runners(self) -> None:
        chosen, choices = self._selection.preparation, self.choices
        part = replace(choices, kind=PART.kind)
        self.verification.runner.ask(lambda workflow: workflow.choose(chosen, choices))
        self.measuring.runner.ask(lambda workflow: workflow.choose(chosen, part))

    def _on_connection_changed(self) -> None:
        if not self.workbench.live.is_open:
            self.set_touching(False)

    def _on_run_changed(self) -> None:
        resumed = self._resumed
        if resumed is not None and resumed.under_way is not None:
            began = resumed.under_way.began
            runs = ((self.verification, "verify"), (self.measuring, "measure"))
            for run, key in runs:
                if run.status.began == began:
                    self._resumed = None
                    self.resumed.emit(key)
        self.changed.emit()

    def _on_run_refused(self) -> None:
        self._resumed = None
        self.refused.emit()

    def _begin_demo(self) -> None:
        self.set_choices(replace(self.choices, plan=plate_plan(worded(PLATE_WORDS))))

    def _is_demo_done(self) -> bool:
        if self.measuring.probing_operator is None:  # once it is here
            self.set_touching(True)
        return self.measuring.status.is_done

    def _reference_message(self) -> StatusMessage:
        state = self.verification.status.state
        drift = None if state is None else state.found_by(DRIFT)
        if drift is None:
            text = translate("DayPage", "No drift reference")
            return StatusMessage(text, Sign.RING, Tone.QUIET)
        if not drift.assessment.is_accepted:
            text = translate("DayPage", "The camera moved. Verify the tip.")
            return StatusMessage.warning(text)
        return StatusMessage.good(translate("DayPage", "Drift reference stable"))


class _Interrupted(InterruptedWork):
    """A verification that was interrupted."""

    def __init__(self, service: MeasureService, found: InterruptedVerification) -> None:
        self._service, self._found = service, found
        under_way = found.under_way
        self.names = None if under_way is None else under_way.names

    @override
    def words(self) -> RowWords:
        return RowWords(
            self._heading(),
            self._description(),
            translate(
                "VerificationRow",
                "Close this verification as abandoned? Its recorded data remains.",
            ),
            (
                translate("VerificationRow", "Continue"),
                translate("VerificationRow", "Continue the verification of {0}"),
            ),
            (
                translate("VerificationRow", "Close verification"),
                translate("VerificationRow", "Close the verification of {0}"),
            ),
        )

    @override
    def resume(self) -> str:
        self._service.resume(self._found)
        return translate("InterruptedControl", "Reading the verification")

    @override
    def closing_text(self) -> str:
        return translate("InterruptedControl", "Closing the verification")

    @override
    def close(self) -> None:
        workbench = self._service.workbench
        abandon_interrupted(workbench.folder, self._found, workbench.around.now())

    @override
    def closed_text(self) -> str:
        return translate(
            "InterruptedControl", "Verification closed as abandoned. See History."
        )

    def _heading(self) -> str:
        under_way = self._found.under_way
        if under_way is None:
            words = translate("VerificationRow", "Damaged: {0}")
            return words.format(shortened(self._found.path.parent.name))
        return moment_text(under_way.began)

    def _description(self) -> str:
        under_way, fault = self._found.under_way, self._found.fault
        if under_way is None:
            return "" if fault is None else breakable(worded(fault))
        names = under_way.names
        called = (shortened(name, LONGEST) for name in (names.pen, names.tip))
        task = worded(task_of(under_way.choices.kind).title)
        return PARTED.join(filter(None, (*called, task)))


class ProbingSimulatorControls(SimulatorControls):
    """Lets the simulated operator touch, or lift the pen; hidden with a real pen."""

    def __init__(self, service: MeasureService) -> None:
        super().__init__(service.workbench.live)
        self._service = service
        self.setProperty("area", "panel")

        # Widgets
        self.say(self, self.tr("Simulated pen"))
        self._touch = self.make_button(
            self.tr("Let the simulated operator probe"),
            tip=self.tr("Probes all tasks automatically."),
            checkable=True,
        )

        # Layout
        margins = (GRID, GRID // 2, GRID, GRID // 2)
        horizontal_layout(self, self._touch, 1, margins=margins)

        # Connections
        self._touch.toggled.connect(service.set_touching)

        self._follow_connection()

    @override
    def set_inviting(self, inviting: bool) -> None:
        set_styled(self._touch, "inviting", "true" if inviting else "")

    def stop(self) -> None:
        """Release the simulated operator."""
        self._touch.setChecked(False)

    @override
    def _follow_connection(self) -> None:
        super()._follow_connection()
        if self._touch.isChecked():  # of a camera opened again
            self._service.set_touching(self._live.operator is not None)
