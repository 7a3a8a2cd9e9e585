"""What is kept of one verification after another: images, records, and how to go on."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path

from lightpen.model.origin import Origin
from lightpen.record.outcome import TrialOutcome
from lightpen.record.verifications import TOUCHES
from lightpen.verification.choices import TaskKind, VerificationChoices
from lightpen.verification.conclusion import Conclusion
from lightpen.verification.going_on import GoneOn
from lightpen.verification.keeping import (
    TouchedImages,
    task_record,
    verifications_folder,
)
from lightpen.verification.recorded_runs import Done
from lightpen.verification.session_records import (
    KeptRecord,
    SessionRecords,
    concluding,
)
from lightpen.verification.session_state import SessionState
from lightpen.verification.status import VerificationStatus
from lightpen.verification.tip_in_force import TipInForce
from lightpen.verification.touch_images import NewRecord, TouchImages
from lightpen.verification.under_way import (
    ReadImages,
    UnderWay,
    UnderWayFile,
    under_way_path,
)
from lightpen.verification.witness import LampWitness


@dataclass(frozen=True, eq=False)
class _TaskDone:
    """A task that is done, with which tip, and the images of its touches."""

    task: TaskKind
    tip: TipInForce
    images: TouchedImages


class SessionKeeping:
    """Keeps what is touched and found, each thing as soon as it is known.

    Parameters
    ----------
    data : Path
        Folder that it is kept in.
    new_record : callable
        Makes a record for the images of the run at hand.
    now : callable
        Returns date and time with the time zone.

    Attributes
    ----------
    images : TouchImages
        Of live touches.
    """

    def __init__(
        self,
        data: Path,
        new_record: Callable[[], NewRecord],
        now: Callable[[], datetime],
    ) -> None:
        self._data = data
        self._now = now
        self.images = TouchImages(new_record)
        self._records = SessionRecords(data)
        self._unkept: tuple[_TaskDone, ...] = ()  # whose drift is not known yet
        self._read: tuple[ReadImages, ...] = ()
        self._file: UnderWayFile | None = None  # of the verification under way

    @property
    def files(self) -> tuple[Path, ...]:
        """What is written of the session at hand."""
        return self._records.files

    @property
    def is_behind(self) -> bool:
        """Whether something could not be written yet."""
        return self._records.are_waiting

    def has_read(self, task: TaskKind) -> bool:
        """Return whether a task that is done was done with recorded images."""
        return any(images.task is task for images in self._read)

    def root(self, tip: TipInForce) -> Path:
        """Return the folder of the verifications of a tip."""
        is_simulated = tip.origin is Origin.SIMULATED
        return verifications_folder(self._data, is_simulated=is_simulated)

    def add_task(
        self, task: TaskKind, tip: TipInForce, witness: LampWitness | None
    ) -> None:
        """Keep what a task found by live touches, when its witness is known."""
        records = self.images.records(task)
        images = TouchedImages(tip.origin, witness=witness, records=records)
        self._unkept = (*self._unkept, _TaskDone(task, tip, images))

    def add_read(self, images: ReadImages, done: Done) -> None:
        """Keep what a task found by recorded images, when its witness is known."""
        self._read = (*self._read, images)
        self._unkept = (*self._unkept, _TaskDone(done.task, done.tip, done.images))

    def settle(self, status: VerificationStatus) -> None:
        """Have written what was found, unless a witness will tell more of it."""
        state = status.state
        if state is None:
            return
        waiting = {each.task for each in state.unwitnessed}
        done = self._unkept
        self._unkept = tuple(each for each in done if each.task in waiting)
        for each in done:
            found = state.found(each.task)
            if each.task not in waiting and found is not None:
                self._add(Done(each.task, found, each.tip, each.images), status)

    def forget_but(self, state: SessionState) -> None:
        """Forget the images of what is to be touched again."""
        kinds = {kind for kind in TaskKind if state.found(kind) is not None}
        if state.visits:
            kinds.add(TaskKind.DRIFT)
        self.images.forget_but(kinds)
        self._unkept = tuple(each for each in self._unkept if each.task in kinds)
        self._read = tuple(each for each in self._read if each.task in kinds)

    def conclude(self, status: VerificationStatus, outcome: TrialOutcome) -> None:
        """Have written what became of the verification, with all records of it."""
        tip, began = status.tip, status.began
        if tip is not None and began is not None:
            conclusion = Conclusion(outcome, began, self._now(), status.assessment)
            self._records.add(concluding(tip, conclusion, self._file))

    def accept(self, tip: TipInForce, conclusion: Conclusion) -> None:
        """Write that a tip is accepted all the same.

        Raises
        ------
        FileError
            It cannot be written.
        """
        self._records.write_now(concluding(tip, conclusion, None))

    def give_up(self, status: VerificationStatus) -> None:
        """Have concluded what was begun and is not done; another session begins."""
        self.images.forget_but(())
        if status.state is not None:
            state = replace(status.state, unwitnessed=())
            self.settle(replace(status, state=state))
        if status.began is not None and not status.is_done:
            self.conclude(status, TrialOutcome.ABANDONED)

    def begin(self) -> None:
        """Begin another session."""
        self._records.begin()
        self._unkept, self._read, self._file = (), (), None

    def write(self) -> None:
        """Write what waits for it.

        Raises
        ------
        LightpenError
            Something cannot be written; it goes on waiting.
        """
        self._records.write()

    def note(self, status: VerificationStatus, choices: VerificationChoices) -> None:
        """Put on the disk what it takes to go on, should the program be killed.

        Raises
        ------
        FileError
            It cannot be written.
        """
        tip, runs = status.tip, self.images.runs
        has_some = bool(runs or self._read)
        if tip is None or status.began is None or status.is_done or not has_some:
            return
        if self._file is None:
            path = under_way_path(self.root(tip), tip.names, status.began)
            self._file = UnderWayFile(path)
        unkept = (done.task for done in self._unkept)
        self._file.note(
            UnderWay(
                began=status.began,
                names=tip.names,
                origin=tip.origin,
                tip_file=tip.tip_file.path.name,
                tip_sha256=tip.tip_file.sha256,
                pen_sha256=tip.pen_file.sha256,
                seen_by=tip.viewers.hashes,
                choices=choices,
                runs=runs,
                read=self._read,
                files=tuple(file.name for file in self._records.files),
                unwritten=(*unkept, *self._records.waiting),
            )
        )

    def take_over(
        self, path: Path, before: GoneOn, witness: LampWitness | None
    ) -> None:
        """Go on with what was kept of an interrupted verification.

        Parameters
        ----------
        path : Path
            Its file.

        Raises
        ------
        FileError
            Another window has it, or a record cannot be read or written to.
        """
        under_way, file = before.under_way, UnderWayFile(path)
        file.hold()
        try:
            self.images.take_over(under_way.runs, self.root(before.tip) / TOUCHES)
        except BaseException:
            file.let_go()
            raise
        self._file, self._read = file, under_way.read
        self._records.begin(before.files)
        read = {done.task: done for done in before.read}
        for kind in before.unwritten:
            if kind in read:
                done = read[kind]
                self._unkept = (*self._unkept, _TaskDone(kind, done.tip, done.images))
            else:
                self.add_task(kind, before.tip, witness)

    def _add(self, done: Done, status: VerificationStatus) -> None:
        """Have a task written, now or as soon as it can be."""
        assert status.setup is not None
        record = task_record(
            *(done.task, done.found, done.tip, status.setup.choices),
            *(status.began or self._now(), done.images),
        )
        is_simulated = Origin.SIMULATED in (done.tip.origin, done.images.origin)
        self._records.add(KeptRecord(lambda _: record, is_simulated, done.task))
