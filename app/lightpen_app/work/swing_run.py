"""One swing from its first image to the accepted tip."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path

from PySide6.QtCore import QObject, Signal

from lightpen.detection.reasons import Reason
from lightpen.errors import FileError
from lightpen.estimation.verdict import Grade, Verdict, judge
from lightpen.live.looking import Swinging
from lightpen.messages import no_tip
from lightpen.model.limits import SwingLimits
from lightpen.record.acceptance import accept
from lightpen.record.folder_archive import RECORDS, FolderArchive
from lightpen.record.names import Names, new_folder
from lightpen.record.reading import open_record, recorded_limits, recorded_names
from lightpen.record.results import Result
from lightpen.record.solving import Solution, solve_again, solve_record
from lightpen.record.unfinished import (
    discard_swing,
)
from lightpen.record.writing import RecordWriter, note_taken_out
from lightpen.sentences import Sentence
from lightpen.swing.preparation import (
    Preparation,
)
from lightpen.swing.resuming import Resumable, read_for_more, read_resumable
from lightpen.swing.rules import conclude
from lightpen.swing.state import (
    Phase,
    SwingSetup,
    SwingState,
)
from lightpen_app.look.sentences import worded
from lightpen_app.work.job import Job, Report
from lightpen_app.work.live_view import LiveView


class SwingRun(QObject):
    """Captures, solves and accepts, on the images of a live view.

    Parameters
    ----------
    live : LiveView
    folder : Path
        Records and results are kept in it.

    Signals
    -------
    changed()
        `state`, `solution` or what is under way is different.
    happened(Event)
        An event of the swing; the verdict is one, too.
    progressed(float)
        Of solving, 0 to 1.
    troubled(str)
        A sentence to be read: nothing is lost.
    relieved(str)
        The sentence of `troubled` whose cause is gone.
    """

    changed = Signal()
    happened = Signal(object)
    progressed = Signal(float)
    troubled = Signal(str)
    relieved = Signal(str)

    def __init__(
        self, live: LiveView, folder: Path, parent: QObject | None = None
    ) -> None:
        super().__init__(parent)
        self._live = live
        self._folder = folder
        self._archive = FolderArchive(folder)
        self._setup: SwingSetup | None = None
        self._state: SwingState | None = None
        self._record_folder: Path | None = None
        self._names = Names()
        self._limits = SwingLimits()
        self._solution: Solution | None = None
        self._verdict: Verdict | None = None
        self._result: Result | None = None
        self._wanted: Mapping[int, str] = {}
        self._tried: Mapping[int, str] = {}
        self._job: Job | None = None
        self._reading: Job | None = None
        self._trouble = ""

        # Connections
        live.swing_changed.connect(self._on_swing_changed)
        live.swing_left.connect(self._on_swing_left)
        live.happened.connect(self.happened)

    # What there is

    @property
    def setup(self) -> SwingSetup | None:
        """What the swing is captured with; None before the first."""
        return self._setup

    @property
    def state(self) -> SwingState | None:
        """The swing; None before the first."""
        return self._state

    @property
    def record_folder(self) -> Path | None:
        """Where the swing is recorded."""
        return self._record_folder

    @property
    def solution(self) -> Solution | None:
        """The tip by the images of the swing; None until it is solved."""
        return self._solution

    @property
    def verdict(self) -> Verdict | None:
        """What the solution is worth."""
        return self._verdict

    @property
    def result(self) -> Result | None:
        """The result that was accepted, or None."""
        return self._result

    @property
    def names(self) -> Names:
        """Who calibrates what with this swing."""
        return self._names

    @property
    def is_solving(self) -> bool:
        """Whether a solution is being computed."""
        return self._job is not None

    @property
    def is_reading(self) -> bool:
        """Whether the images of the swing are being read, to capture more."""
        return self._reading is not None

    @property
    def is_capturing(self) -> bool:
        """Whether images are being taken, or wait to be."""
        state = self._state
        return state is not None and state.phase not in (Phase.SOLVING, Phase.VERDICT)

    @property
    def archive(self) -> FolderArchive:
        """Where accepted results are kept."""
        return self._archive

    @property
    def records_folder(self) -> Path:
        """Where swings are recorded."""
        return self._folder / RECORDS

    # Capture

    def begin(self, preparation: Preparation) -> None:
        """Begin a new swing; the one before stays on the disk as it is.

        Raises
        ------
        FileError
            The record cannot be made.
        """
        now = datetime.now().astimezone()
        folder = new_folder(self.records_folder, preparation.names, now)
        RecordWriter.create(folder, preparation.header()).close()
        self.go_on(read_resumable(folder))  # so with the files as they are recorded

    def go_on(self, swing: Resumable) -> None:
        """Go on with an interrupted swing that was read back.

        Raises
        ------
        FileError
            The record cannot be written.
        """
        record = swing.record
        if self.is_capturing and record.folder == self._record_folder:
            return  # it goes on already
        writer = RecordWriter.resume(record)
        self._limits = recorded_limits(record)  # asking for more does not raise them
        swinging = Swinging(swing.setup, writer, swing.state)
        self._enter(recorded_names(record), record.folder, swinging)

    def capture_more(self) -> None:
        """Go on with this swing after its verdict, as soon as its images are read.

        Where they cannot be, it is `troubled`, and the solution stays.
        """
        folder = self._record_folder
        if folder is None:
            raise ValueError("`capture_more` needs a swing.")
        if self._result is not None:
            raise ValueError("The tip of this swing is in force: begin another one.")
        if self.is_reading:
            return
        self.cancel()
        self._reading = job = Job(lambda _: read_for_more(folder), self)

        # Connections
        job.succeeded.connect(self._on_read)
        job.failed.connect(self._on_unread)
        job.crashed.connect(self.cancel)
        job.start()
        self.changed.emit()

    def pause(self) -> None:
        """Pause the capture for the user."""
        self._live.pause()

    def resume(self) -> None:
        """Go on after a pause of the user."""
        self._live.resume()

    def finish(self) -> None:
        """End the capture with what there is, and solve."""
        self._live.finish()

    def abandon(self) -> None:
        """Leave the swing; its record can be resumed."""
        self.cancel()
        self._live.abandon()
        self._state = None
        self._solution = self._verdict = self._result = None
        self._record_folder = None
        self.changed.emit()

    # Solution

    def solve(self) -> None:
        """Compute the tip from the images on the disk."""
        folder = self._record_folder
        if folder is None:
            raise ValueError("`solve` needs a swing.")
        self._run(lambda report: solve_record(open_record(folder), report))

    def cancel(self) -> None:
        """Stop computing and reading; images, record and solution stay as they are."""
        jobs = [job for job in (self._job, self._reading) if job is not None]
        if not jobs:
            return
        self._job = self._reading = None
        for job in jobs:
            job.cancel()
        if self._solution is not None:
            self._wanted = self._solution.taken_out
        self.changed.emit()

    def take_out(self, numbers: Iterable[int]) -> None:
        """Leave images out, and solve again at once."""
        self._wish({**self._wanted, **dict.fromkeys(numbers, str(Reason.TAKEN_OUT))})

    def put_back(self, numbers: Iterable[int]) -> None:
        """Let images take part again, and solve again at once."""
        back = set(numbers)
        self._wish({n: why for n, why in self._wanted.items() if n not in back})

    def accept(self) -> Result:
        """Put the tip in force.

        Raises
        ------
        FileError
            It cannot be stored; the tip before stays in force.
        """
        solution = self._require_solution()
        now = datetime.now(UTC).astimezone()
        self._result = result = accept(self.archive, solution, now)
        self.changed.emit()
        return result

    def set_aside(self) -> None:
        """Leave the swing for good, as before a repetition; its images are kept.

        Raises
        ------
        FileError
            The record cannot be written.
        """
        folder = self._record_folder
        if folder is None:
            raise ValueError("`set_aside` needs a swing.")
        if self.is_capturing:
            self._live.abandon(partial(discard_swing, folder))
        else:
            discard_swing(folder)
        self.abandon()

    def shut_down(self) -> None:
        """Cancel what is under way; a swing that is captured can be resumed."""
        self.cancel()
        self._live.abandon()

    def _enter(self, names: Names, folder: Path, swinging: Swinging) -> None:
        self.cancel()
        self._names, self._record_folder = names, folder
        self._setup, self._state = swinging.setup, swinging.state
        self._solution = self._verdict = self._result = None
        self._wanted = {}
        self._relieve()
        self._live.swing(swinging)
        self.changed.emit()

    def _require_solution(self) -> Solution:
        if self._solution is None:
            raise ValueError("The swing must be solved.")
        return self._solution

    def _wish(self, taken_out: Mapping[int, str]) -> None:
        self._require_solution()
        self._wanted = taken_out
        if self._job is None:
            self._solve_again()

    def _solve_again(self) -> None:
        solution, wanted = self._require_solution(), self._wanted
        self._tried = wanted
        self._run(lambda report: solve_again(solution, wanted))

    def _run(self, function: Callable[[Report], Solution]) -> None:
        self._job = job = Job(function, self)

        # Connections
        job.progressed.connect(self.progressed)
        job.succeeded.connect(self._on_solved)
        job.failed.connect(self._on_unsolved)
        job.crashed.connect(self.cancel)
        job.start()
        self.changed.emit()

    def _on_swing_changed(self, state: SwingState) -> None:
        if self._record_folder is None:
            return  # it was abandoned since
        before, self._state = self._state, state
        self.changed.emit()
        if state.phase is Phase.SOLVING and (
            before is None or before.phase is not Phase.SOLVING
        ):
            self.solve()

    def _on_swing_left(self, left: Swinging) -> None:
        """Let the swing go on with the next camera."""
        folder = self._record_folder
        if folder is None or left.setup is not self._setup or not self.is_capturing:
            return
        try:
            writer = RecordWriter.resume(open_record(folder))
        except FileError as error:
            self.abandon()
            self._trouble_with(worded(error.sentence))
            return
        self._live.swing(replace(left, writer=writer))

    def _on_read(self, swing: Resumable) -> None:
        self._reading = None
        try:
            self.go_on(swing)
        except FileError as error:
            self._on_unread(worded(error.sentence))

    def _on_unread(self, sentence: str) -> None:
        self._reading = None
        self._trouble_with(sentence)
        self.changed.emit()

    def _on_solved(self, solution: Solution) -> None:
        assert self._record_folder is not None
        if self._solution is None:
            self._wanted = solution.taken_out
        elif self._solution.taken_out != solution.taken_out:
            try:
                note_taken_out(self._record_folder, solution.taken_out)
            except FileError as error:
                self._keep_solution(worded(error.sentence))
                return
        self._relieve()
        self._job, self._solution, self._result = None, solution, None
        self._verdict = judge(solution.calibration, self._limits)
        self._conclude(self._verdict.reason, self._verdict.grade is not Grade.REPEAT)
        if self._wanted != solution.taken_out:
            self._solve_again()

    def _on_unsolved(self, sentence: str) -> None:
        if self._solution is not None:
            if set(self._tried) > set(self._solution.taken_out):
                sentence = self.tr(
                    "Without these images there is no tip, so they stay in. {0}"
                ).format(sentence)
            self._keep_solution(sentence)
            return
        self._job = None
        self._conclude(no_tip(sentence), passed=False)

    def _keep_solution(self, sentence: str) -> None:
        """Leave the images as they were, and say why they cannot be as wanted."""
        self._job = None
        if self._wanted != self._tried:  # the user went on meanwhile
            self._solve_again()
            return
        self._wanted = self._require_solution().taken_out
        self._trouble_with(sentence)
        self.changed.emit()

    def _trouble_with(self, sentence: str) -> None:
        self._trouble = sentence
        self.troubled.emit(sentence)

    def _relieve(self) -> None:
        trouble, self._trouble = self._trouble, ""
        if trouble:
            self.relieved.emit(trouble)

    def _conclude(self, reason: Sentence, passed: bool) -> None:
        state = self._state
        assert state is not None
        first = state.phase is not Phase.VERDICT
        transition = conclude(state, reason, passed)
        self._state = transition.state
        self.changed.emit()
        for event in transition.events if first else ():
            self.happened.emit(event)
