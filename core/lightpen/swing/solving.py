"""The solution of a swing: computed, without images, accepted, revoked."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from datetime import datetime
from typing import TypeVar

from lightpen.archive.lazy_logbook import LazyLogbook
from lightpen.detection.reasons import Reason
from lightpen.errors import AcceptanceError, LightpenError
from lightpen.estimation.reports.verdict import Grade
from lightpen.messages import Code, Message, message
from lightpen.model.names import Method
from lightpen.record.library.supervision import Signature
from lightpen.record.results.acceptance import SwingAssessment, accept, assess
from lightpen.record.results.result_folder import FolderArchive
from lightpen.record.results.results import Result
from lightpen.record.swings.reading import Record, open_record
from lightpen.record.swings.solving import (
    Solution,
    report_by,
    solve_again,
    solve_record,
)
from lightpen.record.swings.writing import note_excluded
from lightpen.runners import BackgroundTask, Report, StartThread
from lightpen.swing.capture.rules import conclude
from lightpen.swing.capture.state import Phase
from lightpen.swing.status import (
    Activity,
    PublishedSwing,
    SwingListener,
    SwingStatus,
    failed_swing,
)

T = TypeVar("T")


class SwingSolving:
    """Computes the tip of the swing at hand in the background, and accepts it.

    ``end_press`` is given the solution of a press test, or None if there is none; it
    returns whether the swing is one.
    """

    def __init__(
        self,
        shown: PublishedSwing,
        archive: FolderArchive,
        listener: SwingListener,
        now: Callable[[], datetime],
        start: StartThread,
        logbook: LazyLogbook,
        end_press: Callable[[Solution | None], bool],
    ) -> None:
        self._shown = shown
        self._archive = archive
        self._now = now
        self._faults = shown.faults
        self._logbook = logbook
        self._end_press = end_press
        self.record: Record | None = None  # at the entry of the swing
        self.wanted: Mapping[int, str] = {}  # images to exclude
        self._tried: Mapping[int, str] = {}  # of them, those being computed without
        self._task = BackgroundTask(start, self.cancel, listener.on_progress)

    @property
    def is_busy(self) -> bool:
        """Whether something is computed or read."""
        return self._task.is_there

    def drop(self) -> None:
        """Forget what is computed or read; the status stays."""
        self._task.drop()

    def solve(self) -> None:
        """Start computing the tip."""
        status, folder = self._shown.status, self._shown.status.record_folder
        if folder is None or self.is_busy:
            return
        if not status.is_capturing and status.result is None:
            self._compute(lambda report: solve_record(open_record(folder), report))

    def exclude(self, numbers: Iterable[int]) -> None:
        """Exclude images and compute the tip again."""
        self._want({**self.wanted, **dict.fromkeys(numbers, str(Reason.TAKEN_OUT))})

    def use_part(self) -> None:
        """Compute again with the longer part of a swing with a step."""
        solution = self._shown.status.solution
        step = None if solution is None else solution.calibration.step
        if solution is None or step is None:
            return
        begin, end = step.longer_part(len(solution.numbers))
        outside = (*solution.numbers[: begin - 1], *solution.numbers[end:])
        reasons = dict.fromkeys(map(int, outside), str(Reason.OUTSIDE))
        self._want({**self.wanted, **reasons})

    def include(self, numbers: Iterable[int]) -> None:
        """Include images again and compute the tip again."""
        back = set(numbers)
        self._want({n: why for n, why in self.wanted.items() if n not in back})

    def report_by(self, method: Method) -> None:
        """Report the tip of a solution that is not accepted by another method."""
        status, record = self._shown.status, self.record
        if status.solution is None or record is None or self.is_busy:
            return
        if status.result is not None or status.solution.source.method == method:
            return
        solution = report_by(status.solution, method)
        assessment = assess(self._archive, record, solution)
        self._shown.publish(replace(status, solution=solution, assessment=assessment))

    def _want(self, excluded: Mapping[int, str]) -> None:
        """Solve without these images, now or after the present computation."""
        status = self._shown.status
        if status.solution is None or status.result is not None or status.is_reading:
            return
        self.wanted = excluded
        if not self.is_busy:
            self._solve_again(status.solution)

    def _solve_again(self, solution: Solution) -> None:
        wanted = self.wanted
        self._compute(lambda _: solve_again(solution, wanted))

    def _compute(self, work: Callable[[Report], Solution]) -> None:
        archive, record = self._archive, self.record
        assert record is not None

        def solved(report: Report) -> tuple[Solution, SwingAssessment]:
            solution = work(report)
            return solution, assess(archive, record, solution)

        self._tried = self.wanted
        self.start(Activity.SOLVING, solved, self._on_solved, self._on_unsolved)

    def start(
        self,
        activity: Activity,
        work: Callable[[Report], T],
        then: Callable[[T], None],
        otherwise: Callable[[Message], None],
    ) -> None:
        """Do something beside, instead of what is being done."""
        self._task.begin(work, then, otherwise)
        self._shown.publish(replace(self._shown.status, activity=activity))

    def cancel(self) -> None:
        """Stop computing and reading."""
        if not self.is_busy:
            return
        self._task.drop()
        if self._shown.status.solution is not None:
            self.wanted = self._shown.status.solution.excluded
        self._shown.publish(replace(self._shown.status, activity=Activity.NONE))

    def _on_solved(self, solved: tuple[Solution, SwingAssessment]) -> None:
        solution, assessment = solved
        if self._end_press(solution):
            return
        status = self._shown.status
        before, folder, state = status.solution, status.record_folder, status.state
        assert folder is not None
        assert state is not None
        if before is None:
            self.wanted = solution.excluded
        elif before.excluded != solution.excluded:
            try:
                note_excluded(folder, solution.excluded)
            except LightpenError as error:
                self._keep_solution(before, error.message)
                return
        self._faults.end()
        verdict = assessment.verdict
        goes_on = self.wanted != solution.excluded
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
        if self._end_press(None):
            self._faults.report(message("press-test.unsolved", why=why))
            return
        solution = self._shown.status.solution
        if solution is None:
            state, setup = self._shown.status.state, self._shown.status.setup
            assert state is not None
            assert setup is not None
            failed = failed_swing(setup, state.kept, why)
            status = replace(self._shown.status, activity=Activity.NONE, failed=failed)
            self._conclude(
                status, message(Code.NO_TIP, why=failed.causes[0]), passed=False
            )
            return
        if set(self._tried) > set(solution.excluded):
            why = message("swing.images-stay-in", why=why)
        self._keep_solution(solution, why)

    def _keep_solution(self, solution: Solution, why: Message) -> None:
        """Keep the solution and its images, and report why."""
        if self.wanted != self._tried:  # the user continued meanwhile
            self._solve_again(solution)
            return
        self.wanted = solution.excluded
        self._faults.report(why)
        self._shown.publish(replace(self._shown.status, activity=Activity.NONE))

    def _conclude(self, status: SwingStatus, reason: Message, passed: bool) -> None:
        assert status.state is not None
        is_first = status.state.phase is not Phase.VERDICT
        transition = conclude(status.state, reason, passed)
        status = replace(status, state=transition.state)
        self._shown.publish(status, *(transition.events if is_first else ()))

    def accept(self, reason: str = "", signature: Signature | None = None) -> None:
        """Accept the tip, or report why it cannot be; the previous one then stays.

        A reason is needed to accept it despite findings, a signature where there are
        supervisors.
        """
        self._faults.trying(lambda: self._store(reason, signature))

    def _store(self, reason: str, signature: Signature | None) -> None:
        status, solution = self._shown.status, self._shown.status.solution
        if solution is None or self.is_busy or status.result is not None:
            return
        self._shown.publish(replace(status, activity=Activity.ACCEPTING))
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
            self._shown.publish(status)

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
        status, own = self._shown.status, self._shown.status.result
        if own is not None and own.record == result.record:
            status = replace(status, result=None)
        self._faults.trying(self._logbook.enter_owed)
        self._shown.publish(replace(status, revoked=result))
