"""The course of a verification: what commands, images and folders do to it.

Nothing here knows threads: one who owns a course makes all calls in turn, and has what
takes long done elsewhere.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import TypeVar

from msgspec.structs import replace as with_entries

from lightpen.cameras.protocol import Frame
from lightpen.detection.aim import Aim
from lightpen.detection.rig_pose import see_together
from lightpen.detection.sighting import Sighting
from lightpen.errors import AcceptanceError, FileError, LightpenError
from lightpen.estimation.verdict import Grade
from lightpen.model.origin import Origin
from lightpen.record.folder_archive import FolderArchive
from lightpen.record.outcome import TrialOutcome
from lightpen.record.supervision import Signature, require_supervisor
from lightpen.record.verifications import TOUCHES
from lightpen.sentences import Sentence, sentence
from lightpen.swing.preparation import Preparation
from lightpen.swing.serial_queue import OneTask, Report, Start
from lightpen.verification.choices import WANTING, TaskKind, VerificationChoices
from lightpen.verification.conclusion import Conclusion
from lightpen.verification.going_on import GoneOn, go_on_with
from lightpen.verification.keeping import (
    TouchedImages,
    task_record,
    verifications_folder,
)
from lightpen.verification.recorded_runs import Done, read_runs
from lightpen.verification.session import (
    SessionTransition,
    advance,
    end_task,
    rules_of,
    setup_of,
    touched_anew,
    with_found,
)
from lightpen.verification.session_records import (
    KeptRecord,
    SessionRecords,
    concluding,
)
from lightpen.verification.session_state import (
    SessionSetup,
    SessionState,
    without_touches,
)
from lightpen.verification.status import (
    Reading,
    SessionHappening,
    VerificationListener,
    VerificationStatus,
)
from lightpen.verification.tip_in_force import (
    TipInForce,
    read_tip_in_force,
)
from lightpen.verification.touch_images import (
    NewRecord,
    TouchImages,
    is_held_on,
    new_record,
)
from lightpen.verification.touching import TouchHappening, TouchPhase, read_rules
from lightpen.verification.under_way import (
    InterruptedVerification,
    ReadImages,
    UnderWay,
    UnderWayFile,
    under_way_path,
)
from lightpen.verification.witness import LampWatch, LampWitness

ANOTHER = sentence(
    "verification.another-under-way",
    "Another verification is under way. Finish it or start over, then go on with the "
    "interrupted one.",
)
NOT_READY = sentence(
    "verification.not-ready",
    "A name, the images of the camera or a file is missing. Choose what the steps say, "
    "and go on with the verification then.",
)
BUG = sentence(
    "verification.bug",
    "The program made a mistake of its own, and the verification is paused. What was "
    "found so far is kept; go on, or start it over.",
)

T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class _TaskDone:
    """A task that is done, and the images of its touches."""

    task: TaskKind
    images: TouchedImages


class VerificationCourse:
    """One verification after another, of the tip in force.

    Parameters
    ----------
    archive : FolderArchive
        Of the accepted results.
    data : Path
        Folder that what is found is kept in.
    now : callable
        Returns date and time with the time zone.
    """

    def __init__(
        self,
        archive: FolderArchive,
        data: Path,
        listener: VerificationListener,
        now: Callable[[], datetime],
        start: Start,
    ) -> None:
        self._archive = archive
        self._data = data
        self._listener = listener
        self._now = now
        self._status = VerificationStatus()
        self._preparation: Preparation | None = None
        self._choices = VerificationChoices()
        self._records = SessionRecords(data)
        self._unkept_tasks: tuple[_TaskDone, ...] = ()  # whose drift is not known yet
        self._read_images: tuple[ReadImages, ...] = ()
        self._trouble: Sentence | None = None
        self._task = OneTask(start, self.recover, listener.on_progress)
        self._lamps = LampWatch()
        self._images = TouchImages(self._new_record)
        self._file: UnderWayFile | None = None  # of the verification under way
        self._unkept: Sentence | None = None  # why images are not kept now
        self._unnoted: Sentence | None = None  # why it could not be gone on with

    @property
    def status(self) -> VerificationStatus:
        """The verification as it was told last."""
        return self._status

    def recover(self) -> None:
        """Carry on after a bug, paused: the next image may have it again."""
        self._task.drop()
        status = replace(self._status, reading=Reading.NOTHING, is_paused=True)
        refusal = BUG if status.tip is None else status.refusal
        self._publish(replace(status, refusal=refusal))
        self._tell_trouble(BUG)

    # Commands

    def choose(self, preparation: Preparation, choices: VerificationChoices) -> None:
        """Know what is chosen now; while somebody is at it, the tip is read anew."""
        before, self._preparation = self._preparation, preparation
        self._choose_how(choices)
        is_other = before is None or not _verifies_like(before, preparation)
        status = self._status
        has_none = status.tip is None and status.refusal is None and not status.reading
        if status.is_here and (is_other or has_none):
            self._read_tip()

    def come(self) -> None:
        """Somebody is at it: read the tip in force, and take images."""
        self._publish(replace(self._status, is_here=True))
        self._write()
        if self._status.reading is not Reading.IMAGES:
            self._read_tip()

    def leave(self) -> None:
        """Nobody is at it: take no images until somebody comes."""
        self._publish(replace(self._status, is_here=False))

    def pause(self) -> None:
        """Take no images until it is resumed."""
        self._publish(replace(self._status, is_paused=True))

    def resume(self) -> None:
        """Take images again."""
        self._publish(replace(self._status, is_paused=False))

    def start_over(self) -> None:
        """Forget all touches, and read the tip in force anew; what is kept stays."""
        self._task.drop()
        self._relieve()
        self._give_up()
        self._publish(VerificationStatus(is_here=self._status.is_here))
        self._read_tip()

    def touch_anew(self, task: TaskKind) -> None:
        """Do one task again; what it found before is kept."""
        status, state = self._status, self._status.state
        if state is not None:
            self._publish(replace(status, accepted_by=""))
            self._touch_again(touched_anew(state, task))

    def accept(self, reason: str, signature: Signature | None) -> None:
        """Accept the tip though something was found against it, or say why not."""
        try:
            self._accept(reason.strip(), signature)
        except LightpenError as error:
            self._tell_trouble(error.sentence)

    def _accept(self, reason: str, signature: Signature | None) -> None:
        self._write()  # what is accepted is named by its files
        status = self._status
        tip, found, began = status.tip, status.assessment, status.began
        is_written = not self._records.are_waiting
        is_open = status.is_done and is_written and not status.accepted_by
        if not is_open or tip is None or found is None or began is None or not reason:
            return
        supervision = self._archive.supervision()
        supervisor = ""
        if supervision.is_guarded or found.grade is Grade.REPEAT:
            if signature is None:
                raise AcceptanceError(
                    sentence(
                        "verification.no-supervisor",
                        "The tip did not keep the limits. {why} Only a supervisor can "
                        "accept it, with a reason.",
                        why=found.reason,
                    )
                )
            require_supervisor(supervision, signature)
            supervisor = signature.name.strip()
        conclusion = Conclusion(
            *(TrialOutcome.ACCEPTED, began, self._now(), found, reason, supervisor)
        )
        self._records.write_now(concluding(tip, conclusion, None))
        self._relieve()
        accepted_by = supervisor or tip.names.operator
        kept = self._records.files
        self._publish(replace(status, files=kept, accepted_by=accepted_by))

    def end_task(self) -> None:
        """End the task at hand with the touches that there are, if they suffice."""
        status = self._status
        if status.setup is None or status.state is None:
            return
        transition = end_task(status.setup, status.state)
        try:
            self._images.follow(status.state, transition)
        except FileError as error:
            self._tell_trouble(error.sentence)
            return
        self._become(transition)

    def read(self, task: TaskKind, place: str, *, is_still: bool) -> None:
        """Do a task with recorded images.

        Parameters
        ----------
        place : str
            A folder, pattern, video or record; or a folder of such folders, one a run.
        is_still : bool
            Whether the pen is held still through the images of a touch; else each
            image is a touch.
        """
        tip, setup = self._status.tip, self._status.setup
        if self._task.is_there or tip is None or setup is None:
            return
        rules = read_rules(is_still, setup.choices.n_frames)
        work = partial(read_runs, task, place, tip, setup, rules)
        images = ReadImages(task, place, is_still)
        self._start(
            *(Reading.IMAGES, work),
            *(partial(self._on_runs_read, images), self._on_runs_unread),
        )

    def go_on(self, interrupted: InterruptedVerification) -> None:
        """Go on with an interrupted verification, or say why it cannot be."""
        preparation, under_way = self._preparation, interrupted.under_way
        status = self._status
        if preparation is None or under_way is None or self._task.is_there:
            return
        if status.began is not None and not status.is_done:
            self._tell_trouble(ANOTHER)
            return
        if preparation.lacks():
            self._tell_trouble(NOT_READY)
            return
        chosen = replace(under_way.choices, limits=self._choices.limits)
        again = with_entries(under_way, choices=chosen)
        work = partial(go_on_with, self._archive, self._data, preparation, again)
        self._start(
            *(Reading.IMAGES, work),
            *(partial(self._on_gone_on, interrupted.path), self._on_runs_unread),
        )

    def _on_gone_on(self, path: Path, before: GoneOn) -> None:
        under_way, file = before.under_way, UnderWayFile(path)
        self._give_up()
        try:
            file.hold()
            folder = self._root(before.tip) / TOUCHES
            self._images.take_over(under_way.runs, folder)
        except FileError as error:
            file.let_go()
            self._on_runs_unread(error.sentence)
            return
        self._relieve()
        self._choices, self._file = before.setup.choices, file
        self._records.begin(before.files)
        self._read_images, self._lamps = under_way.read, LampWatch()
        self._unkept_tasks = self._unkept_of(before)
        self._publish(
            VerificationStatus(
                tip=before.tip,
                setup=before.setup,
                state=before.state,
                aim=before.tip.aim,
                began=under_way.began,
                files=before.files,
                is_here=self._status.is_here,
                refusal=self._why_not(before.tip),
            )
        )
        self._keep_witnessed()
        self._conclude_done()
        self._publish(self._status)

    def _unkept_of(self, before: GoneOn) -> tuple[_TaskDone, ...]:
        """Return the tasks that were done and not written yet."""
        found = [kind for kind in TaskKind if before.state.found(kind) is not None]
        return tuple(
            _TaskDone(
                kind,
                TouchedImages(before.tip.origin, records=self._images.records(kind)),
            )
            for kind in found
            if kind in before.unwritten
        )

    def cancel(self) -> None:
        """Stop reading."""
        self._task.drop()
        self._publish(replace(self._status, reading=Reading.NOTHING))

    def shut_down(self) -> None:
        """Write what is not written yet."""
        self._task.drop()
        self._give_up()
        self._write()

    # Images

    def take(self, frame: Frame, sighting: Sighting | None, aim: Aim) -> None:
        """Take an image, as `VerificationRunner.take` has it."""
        status = self._status
        if not status.is_touching or aim is not status.aim or sighting is None:
            return
        setup, state = status.setup, status.state
        assert setup is not None
        assert state is not None
        if status.began is None:
            self._status = replace(status, began=self._now())
            self._lamps = LampWatch()
        if state.touching.phase is TouchPhase.HOLDING:
            self._lamps = self._lamps.with_frame(frame, sighting, aim)
        together = see_together(setup.instrument.rig, setup.instrument.pen, sighting)
        try:
            name = self._name(frame, together, setup, state)
            transition = advance(self._with_drift(setup, state), state, name, together)
            self._images.follow(state, transition)
        except FileError as error:  # an image that is not kept does not count
            self._unkept = error.sentence
            self._tell_trouble(error.sentence)
            return
        if self._unkept is not None and self._unkept is self._trouble:
            self._relieve()
        self._unkept = None
        self._become(transition)

    def _with_drift(self, setup: SessionSetup, state: SessionState) -> SessionSetup:
        """Return it with how far the camera has moved, where that is asked for next."""
        task, tip = state.task(setup), self._status.tip
        if task is None or tip is None:
            return setup
        rules = rules_of(setup, task)
        if len(state.touching.held) + 1 < rules.n_settling + rules.n_frames:
            return setup
        witness = self._witness(tip)
        return setup if witness is None else replace(setup, drift=witness.share)

    def _name(
        self, frame: Frame, seen: Sighting, setup: SessionSetup, state: SessionState
    ) -> str:
        """Return the name of an image; one of a touch is kept under it."""
        task = state.task(setup)
        if task is None or not seen.has_pose or seen.is_blurred:
            return str(frame.seq)
        if not is_held_on(rules_of(setup, task), state):
            return str(frame.seq)
        return self._images.keep(frame, seen, task)

    def _new_record(self) -> NewRecord:
        """Make a record for the images of the run at hand."""
        status, preparation = self._status, self._preparation
        assert preparation is not None
        assert status.tip is not None
        tip = status.tip
        header = preparation.header(
            {
                "verification": str(status.task),
                "tip_file": tip.tip_file.path.name,
                "tip_sha256": tip.tip_file.sha256,
            }
        )
        return new_record(self._root(tip), tip.names, header)

    def _become(self, transition: SessionTransition) -> None:
        before, state = self._status.state, transition.state
        finished = transition.finished
        self._status = replace(self._status, state=state)
        happened = [_HAPPENED[event.what] for event in transition.events]
        if before is not None and _is_known(state) and not _is_known(before):
            happened.append(SessionHappening.KNOWN)
        if finished is not None:
            tip, found = self._status.tip, state.found(finished)
            assert tip is not None
            assert found is not None
            witness = self._witness(tip)
            records = self._images.records(finished)
            images = TouchedImages(tip.origin, witness=witness, records=records)
            self._status = replace(self._status, witness=witness)
            done = _TaskDone(finished, images)
            self._unkept_tasks = (*self._unkept_tasks, done)
            happened.append(_ending(self._status))
        self._keep_witnessed()
        if finished is not None:
            self._conclude_done()
        self._publish(self._status, *happened)

    def _witness(self, tip: TipInForce) -> LampWitness | None:
        """Return what lamps tell of the camera."""
        cameras = tip.instrument.rig.cameras
        return self._lamps.witness(cameras, self._choices.limits)

    def _touch_again(self, state: SessionState) -> None:
        """Go on with another state, in which something is to be touched again."""
        kinds = [kind for kind in TaskKind if state.found(kind) is not None]
        if state.visits:
            kinds.append(TaskKind.DRIFT)
        self._images.forget_but(kinds)
        self._unkept_tasks = tuple(
            done for done in self._unkept_tasks if done.task in kinds
        )
        read = (images for images in self._read_images if images.task in kinds)
        self._read_images = tuple(read)
        self._publish(replace(self._status, state=state))

    # The tip

    def _choose_how(self, choices: VerificationChoices) -> None:
        if choices == self._choices:
            return
        self._choices = choices
        if self._status.reading is Reading.IMAGES:
            self.cancel()  # they are measured by what was chosen before
        status, setup, state = self._status, self._status.setup, self._status.state
        if setup is None or state is None:
            return
        before, task = state, state.task(setup)
        for kind in TaskKind:
            is_found = state.found(kind) is not None
            if is_found and _asks_otherwise(kind, setup.choices, choices):
                state = touched_anew(state, kind)
        setup = replace(setup, choices=choices)
        if state.task(setup) is not task:
            state = without_touches(state)
        if state.task(setup) is not None and state.drift is not None:
            state = replace(state, drift=None)  # it was not of what comes now
        if not state.is_witnessed(setup):
            state = replace(state, unwitnessed=())
        refusal = self._why_not(status.tip)
        self._status = replace(status, setup=setup, refusal=refusal)
        if state is before:
            self._publish(self._status)
        else:
            self._touch_again(state)
        self._keep_witnessed()

    def _read_tip(self) -> None:
        preparation = self._preparation
        if preparation is None or preparation.lacks():
            return
        self._task.drop()
        archive = self._archive
        self._start(
            *(Reading.TIP, lambda _: read_tip_in_force(archive, preparation)),
            *(self._on_tip_read, self._on_no_tip),
        )

    def _on_tip_read(self, tip: TipInForce) -> None:
        status = replace(self._status, reading=Reading.NOTHING)
        if status.tip is None or not tip.is_like(status.tip):
            self._give_up()
            status = VerificationStatus(
                tip=tip,
                setup=setup_of(tip, self._choices),
                state=SessionState(),
                aim=tip.aim,
                is_here=status.is_here,
            )
        self._publish(replace(status, refusal=self._why_not(tip)))

    def _on_no_tip(self, why: Sentence) -> None:
        self._give_up()
        self._publish(VerificationStatus(is_here=self._status.is_here, refusal=why))

    def _why_not(self, tip: TipInForce | None) -> Sentence | None:
        """Return why what is chosen cannot be verified."""
        if tip is None:
            return self._status.refusal
        wanting = self._choices.wanting(tip.names.ball_diameter)
        return WANTING[wanting[0]] if wanting else None

    # Recorded images

    def _on_runs_read(self, images: ReadImages, done: Done) -> None:
        status = replace(self._status, reading=Reading.NOTHING)
        if status.state is None:
            return
        self._relieve()
        self._status = replace(status, began=status.began or self._now())
        self._touch_again(with_found(status.state, done.found))
        self._read_images = (*self._read_images, images)
        self._keep(done)
        self._conclude_done()
        self._publish(self._status, _ending(self._status))

    def _on_runs_unread(self, why: Sentence) -> None:
        self._tell_trouble(why)
        self._publish(replace(self._status, reading=Reading.NOTHING))

    def _start(
        self,
        reading: Reading,
        work: Callable[[Report], T],
        then: Callable[[T], None],
        otherwise: Callable[[Sentence], None],
    ) -> None:
        self._task.begin(work, then, otherwise)
        self._publish(replace(self._status, reading=reading))

    # Records

    def _keep_witnessed(self) -> None:
        """Keep what tasks have found, unless a witness will tell more of them."""
        tip, state = self._status.tip, self._status.state
        if tip is None or state is None:
            return
        waiting = {task for task, _ in state.unwitnessed}
        done = self._unkept_tasks
        self._unkept_tasks = tuple(each for each in done if each.task in waiting)
        for each in done:
            found = state.found(each.task)
            if each.task not in waiting and found is not None:
                self._keep(Done(each.task, found, tip, each.images))

    def _keep(self, done: Done) -> None:
        """Keep what a task has found, now or as soon as it can be written."""
        setup = self._status.setup
        assert setup is not None
        record = task_record(
            *(done.task, done.found, done.tip, setup.choices),
            *(self._status.began or self._now(), done.images),
        )
        origins = done.tip.origin, done.images.origin
        is_simulated = Origin.SIMULATED in origins
        self._records.add(KeptRecord(lambda _: record, is_simulated, done.task))
        self._write()

    def _conclude_done(self) -> None:
        """Conclude a verification when all that was chosen is found."""
        found = self._status.assessment
        if self._status.is_done and found is not None:
            is_kept = found.is_accepted
            self._conclude(TrialOutcome.ACCEPTED if is_kept else TrialOutcome.REFUSED)

    def _give_up(self) -> None:
        """Conclude what was begun and is not done."""
        status = self._status
        self._images.forget_but(())
        if status.state is not None:
            state = replace(status.state, unwitnessed=())
            self._status = replace(status, state=state)
            self._keep_witnessed()
        if status.began is not None and not status.is_done:
            self._conclude(TrialOutcome.ABANDONED)
        self._records.begin()
        self._unkept_tasks, self._read_images, self._file = (), (), None

    def _conclude(self, outcome: TrialOutcome) -> None:
        """Say what became of the verification, with all records of it."""
        status = self._status
        if status.tip is None or status.began is None:
            return
        conclusion = Conclusion(outcome, status.began, self._now(), status.assessment)
        self._records.add(concluding(status.tip, conclusion, self._file))
        self._write()

    def _write(self) -> None:
        """Write what waits for it, or tell why it cannot be."""
        if not self._records.are_waiting:
            return
        try:
            self._records.write()
            self._relieve()
        except LightpenError as error:
            self._tell_trouble(error.sentence)
        self._status = replace(self._status, files=self._records.files)

    def _note_under_way(self) -> None:
        """Put on the disk what it takes to go on, should the program be killed."""
        status, tip, runs = self._status, self._status.tip, self._images.runs
        has_some = bool(runs or self._read_images)
        if tip is None or status.began is None or status.is_done or not has_some:
            return
        root = self._root(tip)
        if self._file is None:
            path = under_way_path(root, tip.names, status.began)
            self._file = UnderWayFile(path)
        try:
            self._file.note(
                UnderWay(
                    began=status.began,
                    names=tip.names,
                    origin=tip.origin,
                    tip_file=tip.tip_file.path.name,
                    tip_sha256=tip.tip_file.sha256,
                    pen_sha256=tip.pen_file.sha256,
                    seen_by=tip.viewers.hashes,
                    choices=self._choices,
                    runs=runs,
                    read=self._read_images,
                    files=tuple(file.name for file in self._records.files),
                    unwritten=(
                        *(done.task for done in self._unkept_tasks),
                        *self._records.waiting,
                    ),
                )
            )
        except FileError as error:
            if self._trouble is None:  # what stands in its way may be told already
                self._unnoted = error.sentence
                self._tell_trouble(error.sentence)
            return
        if self._unnoted is not None and self._unnoted is self._trouble:
            self._relieve()
        self._unnoted = None

    def _root(self, tip: TipInForce) -> Path:
        is_simulated = tip.origin is Origin.SIMULATED
        return verifications_folder(self._data, is_simulated=is_simulated)

    def _publish(self, status: VerificationStatus, *events: SessionHappening) -> None:
        """Become this status, and tell of it."""
        self._status = status
        self._note_under_way()
        self._listener.on_verification(status, events)

    def _tell_trouble(self, trouble: Sentence) -> None:
        self._trouble = trouble
        self._listener.on_trouble(trouble)

    def _relieve(self) -> None:
        trouble, self._trouble = self._trouble, None
        if trouble is not None:
            self._listener.on_relief(trouble)


def _verifies_like(one: Preparation, other: Preparation) -> bool:
    return one.swings_like(other) and one.source == other.source


def _asks_otherwise(
    kind: TaskKind, one: VerificationChoices, other: VerificationChoices
) -> bool:
    """Return whether what a task has found is of another artefact."""
    artefacts = [
        {
            TaskKind.FIXED_POINT: (),
            TaskKind.CIRCLE: (of.radius, of.radius_uncertainty, of.surface),
            TaskKind.LENGTH: (
                of.length,
                of.length_uncertainty,
                of.length_surface,
            ),
            TaskKind.ARTICULATION: (),
            TaskKind.DRIFT: (),
        }[kind]
        for of in (one, other)
    ]
    return artefacts[0] != artefacts[1]


def _is_known(state: SessionState) -> bool:
    return state.touching.phase is TouchPhase.KNOWN


def _ending(status: VerificationStatus) -> SessionHappening:
    """Return what it is that a task is done."""
    if status.task is not None or status.assessment is None:
        return SessionHappening.FINISHED
    is_refused = status.assessment.grade is Grade.REPEAT
    return SessionHappening.FAILED if is_refused else SessionHappening.DONE


_HAPPENED = {
    TouchHappening.TAKEN: SessionHappening.TAKEN,
    TouchHappening.BROKEN_OFF: SessionHappening.BROKEN_OFF,
}
