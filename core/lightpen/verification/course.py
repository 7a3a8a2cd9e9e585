"""The course of a verification: what commands, images and folders do to it.

Nothing here knows threads: one who owns a course makes all calls in turn, and has what
takes long done elsewhere.
"""

from collections.abc import Callable
from dataclasses import replace
from datetime import datetime
from enum import Enum, auto
from functools import partial
from pathlib import Path
from typing import TypeVar

from msgspec.structs import replace as with_entries

from lightpen.cameras.protocol import Frame
from lightpen.detection.aim import Aim
from lightpen.detection.sighting import Sighting
from lightpen.errors import FileError, LightpenError
from lightpen.record.folder_archive import FolderArchive
from lightpen.record.outcome import TrialOutcome
from lightpen.record.supervision import Signature
from lightpen.sentences import Sentence, sentence
from lightpen.swing.preparation import Preparation
from lightpen.swing.serial_queue import OneTask, Report, Start
from lightpen.swing.troubles import Troubles
from lightpen.verification.acceptance import accepting_supervisor
from lightpen.verification.choices import WANTING, TaskKind, VerificationChoices
from lightpen.verification.conclusion import Conclusion
from lightpen.verification.going_on import GoneOn, go_on_with
from lightpen.verification.happenings import ending, happenings
from lightpen.verification.live_touches import LiveTouches
from lightpen.verification.other_choices import with_other_choices
from lightpen.verification.recorded_runs import ReadRuns, read_runs
from lightpen.verification.session import (
    SessionTransition,
    end_task,
    setup_of,
    touched_anew,
    with_read,
)
from lightpen.verification.session_keeping import SessionKeeping
from lightpen.verification.session_state import SessionState, with_drift
from lightpen.verification.status import (
    Reading,
    SessionHappening,
    VerificationListener,
    VerificationStatus,
)
from lightpen.verification.tip_in_force import TipInForce, read_tip_in_force
from lightpen.verification.touch_images import NewRecord, new_record
from lightpen.verification.touching import read_rules
from lightpen.verification.under_way import InterruptedVerification, ReadImages
from lightpen.verification.witness import LampWatch

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


