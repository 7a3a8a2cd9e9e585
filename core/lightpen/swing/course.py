"""The course of a swing, step by step: what commands, images and solutions do to it.

Nothing here knows threads: one who owns a course makes all calls in turn, and has long
computations made elsewhere.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import TypeVar

from lightpen.archive.late_logbook import LateLogbook
from lightpen.cameras.protocol import Frame, Stats
from lightpen.detection.reasons import Reason
from lightpen.detection.sighting import Sighting
from lightpen.errors import AcceptanceError, LightpenError
from lightpen.estimation.verdict import Grade
from lightpen.messages import no_tip
from lightpen.record.acceptance import accept
from lightpen.record.archive import Archive
from lightpen.record.assessment import Assessment, assess
from lightpen.record.reading import Record, open_record, recorded_names, recorded_origin
from lightpen.record.results import Result
from lightpen.record.solving import Solution, solve_again, solve_record
from lightpen.record.supervision import Signature
from lightpen.record.unfinished import discard_swing
from lightpen.record.writing import RecordWriter, make_record_folder, note_taken_out
from lightpen.sentences import Sentence, sentence
from lightpen.swing.attendance import Attendance
from lightpen.swing.intake import Intake
from lightpen.swing.logbook_entries import LogbookEntries
from lightpen.swing.moment import seen_by_rig
from lightpen.swing.preparation import Preparation
from lightpen.swing.resuming import Resumable, read_for_more, read_resumable
from lightpen.swing.rules import (
    Transition,
    advance_swing,
    conclude,
    finish,
    has_enough,
    pause,
    resume,
    stillness,
)
from lightpen.swing.serial_queue import OneTask, Report, Start
from lightpen.swing.state import Happening, Phase, SwingEvent, SwingSetup, SwingState
from lightpen.swing.status import Activity, SwingListener, SwingStatus
from lightpen.swing.troubles import Troubles

T = TypeVar("T")


class SwingCourse:
    """One swing after another, from the first image to acceptance.

    What cannot be done in the state that the swing is in is not done.

    Parameters
    ----------
    records : Path
        Folder that a new swing's record is made in.
    archive : Archive
        Of the accepted results.
    now : callable
        Returns date and time with the time zone.
    logbook : LateLogbook or None
        That what becomes of swings is entered in; without one, files alone tell of it.
    """

    def __init__(
        self,
        records: Path,
        archive: Archive,
        listener: SwingListener,
        now: Callable[[], datetime],
        start: Start,
        logbook: LateLogbook | None,
    ) -> None:
        self._records = records
        self._archive = archive
        self._listener = listener
        self._now = now
        self._troubles = Troubles(listener)
        self._entries = LogbookEntries(logbook, start, self._troubles.tell)
        self._status = SwingStatus()
        self._attendance = Attendance()
        self._intake: Intake | None = None
        self._record: Record | None = None  # as it was when it was entered
        self._wanted: Mapping[int, str] = {}  # images that are to be taken out
        self._tried: Mapping[int, str] = {}  # of them, those being computed without
        self._task = OneTask(start, self.cancel, listener.on_progress)
        self._stopped_at: SwingStatus | None = None  # by a bug

    @property
    def status(self) -> SwingStatus:
        """The swing as it was told last."""
        return self._status

    def recover(self) -> None:
        """Carry on after a bug, which costs no more than what was being done.

        Images are not taken until something else has changed: they may all have it.
        """
        if not self._task.is_there:  # it may have ended by this bug
            self._status = replace(self._status, activity=Activity.NONE)
        try:
            self.pause()
            self._republish()
            self._troubles.tell(
                sentence(
                    "swing.bug",
                    "The program made a mistake of its own. The images kept so far "
                    "are safe; go on, or start the program again.",
                )
            )
        finally:
            self._stopped_at = self._status

    def _publish(self, status: SwingStatus, *events: SwingEvent) -> None:
        """Become this status, and tell of it."""
        is_open = status.is_capturing or _is_judged(status)
        has_others = is_open and self._attendance.has_other_choices
        self._status = replace(
            status,
            refusal=self._attendance.refusal,
            has_other_choices=has_others,
        )
        self._listener.on_swing(self._status, events)

    def _republish(self) -> None:
        self._publish(self._status)

    def go_on(self, swing: Resumable) -> None:
        """Go on with a swing that was read back, or say why it cannot be."""
        self._troubles.trying(lambda: self._enter(swing))

    # Attendance

    def choose(self, preparation: Preparation) -> None:
        """Know what is chosen now; images of another source are not of this swing."""
        before = self._attendance.choices
        self._attendance = replace(self._attendance, choices=preparation)
        is_other = before is not None and before.sources != preparation.sources
        if is_other and self._status.is_capturing:
            self.abandon()
        self._republish()

    def keep_choices(self) -> None:
        """Go on with what the swing began with."""
        attendance = self._attendance
        self._attendance = replace(attendance, begun_with=attendance.choices)
        self._republish()

    def come(self) -> None:
        """Begin with the next image, or go on where the leaving was what paused it."""
        was_paused = self._attendance.paused_by_leaving
        self._attendance = self._attendance.come()
        if self._status.result is not None:  # nothing more belongs to that swing
            self.abandon()
        if was_paused:
            self._change(lambda state: Transition(resume(state)))
        self._republish()

    def leave(self) -> None:
        """Begin nothing any more, and pause what is captured."""
        self._attendance = self._attendance.left()
        self._hold_back()

    def _hold_back(self) -> None:
        """Pause a swing that nobody is at."""
        status = self._status
        goes_on = status.is_capturing and not status.is_paused_by_user
        if goes_on and self._attendance.is_away:
            self._attendance = replace(self._attendance, paused_by_leaving=True)
            self._change(lambda state: Transition(pause(state)))

    def try_again(self) -> None:
        """Forget why no swing could begin."""
        self._attendance = replace(self._attendance, refusal=None)
        self._republish()

    # Capture

    def begin(self, preparation: Preparation) -> None:
        """Begin a new swing, or say why it cannot."""
        try:
            folder = make_record_folder(self._records, preparation.names, self._now())
            RecordWriter.create(folder, preparation.header()).close()
            self._enter(read_resumable(folder))  # so with the files as recorded
        except LightpenError as error:
            self._attendance = replace(self._attendance, refusal=error.sentence)
            self._troubles.tell(error.sentence)
            self._republish()

    def _enter(self, swing: Resumable) -> None:
        """Go on with a swing that was read from the disk, a new one or an old one."""
        status, record = self._status, swing.record
        if status.is_capturing and record.folder == status.record_folder:
            return  # it goes on already
        names = recorded_names(record)
        intake = Intake(record)
        self._task.drop()
        self._close_record()
        self._intake, self._record = intake, record
        if record.folder != status.record_folder:
            self._attendance = self._attendance.begun()
        self._troubles.end()
        self._publish(
            SwingStatus(
                setup=swing.setup,
                state=swing.state,
                record_folder=record.folder,
                names=names,
                origin=recorded_origin(record),
            )
        )
        self._hold_back()
        if not swing.setup.is_recording and has_enough(swing.setup, swing.state):
            self.finish()  # it was interrupted after its last image

    def take(
        self,
        frame: Frame,
        sighting: Sighting | None,
        setup: SwingSetup | None,
        n_images: int | None,
        stats: Stats | None,
    ) -> None:
        """Take an image, as `SwingRunner.take` has it."""
        status, choices = self._status, self._attendance.choices
        if status is self._stopped_at:
            return
        if sighting is not None and setup is not None:
            sighting = seen_by_rig(setup.rig, setup.pen, sighting)
        if status.state is None:
            if self._attendance.is_due and choices is not None:
                self.begin(choices)
        elif sighting is None:
            pass
        elif status.state.phase is Phase.VERDICT:
            if status.setup is not None and not status.setup.is_recording:
                self._watch(status.state, sighting, frame)
        elif status.is_capturing and setup is status.setup:
            self._capture(status.state, sighting, frame, n_images, stats)

    def _capture(
        self,
        before: SwingState,
        sighting: Sighting,
        frame: Frame,
        n_images: int | None,
        stats: Stats | None,
    ) -> None:
        setup, intake = self._status.setup, self._intake
        assert setup is not None
        assert intake is not None
        try:
            transition = intake.capture(
                *(setup, before, frame, sighting, n_images, stats)
            )
        except LightpenError as error:
            self._become(Transition(pause(before)), is_troubled=True)
            self._troubles.tell(error.sentence)
            return
        if transition is None:
            return
        if any(event.what is Happening.KEPT for event in transition.events):
            self._troubles.end()
        self._become(transition)

    def _watch(self, before: SwingState, sighting: Sighting, frame: Frame) -> None:
        """See whether the pen is held upright and still, by which its holder agrees."""
        setup = self._status.setup
        assert setup is not None
        state = advance_swing(setup, before, sighting, frame.host_ts_ns * 1e-9).state
        says_yes = stillness(state) == 1.0 and stillness(before) < 1.0
        events = (SwingEvent(Happening.CONFIRMED),) if says_yes else ()
        self._publish(replace(self._status, state=state), *events)

    def pause(self) -> None:
        """Pause for the user."""
        self._attendance = replace(self._attendance, paused_by_leaving=False)
        self._change(lambda state: Transition(pause(state)))

    def resume(self) -> None:
        """Go on after a pause of the user."""
        self._attendance = replace(self._attendance, paused_by_leaving=False)
        self._change(lambda state: Transition(resume(state)))

    def _change(self, act: Callable[[SwingState], Transition]) -> None:
        """Do with a swing that is captured what its user wants."""
        status = self._status
        if status.is_capturing and status.state is not None:
            self._become(act(status.state))

    def _become(self, transition: Transition, *, is_troubled: bool = False) -> None:
        state = transition.state
        ends = state.phase is Phase.SOLVING
        status = replace(self._status, state=state)
        if ends:
            self._close_record()
            status = replace(status, activity=Activity.SOLVING)
        is_troubled = is_troubled or (status.is_troubled and status.is_paused_by_user)
        self._publish(replace(status, is_troubled=is_troubled), *transition.events)
        if ends:
            self.solve()

    def abandon(self) -> None:
        """Leave the swing as it is on the disk."""
        self._task.drop()
        self._close_record()
        self._publish(SwingStatus(setup=self._status.setup))

    def set_aside(self) -> None:
        """Leave the swing for good, or say why it cannot be noted."""
        self._troubles.trying(self._discard)

    def _discard(self) -> None:
        status = self._status
        if status.record_folder is None or status.result is not None:
            return
        if self._intake is None:
            discard_swing(status.record_folder)
        else:
            self._intake.discard()
        self.abandon()
        self._troubles.trying(
            lambda: self._entries.enter_set_aside(status, self._now())
        )

    def start_over(self) -> None:
        """Set the swing aside, if its tip is not in force, and begin anew."""
        if self._status.result is None:
            self.set_aside()
        else:
            self.abandon()
        self.try_again()

    def capture_more(self) -> None:
        """Read the images of a swing that has its verdict, and go on with them."""
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
            *(Activity.READING, lambda _: read_for_more(folder)),
            *(self._on_read, self._on_unread),
        )

    def _on_read(self, swing: Resumable) -> None:
        try:
            self._enter(swing)
        except LightpenError as error:
            self._on_unread(error.sentence)

    def _on_unread(self, why: Sentence) -> None:
        self._troubles.tell(why)
        self._publish(replace(self._status, activity=Activity.NONE))

    def _close_record(self) -> None:
        intake, self._intake = self._intake, None
        if intake is not None:
            intake.close()

    # Solution

    def solve(self) -> None:
        """Have the tip computed."""
        status, folder = self._status, self._status.record_folder
        if folder is None or self._task.is_there:
            return
        if not status.is_capturing and status.result is None:
            self._compute(lambda report: solve_record(open_record(folder), report))

    def finish(self) -> None:
        """End the capture with what there is."""
        self._change(finish)

    def take_out(self, numbers: Iterable[int]) -> None:
        """Have the tip computed without these images."""
        self._want({**self._wanted, **dict.fromkeys(numbers, str(Reason.TAKEN_OUT))})

    def put_back(self, numbers: Iterable[int]) -> None:
        """Have the tip computed with these images again."""
        back = set(numbers)
        self._want({n: why for n, why in self._wanted.items() if n not in back})

    def _want(self, taken_out: Mapping[int, str]) -> None:
        """Solve without these images, or once what is being computed is there."""
        status = self._status
        if status.solution is None or status.result is not None or status.is_reading:
            return
        self._wanted = taken_out
        if not self._task.is_there:
            self._solve_again(status.solution)

    def _solve_again(self, solution: Solution) -> None:
        wanted = self._wanted
        self._compute(lambda _: solve_again(solution, wanted))

    def _compute(self, work: Callable[[Report], Solution]) -> None:
        archive, record = self._archive, self._record
        assert record is not None

        def solved(report: Report) -> _Solved:
            solution = work(report)
            return _Solved(solution, assess(archive, record, solution))

        self._tried = self._wanted
        self._start(Activity.SOLVING, solved, self._on_solved, self._on_unsolved)

    def _start(
        self,
        activity: Activity,
        work: Callable[[Report], T],
        then: Callable[[T], None],
        otherwise: Callable[[Sentence], None],
    ) -> None:
        self._task.begin(work, then, otherwise)
        self._publish(replace(self._status, activity=activity))

    def cancel(self) -> None:
        """Stop computing and reading."""
        if not self._task.is_there:
            return
        self._task.drop()
        if self._status.solution is not None:
            self._wanted = self._status.solution.taken_out
        self._publish(replace(self._status, activity=Activity.NONE))

    def _on_solved(self, solved: "_Solved") -> None:
        solution = solved.solution
        status = self._status
        before, folder, state = status.solution, status.record_folder, status.state
        assert folder is not None
        assert state is not None
        if before is None:
            self._wanted = solution.taken_out
        elif before.taken_out != solution.taken_out:
            try:
                note_taken_out(folder, solution.taken_out)
            except LightpenError as error:
                self._keep_solution(before, error.sentence)
                return
        self._troubles.end()
        verdict = solved.assessment.verdict
        goes_on = self._wanted != solution.taken_out
        activity = Activity.SOLVING if goes_on else Activity.NONE
        status = replace(
            status,
            solution=solution,
            assessment=solved.assessment,
            result=None,
            activity=activity,
        )
        self._conclude(status, verdict.reason, verdict.grade is not Grade.REPEAT)
        if goes_on:
            self._solve_again(solution)

    def _on_unsolved(self, why: Sentence) -> None:
        solution = self._status.solution
        if solution is None:
            status = replace(self._status, activity=Activity.NONE)
            self._conclude(status, no_tip(why), passed=False)
            return
        if set(self._tried) > set(solution.taken_out):
            why = sentence(
                "swing.images-stay-in",
                "Without these images there is no tip, so they stay in. {why}",
                why=why,
            )
        self._keep_solution(solution, why)

    def _keep_solution(self, solution: Solution, why: Sentence) -> None:
        """Leave the images as they were, and say why they cannot be as wanted."""
        if self._wanted != self._tried:  # the user went on meanwhile
            self._solve_again(solution)
            return
        self._wanted = solution.taken_out
        self._troubles.tell(why)
        self._publish(replace(self._status, activity=Activity.NONE))

    def _conclude(self, status: SwingStatus, reason: Sentence, passed: bool) -> None:
        assert status.state is not None
        is_first = status.state.phase is not Phase.VERDICT
        transition = conclude(status.state, reason, passed)
        status = replace(status, state=transition.state)
        self._publish(status, *(transition.events if is_first else ()))

    def accept(self, reason: str, signature: Signature | None = None) -> None:
        """Put the tip in force, or say why it cannot be."""
        self._troubles.trying(lambda: self._store(reason, signature))

    def _store(self, reason: str, signature: Signature | None) -> None:
        status, solution = self._status, self._status.solution
        if solution is None or self._task.is_there or status.result is not None:
            return
        self._publish(replace(status, activity=Activity.ACCEPTING))
        try:
            now = self._now()
            result = accept(self._archive, solution, now, reason, signature)
            status = replace(status, result=result)
            self._troubles.end()
            self._troubles.trying(self._entries.enter_owed)
        except AcceptanceError:  # something else has come into force meanwhile
            record = open_record(solution.source.folder)
            assessment = assess(self._archive, record, solution)
            status = replace(status, assessment=assessment)
            raise
        finally:
            self._publish(status)

    def take_back(self, result: Result, operator: str) -> None:
        """Let the result before one in force be in force again, or say why not."""
        self._troubles.trying(lambda: self._withdraw(result, operator))

    def _withdraw(self, result: Result, operator: str) -> None:
        self._archive.take_back(result, operator, self._now())
        status, own = self._status, self._status.result
        if own is not None and own.record == result.record:
            status = replace(status, result=None)
        self._troubles.trying(self._entries.enter_owed)
        self._publish(replace(status, taken_back=result))

    def open_logbook(self) -> None:
        """Enter what the files tell of, beside the images: it may take long."""
        self._entries.catch_up()

    def shut_down(self) -> None:
        """Leave the swing as it is on the disk, and let go of the archive."""
        self.abandon()
        self._entries.stop()
        self._troubles.trying(self._entries.close)


def _is_judged(status: SwingStatus) -> bool:
    """Whether a swing has its verdict, but is not accepted."""
    state = status.state
    is_accepted = status.result is not None
    return state is not None and state.phase is Phase.VERDICT and not is_accepted


@dataclass(frozen=True, eq=False)
class _Solved:
    """What came of computing the tip."""

    solution: Solution
    assessment: Assessment
