"""The course of a verification: what commands, images and folders do to it.

Nothing here knows threads: one who owns a course makes all calls in turn, and has what
takes long done elsewhere.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

from lightpen.cameras.protocol import Frame
from lightpen.detection.aim import Aim
from lightpen.detection.fixed_lamps import masked_lights
from lightpen.detection.rig_pose import see_together
from lightpen.detection.sighting import Sighting
from lightpen.errors import AcceptanceError, FileError, LightpenError
from lightpen.estimation.verdict import Grade
from lightpen.formats.hashes import all_hashed
from lightpen.model.origin import Origin
from lightpen.record.folder_archive import FolderArchive
from lightpen.record.outcome import TrialOutcome
from lightpen.record.supervision import Signature, require_supervisor
from lightpen.sentences import Sentence, sentence
from lightpen.swing.preparation import Preparation
from lightpen.swing.serial_queue import Report, Start, Task
from lightpen.verification.choices import WANTING, TaskKind, VerificationChoices
from lightpen.verification.conclusion import Conclusion, conclusion_record
from lightpen.verification.keeping import (
    TouchedImages,
    keep_verification,
    task_record,
    verifications_folder,
)
from lightpen.verification.recorded_runs import Done, read_runs
from lightpen.verification.session import (
    SessionSetup,
    SessionState,
    SessionTransition,
    advance,
    end_task,
    rules_of,
    touched_anew,
    with_found,
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
from lightpen.verification.touching import TouchHappening, TouchPhase, TouchRules
from lightpen.verification.witness import LampImages, LampWitness, witnessed

BUG = sentence(
    "verification.bug",
    "The program made a mistake of its own, and the verification is paused. What was "
    "found so far is kept; go on, or start it over.",
)
N_RECENT = 10  # images before a hold is noticed, of which the first belong to it
ONE_IMAGE = TouchRules(n_frames=1, n_settling=0)

T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class _Kept:
    """A record that waits to be written; those of its session are written before."""

    record_of: Callable[[tuple[Path, ...]], Mapping[str, Any]]
    is_simulated: bool


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
        self._start_task = start
        self._status = VerificationStatus()
        self._preparation: Preparation | None = None
        self._choices = VerificationChoices()
        self._unwritten: tuple[_Kept, ...] = ()
        self._trouble: Sentence | None = None
        self._task: Task | None = None
        self._lamps: tuple[LampImages, ...] = ()  # of each camera
        self._images = TouchImages(self._new_record)
        self._unkept: Sentence | None = None  # why images are not kept now

    @property
    def status(self) -> VerificationStatus:
        """The verification as it was told last."""
        return self._status

    def recover(self) -> None:
        """Carry on after a bug, paused: the next image may have it again."""
        self._drop_task()
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
        self._drop_task()
        self._relieve()
        self._give_up()
        self._publish(VerificationStatus(is_here=self._status.is_here))
        self._read_tip()

    def touch_anew(self, task: TaskKind) -> None:
        """Do one task again; what it found before is kept."""
        status, state = self._status, self._status.state
        if state is not None:
            self._images.forget()
            state = touched_anew(state, task)
            self._publish(replace(status, state=state, accepted_by=""))

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
        is_open = status.is_done and not (status.accepted_by or self._unwritten)
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
        file = self._write_next(_conclusion(tip, conclusion))
        self._relieve()
        accepted_by = supervisor or tip.names.operator
        kept = (*status.files, file)
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
        if self._task is not None or tip is None or setup is None:
            return
        rules = TouchRules(setup.choices.n_frames) if is_still else ONE_IMAGE
        work = partial(read_runs, task, place, tip, setup, rules)
        self._start(Reading.IMAGES, work, self._on_runs_read, self._on_runs_unread)

    def cancel(self) -> None:
        """Stop reading."""
        self._drop_task()
        self._publish(replace(self._status, reading=Reading.NOTHING))

    def shut_down(self) -> None:
        """Write what is not written yet."""
        self._drop_task()
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
            self._lamps = (LampImages(),) * len(aim.aims)
        if state.touching.phase is TouchPhase.HOLDING:
            self._note_lamps(frame, sighting, aim)
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

    def _note_lamps(self, frame: Frame, sighting: Sighting, aim: Aim) -> None:
        views = zip(
            *(self._lamps, (frame, *frame.others), (sighting, *sighting.others)),
            aim.aims,
            strict=False,
        )
        self._lamps = tuple(
            lamps.with_image(seen, masked_lights(own.image, of.mask, own.full_scale))
            if seen.has_pose
            else lamps
            for lamps, own, seen, of in views
        )

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
        return self._images.keep(frame, seen)

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
        root = verifications_folder(
            self._data, is_simulated=tip.origin is Origin.SIMULATED
        )
        return new_record(root, tip.names, header)

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
            records = self._images.next_task()
            images = TouchedImages(tip.origin, witness=witness, records=records)
            self._status = replace(self._status, witness=witness)
            self._keep(Done(finished, found, tip, images))
            happened.append(_ending(self._status))
            self._conclude_done()
        self._publish(self._status, *happened)

    def _witness(self, tip: TipInForce) -> LampWitness | None:
        """Return what lamps tell of the camera that moved farthest."""
        limits, cameras = self._choices.limits, tip.instrument.rig.cameras
        told = [
            witnessed(lamps, camera.fx, limits)
            for lamps, camera in zip(self._lamps, cameras, strict=False)
        ]
        known = [each for each in told if each is not None]
        return max(known, key=lambda each: each.moved, default=None)

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
        if state is not before:
            self._images.forget()
        refusal = self._why_not(status.tip)
        self._publish(replace(status, setup=setup, state=state, refusal=refusal))

    def _read_tip(self) -> None:
        preparation = self._preparation
        if preparation is None or preparation.lacks():
            return
        self._drop_task()
        archive = self._archive
        self._start(
            *(Reading.TIP, lambda _: read_tip_in_force(archive, preparation)),
            *(self._on_tip_read, self._on_no_tip),
        )

    def _on_tip_read(self, tip: TipInForce) -> None:
        self._task = None
        status = replace(self._status, reading=Reading.NOTHING)
        if status.tip is None or not tip.is_like(status.tip):
            self._give_up()
            setup = SessionSetup(
                tip.instrument,
                self._choices,
                tip.names.ball_diameter,
                tip.nominal_tip,
                tip.cone_cam,
            )
            status = VerificationStatus(
                tip=tip,
                setup=setup,
                state=SessionState(),
                aim=tip.aim,
                is_here=status.is_here,
            )
        self._publish(replace(status, refusal=self._why_not(tip)))

    def _on_no_tip(self, why: Sentence) -> None:
        self._task = None
        self._give_up()
        self._publish(VerificationStatus(is_here=self._status.is_here, refusal=why))

    def _why_not(self, tip: TipInForce | None) -> Sentence | None:
        """Return why what is chosen cannot be verified."""
        if tip is None:
            return self._status.refusal
        wanting = self._choices.wanting(tip.names.ball_diameter)
        return WANTING[wanting[0]] if wanting else None

    # Recorded images

    def _on_runs_read(self, done: Done) -> None:
        self._task = None
        status = replace(self._status, reading=Reading.NOTHING)
        if status.state is None:
            return
        self._relieve()
        self._images.forget()
        state = with_found(status.state, done.found)
        self._status = replace(status, state=state, began=status.began or self._now())
        self._keep(done)
        self._conclude_done()
        self._publish(self._status, _ending(self._status))

    def _on_runs_unread(self, why: Sentence) -> None:
        self._task = None
        self._tell_trouble(why)
        self._publish(replace(self._status, reading=Reading.NOTHING))

    def _start(
        self,
        reading: Reading,
        work: Callable[[Report], T],
        then: Callable[[T], None],
        otherwise: Callable[[Sentence], None],
    ) -> None:
        self._task = self._start_task(
            *(work, then, otherwise, self.recover, self._listener.on_progress)
        )
        self._publish(replace(self._status, reading=reading))

    def _drop_task(self) -> None:
        task, self._task = self._task, None
        if task is not None:
            task.cancel()

    # Records

    def _keep(self, done: Done) -> None:
        """Keep what a task has found, now or as soon as it can be written."""
        setup = self._status.setup
        assert setup is not None
        record = task_record(
            *(done.task, done.found, done.tip, setup.choices),
            *(self._status.began or self._now(), done.images),
        )
        origins = done.tip.origin, done.images.origin
        kept = _Kept(lambda _: record, Origin.SIMULATED in origins)
        self._unwritten = (*self._unwritten, kept)
        self._write()

    def _conclude_done(self) -> None:
        """Conclude a verification when all that was chosen is found."""
        found = self._status.assessment
        if self._status.is_done and found is not None:
            is_kept = found.is_accepted
            self._conclude(TrialOutcome.ACCEPTED if is_kept else TrialOutcome.REFUSED)

    def _give_up(self) -> None:
        """Conclude what was begun and is not done."""
        self._images.forget()
        if self._status.began is not None and not self._status.is_done:
            self._conclude(TrialOutcome.ABANDONED)

    def _conclude(self, outcome: TrialOutcome) -> None:
        """Say what became of the verification, with all records of it."""
        status = self._status
        if status.tip is None or status.began is None:
            return
        conclusion = Conclusion(outcome, status.began, self._now(), status.assessment)
        self._unwritten = (*self._unwritten, _conclusion(status.tip, conclusion))
        self._write()

    def _write(self) -> None:
        """Write what waits for it, or tell why it cannot be."""
        try:
            while self._unwritten:
                file = self._write_next(self._unwritten[0])
                self._unwritten = self._unwritten[1:]
                files = (*self._status.files, file)
                self._status = replace(self._status, files=files)
                self._relieve()
        except LightpenError as error:
            self._tell_trouble(error.sentence)

    def _write_next(self, kept: _Kept) -> Path:
        """Write a record of the session, whose other records are written."""
        record = kept.record_of(self._status.files)
        return keep_verification(self._data, record, is_simulated=kept.is_simulated)

    def _publish(self, status: VerificationStatus, *events: SessionHappening) -> None:
        """Become this status, and tell of it."""
        self._status = status
        self._listener.on_verification(status, events)

    def _tell_trouble(self, trouble: Sentence) -> None:
        self._trouble = trouble
        self._listener.on_trouble(trouble)

    def _relieve(self) -> None:
        trouble, self._trouble = self._trouble, None
        if trouble is not None:
            self._listener.on_relief(trouble)


def _conclusion(tip: TipInForce, conclusion: Conclusion) -> _Kept:
    """Return the record of a conclusion, to be written when its session is."""
    return _Kept(
        lambda files: conclusion_record(tip, conclusion, all_hashed(files)),
        tip.origin is Origin.SIMULATED,
    )


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
            TaskKind.LENGTH: (of.length, of.length_uncertainty),
            TaskKind.ARTICULATION: (),
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