class Cause(Enum):
    """What a trouble comes of that can end by itself."""

    IMAGES = auto()  # of touches cannot be kept
    NOTE = auto()  # what it takes to go on cannot be kept


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
        self._keeping = SessionKeeping(data, self._new_record, now)
        self._live = LiveTouches(self._keeping.images)
        self._troubles = Troubles(listener)
        self._task = OneTask(start, self.recover, listener.on_progress)

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
        self._troubles.tell(BUG)

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
        self._troubles.end()
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
        self._troubles.trying(lambda: self._accept(reason.strip(), signature))

    def _accept(self, reason: str, signature: Signature | None) -> None:
        self._write()  # what is accepted is named by its files
        status = self._status
        tip, found, began = status.tip, status.assessment, status.began
        is_written = not self._keeping.is_behind
        is_open = status.is_done and is_written and not status.accepted_by
        if not is_open or tip is None or found is None or began is None or not reason:
            return
        supervision = self._archive.supervision()
        supervisor = accepting_supervisor(supervision, found, signature)
        conclusion = Conclusion(
            *(TrialOutcome.ACCEPTED, began, self._now(), found, reason, supervisor)
        )
        self._keeping.accept(tip, conclusion)
        self._troubles.end()
        accepted_by = supervisor or tip.names.operator
        kept = self._keeping.files
        self._publish(replace(status, files=kept, accepted_by=accepted_by))

    def end_task(self) -> None:
        """End the task at hand with the touches that there are, if they suffice."""
        status = self._status
        if status.setup is None or status.state is None:
            return
        transition = end_task(status.setup, status.state)
        try:
            self._keeping.images.follow(status.state, transition)
        except FileError as error:
            self._troubles.tell(error.sentence)
            return
        self._become(transition)

    def read(self, task: TaskKind, place: str, *, is_still: bool) -> None:
        """Do a task with recorded images; a witness counts in it, read before or after.

        Parameters
        ----------
        place : str
            A folder, pattern, video or record; or a folder of such folders, one a run.
        is_still : bool
            Whether the pen is held still through the images of a touch; else each
            image is a touch.
        """
        tip, setup, state = self._status.tip, self._status.setup, self._status.state
        if self._task.is_there or tip is None or setup is None or state is None:
            return
        if self._keeping.has_read(TaskKind.DRIFT):
            setup = with_drift(setup, state.drift)
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
            self._troubles.tell(ANOTHER)
            return
        if preparation.lacks():
            self._troubles.tell(NOT_READY)
            return
        chosen = replace(under_way.choices, limits=self._choices.limits)
        again = with_entries(under_way, choices=chosen)
        work = partial(go_on_with, self._archive, self._data, preparation, again)
        self._start(
            *(Reading.IMAGES, work),
            *(partial(self._on_gone_on, interrupted.path), self._on_runs_unread),
        )

    def _on_gone_on(self, path: Path, before: GoneOn) -> None:
        self._give_up()
        self._live.begin(before.lamps)
        witness = self._live.witness(before.setup)
        try:
            self._keeping.take_over(path, before, witness)
        except FileError as error:
            self._on_runs_unread(error.sentence)
            return
        self._troubles.end()
        self._choices = before.setup.choices
        self._publish(
            VerificationStatus(
                tip=before.tip,
                setup=before.setup,
                state=before.state,
                aim=before.tip.aim,
                began=before.under_way.began,
                files=before.files,
                witness=witness,
                is_here=self._status.is_here,
                refusal=self._why_not(before.tip),
            )
        )
        self._keep()
        self._conclude_done()
        self._publish(self._status)

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
            self._live.begin(LampWatch())
        try:
            transition = self._live.take(setup, state, frame, sighting, aim)
        except FileError as error:  # an image that is not kept does not count
            self._troubles.tell(error.sentence, Cause.IMAGES)
            return
        self._troubles.end_of(Cause.IMAGES)
        self._become(transition)

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
        return new_record(self._keeping.root(tip), tip.names, header)

    def _become(self, transition: SessionTransition) -> None:
        before, state = self._status.state, transition.state
        finished = transition.finished
        self._status = replace(self._status, state=state)
        happened = happenings(before, transition)
        if finished is not None:
            tip, setup = self._status.tip, self._status.setup
            assert tip is not None
            assert setup is not None
            witness = self._live.witness(setup)
            self._keeping.add_task(finished, tip, witness)
            self._status = replace(self._status, witness=witness)
            happened.append(ending(self._status))
        self._keep()
        if finished is not None:
            self._conclude_done()
        self._publish(self._status, *happened)

    def _touch_again(self, state: SessionState) -> None:
        """Go on with another state, in which something is to be touched again."""
        self._keeping.forget_but(state)
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
        before = state
        setup, state = with_other_choices(setup, state, choices)
        refusal = self._why_not(status.tip)
        self._status = replace(status, setup=setup, state=state, refusal=refusal)
        if state.touching is before.touching:
            self._publish(self._status)
        else:
            self._touch_again(state)
        self._keep()

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

    def _on_runs_read(self, images: ReadImages, read: ReadRuns) -> None:
        status = replace(self._status, reading=Reading.NOTHING)
        setup, state, done = status.setup, status.state, read.done
        if setup is None or state is None:
            return
        self._troubles.end()
        self._status = replace(status, began=status.began or self._now())
        self._touch_again(with_read(setup, state, read.touched, done.found))
        self._keeping.add_read(images, done)
        self._keep()
        self._conclude_done()
        self._publish(self._status, ending(self._status))

    def _on_runs_unread(self, why: Sentence) -> None:
        self._troubles.tell(why)
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

    def _keep(self) -> None:
        """Keep what tasks have found, unless a witness will tell more of them."""
        self._keeping.settle(self._status)
        self._write()

    def _conclude_done(self) -> None:
        """Conclude a verification when all that was chosen is found."""
        found = self._status.assessment
        if self._status.is_done and found is not None:
            is_kept = found.is_accepted
            outcome = TrialOutcome.ACCEPTED if is_kept else TrialOutcome.REFUSED
            self._keeping.conclude(self._status, outcome)
            self._write()

    def _give_up(self) -> None:
        """Conclude what was begun and is not done."""
        self._keeping.give_up(self._status)
        self._write()
        self._keeping.begin()

    def _write(self) -> None:
        """Write what waits for it, or tell why it cannot be."""
        if not self._keeping.is_behind:
            return
        try:
            self._keeping.write()
            self._troubles.end()
        except LightpenError as error:
            self._troubles.tell(error.sentence)
        self._status = replace(self._status, files=self._keeping.files)

    def _note_under_way(self) -> None:
        """Put on the disk what it takes to go on, should the program be killed."""
        try:
            self._keeping.note(self._status, self._choices)
        except FileError as error:
            if not self._troubles.is_any:  # what stands in its way may be told already
                self._troubles.tell(error.sentence, Cause.NOTE)
            return
        self._troubles.end_of(Cause.NOTE)

    def _publish(self, status: VerificationStatus, *events: SessionHappening) -> None:
        """Become this status, and tell of it."""
        self._status = status
        self._note_under_way()
        self._listener.on_verification(status, events)


def _verifies_like(one: Preparation, other: Preparation) -> bool:
    return one.swings_like(other) and one.source == other.source
