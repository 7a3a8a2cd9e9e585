"""The workflow of a swing: effects of commands, images and solutions on its status.

Nothing here knows threads: the owner makes all calls in turn, and runs long
computations elsewhere.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import TypeVar

from lightpen.archive.logbook.lazy_logbook import LazyLogbook
from lightpen.cameras.protocol import Frame, Stats
from lightpen.detection.pen_detection import PenDetection
from lightpen.detection.reasons import Reason
from lightpen.errors import AcceptanceError, LightpenError
from lightpen.estimation.reports.verdict import Grade
from lightpen.formats.json_records import Plain
from lightpen.messages import Message, message
from lightpen.model.method import Method
from lightpen.record.library.supervision import Signature
from lightpen.record.results.acceptance import accept
from lightpen.record.results.assessment import SwingAssessment, assess
from lightpen.record.results.result_folder import FolderArchive
from lightpen.record.results.results import Result
from lightpen.record.swings.interrupted import discard_swing
from lightpen.record.swings.reading import (
    PRESS_TEST,
    Record,
    open_record,
    recorded_names,
    recorded_origin,
)
from lightpen.record.swings.solving import (
    Solution,
    report_by,
    solve_again,
    solve_record,
)
from lightpen.record.swings.writing import (
    RecordWriter,
    make_record_folder,
    note_excluded,
)
from lightpen.runners.faults import FaultReporter
from lightpen.runners.serial_queue import BackgroundTask, Report, StartThread, Task
from lightpen.swing.capture.rig_sighting import seen_by_rig
from lightpen.swing.capture.rules import (
    advance_swing,
    conclude,
    finish,
    forget_side,
    has_enough,
    pause,
    resume,
    stillness,
)
from lightpen.swing.capture.state import (
    Phase,
    SwingEvent,
    SwingEventKind,
    SwingSetup,
    SwingState,
    Transition,
)
from lightpen.swing.failed_swing import failed_swing
from lightpen.swing.operator_presence import OperatorPresence
from lightpen.swing.preparation import Preparation
from lightpen.swing.record_header import record_header
from lightpen.swing.resuming import Resumable, read_for_more, read_resumable
from lightpen.swing.status import Activity, SwingListener, SwingStatus, log_change
from lightpen.swing.swing_recorder import SwingRecorder
from lightpen.swing_messages import Code

T = TypeVar("T")
PRESS_IMAGES = 60  # at least, with firm pressure
PRESS_UNCERTAINTY = 1.0  # mm; limit of U in a press test, which ends no swing


class SwingWorkflow:
    """Successive swings, from the first image to acceptance.

    A command that is not possible in the present state is ignored. A new swing's record
    is made in the folder ``records``; without a logbook the outcome is only in files.
    """

    def __init__(
        self,
        records: Path,
        archive: FolderArchive,
        listener: SwingListener,
        now: Callable[[], datetime],
        start: StartThread,
        logbook: LazyLogbook | None,
    ) -> None:
        self._records = records
        self._archive = archive
        self._listener = listener
        self._now = now
        self._faults = FaultReporter(listener)
        self._logbook = logbook or LazyLogbook.none()
        self._start_beside = start
        self._catching_up: Task | None = None  # with events in files only
        self._status = SwingStatus()
        self._presence = OperatorPresence()
        self._recorder: SwingRecorder | None = None
        self._record: Record | None = None  # at its entry
        self._first: tuple[SwingStatus, Record] | None = None  # during a press test
        self._wanted: Mapping[int, str] = {}  # images to exclude
        self._tried: Mapping[int, str] = {}  # of them, those being computed without
        self._task = BackgroundTask(start, self.cancel, listener.on_progress)
        self._stopped_at: SwingStatus | None = None  # by a bug

    @property
    def status(self) -> SwingStatus:
        """The status as published last."""
        return self._status

    def recover(self) -> None:
        """Pause after an internal error; the swing is unchanged.

        Images are ignored until the status changes: all of them may cause it.
        """
        if not self._task.is_there:  # it may have ended by this bug
            self._status = replace(self._status, activity=Activity.NONE)
        try:
            self.pause()
            self._republish()
            self._faults.report(message("swing.bug"))
        finally:
            self._stopped_at = self._status

    def _publish(self, status: SwingStatus, *events: SwingEvent) -> None:
        """Set the status and notify."""
        is_open = status.is_capturing or (status.has_verdict and not status.result)
        has_others = is_open and self._presence.has_other_choices
        before = self._status
        self._status = replace(
            status, refusal=self._presence.refusal, has_other_choices=has_others
        )
        log_change(before, self._status, events)
        self._listener.on_swing(self._status, events)

    def _republish(self) -> None:
        self._publish(self._status)

    def go_on(self, swing: Resumable) -> None:
        """Resume a swing that was read back, or report why it cannot be."""
        self._faults.trying(lambda: self._enter(swing))

    # Presence of the operator

    def choose(self, preparation: Preparation) -> None:
        """Set the choices for the next swing; another source ends this one."""
        before = self._presence.choices
        self._presence = self._presence.choose(preparation)
        is_other = before is not None and before.sources != preparation.sources
        if is_other and self._status.is_capturing:
            self.abandon()
        self._republish()

    def keep_choices(self) -> None:
        """Continue with the choices that the swing began with."""
        presence = self._presence
        self._presence = replace(presence, begun_with=presence.choices)
        self._republish()

    def come(self) -> None:
        """Begin with the next image, or resume a swing that was paused by leaving."""
        was_paused = self._presence.paused_by_leaving
        self._presence = self._presence.come()
        if self._status.result is not None:  # that swing is concluded
            self.abandon()
        if was_paused:
            self._change(lambda state: Transition(resume(state)))
        self._republish()

    def leave(self) -> None:
        """Begin no swing, and pause the capture."""
        self._presence = self._presence.left()
        self._pause_unattended()

    def _pause_unattended(self) -> None:
        """Pause a swing without an operator."""
        status = self._status
        goes_on = status.is_capturing and not status.is_paused_by_user
        if goes_on and self._presence.is_away:
            self._presence = replace(self._presence, paused_by_leaving=True)
            self._change(lambda state: Transition(pause(state)))

    def try_again(self) -> None:
        """Forget why no swing could begin."""
        self._presence = replace(self._presence, refusal=None)
        self._republish()

    # Capture

    def begin(
        self, preparation: Preparation, settings: dict[str, Plain] | None = None
    ) -> None:
        """Begin a new swing, or report why it cannot begin."""
        try:
            folder = make_record_folder(self._records, preparation.names, self._now())
            RecordWriter.create(folder, record_header(preparation, settings)).close()
            self._enter(read_resumable(folder))  # so with the files as recorded
        except LightpenError as error:
            self._presence = replace(self._presence, refusal=error.message)
            self._faults.report(error.message)
            self._republish()

    def _enter(self, swing: Resumable) -> None:
        """Enter a new swing, or resume an old one, as read from the disk."""
        status, record = self._status, swing.record
        if status.is_capturing and record.folder == status.record_folder:
            return  # it continues already
        names = recorded_names(record)
        recorder = SwingRecorder(record)
        self._task.drop()
        self._close_record()
        self._first = None
        self._recorder, self._record = recorder, record
        if record.folder != status.record_folder:
            self._presence = self._presence.begun()
        self._faults.end()
        self._publish(
            SwingStatus(
                setup=swing.setup,
                state=replace(swing.state, heading=self._heading_for(swing)),
                record_folder=record.folder,
                names=names,
                origin=recorded_origin(record),
            )
        )
        self._pause_unattended()
        if not swing.setup.is_recording and has_enough(swing.setup, swing.state):
            self.finish()  # it was interrupted after its last image

    def press(self) -> None:
        """Begin a short swing with firm pressure, to be compared with this one."""
        first, record, choices = self._status, self._record, self._presence.choices
        if first.solution is None or self._task.is_there or first.is_recording:
            return
        if record is None or choices is None:
            return
        is_other = self._presence.has_other_choices or choices.names != first.names
        if is_other or choices.missing_inputs():
            self._faults.report(message("press-test.other-choices"))
            return
        limits = replace(
            choices.limits, min_images=PRESS_IMAGES, max_uncertainty=PRESS_UNCERTAINTY
        )
        self.begin(replace(choices, limits=limits), {PRESS_TEST: True})
        if self._status.record_folder != first.record_folder:
            self._first = replace(first, pressed=None), record

    def _end_press(self, pressed: Solution | None) -> None:
        """Set the swing with firm pressure aside, and return to the one before."""
        folder = self._status.record_folder
        assert self._first is not None
        assert folder is not None
        (first, self._record), self._first = self._first, None
        assert first.solution is not None
        self._task.drop()
        self._close_record()
        self._faults.trying(lambda: discard_swing(folder))
        self._wanted = first.solution.excluded
        self._publish(replace(first, pressed=pressed), SwingEvent(SwingEventKind.DONE))

    def _heading_for(self, swing: Resumable) -> float | None:
        """Return the operator's heading from this swing or from the station."""
        status, choices = self._status, self._presence.choices
        if swing.setup.is_recording:
            return None
        if status.record_folder == swing.record.folder and status.state is not None:
            return status.state.heading
        return None if choices is None else choices.heading

    def forget_side(self) -> None:
        """Ask the operator again which side is the right one."""
        self._change(lambda state: Transition(forget_side(state)))

    def take(
        self,
        frame: Frame,
        detection: PenDetection | None,
        setup: SwingSetup | None,
        n_images: int | None,
        stats: Stats | None,
    ) -> None:
        """Process an image; see `SwingRunner.take`."""
        status, choices = self._status, self._presence.choices
        if status is self._stopped_at:
            return
        if detection is not None and setup is not None:
            detection = seen_by_rig(setup.rig, setup.pen, detection)
        if status.state is None:
            if self._presence.is_due and choices is not None:
                self.begin(choices)
        elif detection is None:
            pass
        elif status.state.phase is Phase.VERDICT:
            if status.setup is not None and not status.setup.is_recording:
                self._watch(status.state, detection, frame)
        elif status.is_capturing and setup is status.setup:
            self._capture(status.state, detection, frame, n_images, stats)

    def _capture(
        self,
        before: SwingState,
        detection: PenDetection,
        frame: Frame,
        n_images: int | None,
        stats: Stats | None,
    ) -> None:
        setup, recorder = self._status.setup, self._recorder
        assert setup is not None
        assert recorder is not None
        try:
            transition = recorder.capture(
                setup, before, frame, detection, n_images, stats
            )
        except LightpenError as error:
            self._become(Transition(pause(before)), has_fault=True)
            self._faults.report(error.message)
            return
        if transition is None:
            return
        if any(event.what is SwingEventKind.KEPT for event in transition.events):
            self._faults.end()
        self._become(transition)

    def _watch(self, before: SwingState, detection: PenDetection, frame: Frame) -> None:
        """Watch for the confirmation: the pen held upright and still."""
        setup = self._status.setup
        assert setup is not None
        state = advance_swing(setup, before, detection, frame.host_ts_ns * 1e-9).state
        says_yes = stillness(state) == 1.0 and stillness(before) < 1.0
        events = (SwingEvent(SwingEventKind.CONFIRMED),) if says_yes else ()
        self._publish(replace(self._status, state=state), *events)

    def pause(self) -> None:
        """Pause for the user."""
        self._presence = replace(self._presence, paused_by_leaving=False)
        self._change(lambda state: Transition(pause(state)))

    def resume(self) -> None:
        """Resume after a pause by the user."""
        self._presence = replace(self._presence, paused_by_leaving=False)
        self._change(lambda state: Transition(resume(state)))

    def _change(self, act: Callable[[SwingState], Transition]) -> None:
        """Apply a command to a swing that is being captured."""
        status = self._status
        if status.is_capturing and status.state is not None:
            self._become(act(status.state))

    def _become(self, transition: Transition, *, has_fault: bool = False) -> None:
        state = transition.state
        ends = state.phase is Phase.SOLVING
        status = replace(self._status, state=state)
        if ends:
            self._close_record()
            status = replace(status, activity=Activity.SOLVING)
        has_fault = has_fault or (status.has_fault and status.is_paused_by_user)
        self._publish(replace(status, has_fault=has_fault), *transition.events)
        if ends:
            self.solve()

    def abandon(self) -> None:
        """Suspend the swing; its record stays on disk."""
        if self._first is not None:
            self._end_press(None)
        self._task.drop()
        self._close_record()
        self._publish(SwingStatus(setup=self._status.setup))

    def set_aside(self) -> None:
        """Discard the swing, or report why that cannot be recorded."""
        self._faults.trying(self._discard)

    def _discard(self) -> None:
        if self._first is not None:
            self._end_press(None)
            return
        status = self._status
        if status.record_folder is None or status.result is not None:
            return
        if self._recorder is None:
            discard_swing(status.record_folder)
        else:
            self._recorder.discard()
        self.abandon()
        self._faults.trying(
            lambda: self._logbook.enter_set_aside(
                status.solution, status.assessment, self._now()
            )
        )

    def start_over(self) -> None:
        """Discard the swing, unless it is accepted, and begin a new one."""
        if self._status.result is None:
            self.set_aside()
        else:
            self.abandon()
        self.try_again()

    def capture_more(self) -> None:
        """Read the images of a swing that has its verdict, and capture more."""
        status = self._status
        folder, state = status.record_folder, status.state
        if folder is None or state is None or status.result is not None:
            return
        if state.phase is not Phase.VERDICT or status.is_reading:
            return
        if status.setup is None or status.setup.is_recording:
            return
        self.cancel()
        self._start(
            Activity.READING,
            lambda _: read_for_more(folder),
            self._on_read,
            self._on_unread,
        )

    def _on_read(self, swing: Resumable) -> None:
        try:
            self._enter(swing)
        except LightpenError as error:
            self._on_unread(error.message)

    def _on_unread(self, why: Message) -> None:
        self._faults.report(why)
        self._publish(replace(self._status, activity=Activity.NONE))

    def _close_record(self) -> None:
        recorder, self._recorder = self._recorder, None
        if recorder is not None:
            recorder.close()

    # Solution

    def solve(self) -> None:
        """Start computing the tip."""
        status, folder = self._status, self._status.record_folder
        if folder is None or self._task.is_there:
            return
        if not status.is_capturing and status.result is None:
            self._compute(lambda report: solve_record(open_record(folder), report))

    def finish(self) -> None:
        """End the capture with the present images."""
        self._change(finish)

    def exclude(self, numbers: Iterable[int]) -> None:
        """Exclude images and compute the tip again."""
        self._want({**self._wanted, **dict.fromkeys(numbers, str(Reason.TAKEN_OUT))})

    def use_part(self) -> None:
        """Compute again with the longer part of a swing with a step."""
        solution = self._status.solution
        step = None if solution is None else solution.calibration.step
        if solution is None or step is None:
            return
        begin, end = step.longer_part(len(solution.numbers))
        outside = (*solution.numbers[: begin - 1], *solution.numbers[end:])
        reasons = dict.fromkeys(map(int, outside), str(Reason.OUTSIDE))
        self._want({**self._wanted, **reasons})

    def include(self, numbers: Iterable[int]) -> None:
        """Include images again and compute the tip again."""
        back = set(numbers)
        self._want({n: why for n, why in self._wanted.items() if n not in back})

    def report_by(self, method: Method) -> None:
        """Report the tip of a solution that is not accepted by another method."""
        status, record = self._status, self._record
        if status.solution is None or record is None or self._task.is_there:
            return
        if status.result is not None or status.solution.source.method == method:
            return
        solution = report_by(status.solution, method)
        assessment = assess(self._archive, record, solution)
        self._publish(replace(status, solution=solution, assessment=assessment))

    def _want(self, excluded: Mapping[int, str]) -> None:
        """Solve without these images, now or after the present computation."""
        status = self._status
        if status.solution is None or status.result is not None or status.is_reading:
            return
        self._wanted = excluded
        if not self._task.is_there:
            self._solve_again(status.solution)

    def _solve_again(self, solution: Solution) -> None:
        wanted = self._wanted
        self._compute(lambda _: solve_again(solution, wanted))

    def _compute(self, work: Callable[[Report], Solution]) -> None:
        archive, record = self._archive, self._record
        assert record is not None

        def solved(report: Report) -> tuple[Solution, SwingAssessment]:
            solution = work(report)
            return solution, assess(archive, record, solution)

        self._tried = self._wanted
        self._start(Activity.SOLVING, solved, self._on_solved, self._on_unsolved)

    def _start(
        self,
        activity: Activity,
        work: Callable[[Report], T],
        then: Callable[[T], None],
        otherwise: Callable[[Message], None],
    ) -> None:
        self._task.begin(work, then, otherwise)
        self._publish(replace(self._status, activity=activity))

    def cancel(self) -> None:
        """Stop computing and reading."""
        if not self._task.is_there:
            return
        self._task.drop()
        if self._status.solution is not None:
            self._wanted = self._status.solution.excluded
        self._publish(replace(self._status, activity=Activity.NONE))

    def _on_solved(self, solved: tuple[Solution, SwingAssessment]) -> None:
        solution, assessment = solved
        if self._first is not None:
            self._end_press(solution)
            return
        status = self._status
        before, folder, state = status.solution, status.record_folder, status.state
        assert folder is not None
        assert state is not None
        if before is None:
            self._wanted = solution.excluded
        elif before.excluded != solution.excluded:
            try:
                note_excluded(folder, solution.excluded)
            except LightpenError as error:
                self._keep_solution(before, error.message)
                return
        self._faults.end()
        verdict = assessment.verdict
        goes_on = self._wanted != solution.excluded
        activity = Activity.SOLVING if goes_on else Activity.NONE
        status = replace(
            status,
            solution=solution,
            assessment=assessment,
            failed=None,
            result=None,
            activity=activity,
        )
        self._conclude(status, verdict.reason, verdict.grade is not Grade.REPEAT)
        if goes_on:
            self._solve_again(solution)

    def _on_unsolved(self, why: Message) -> None:
        if self._first is not None:
            self._faults.report(message("press-test.unsolved", why=why))
            self._end_press(None)
            return
        solution = self._status.solution
        if solution is None:
            state, setup = self._status.state, self._status.setup
            assert state is not None
            assert setup is not None
            failed = failed_swing(setup, state.kept, why)
            status = replace(self._status, activity=Activity.NONE, failed=failed)
            self._conclude(
                status, message(Code.NO_TIP, why=failed.causes[0]), passed=False
            )
            return
        if set(self._tried) > set(solution.excluded):
            why = message("swing.images-stay-in", why=why)
        self._keep_solution(solution, why)

    def _keep_solution(self, solution: Solution, why: Message) -> None:
        """Keep the solution and its images, and report why."""
        if self._wanted != self._tried:  # the user continued meanwhile
            self._solve_again(solution)
            return
        self._wanted = solution.excluded
        self._faults.report(why)
        self._publish(replace(self._status, activity=Activity.NONE))

    def _conclude(self, status: SwingStatus, reason: Message, passed: bool) -> None:
        assert status.state is not None
        is_first = status.state.phase is not Phase.VERDICT
        transition = conclude(status.state, reason, passed)
        status = replace(status, state=transition.state)
        self._publish(status, *(transition.events if is_first else ()))

    def accept(self, reason: str = "", signature: Signature | None = None) -> None:
        """Accept the tip, or report why it cannot be; the previous one then stays.

        A reason is needed to accept it despite findings, a signature where there are
        supervisors.
        """
        self._faults.trying(lambda: self._store(reason, signature))

    def _store(self, reason: str, signature: Signature | None) -> None:
        status, solution = self._status, self._status.solution
        if solution is None or self._task.is_there or status.result is not None:
            return
        self._publish(replace(status, activity=Activity.ACCEPTING))
        try:
            now = self._now()
            result = accept(self._archive, solution, now, reason, signature)
            status = replace(status, result=result)
            self._faults.end()
            self._faults.trying(self._logbook.enter_owed)
        except AcceptanceError:  # something else has come into force meanwhile
            record = open_record(solution.source.folder)
            assessment = assess(self._archive, record, solution)
            status = replace(status, assessment=assessment)
            raise
        finally:
            self._publish(status)

    def revoke(
        self,
        result: Result,
        operator: str,
        reason: str = "",
        signature: Signature | None = None,
    ) -> None:
        """Revoke a result in favour of the one before, or report why not.

        The reason is in the words of the operator.
        """
        self._faults.trying(lambda: self._withdraw(result, operator, reason, signature))

    def _withdraw(
        self, result: Result, operator: str, reason: str, signature: Signature | None
    ) -> None:
        self._archive.revoke(result, operator, self._now(), reason, signature)
        status, own = self._status, self._status.result
        if own is not None and own.record == result.record:
            status = replace(status, result=None)
        self._faults.trying(self._logbook.enter_owed)
        self._publish(replace(status, revoked=result))

    def open_logbook(self) -> None:
        """Enter events that are in files only, in the background."""
        self._catching_up = self._start_beside(
            self._logbook.enter_owed,
            self._on_caught_up,
            self._faults.report,
            lambda: None,
            lambda fraction: None,
        )

    def _on_caught_up(self, faults: tuple[Message, ...]) -> None:
        for fault in faults:
            self._faults.report(fault)

    def shut_down(self) -> None:
        """Suspend the swing, whose record stays on disk, and close the archive."""
        self.abandon()
        if self._catching_up is not None:
            self._catching_up.cancel()
        self._faults.trying(self._logbook.close)
