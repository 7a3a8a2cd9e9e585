"""Workflow of a verification: its response to commands, images and folders.

Its one owner has a thread for it. Commands reach it through one queue, and so do the
images, one at a time; it publishes every change and every event. Reading results and
recorded images takes long and runs in background threads; results are written on its
own thread, between two images.
"""

import logging
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from datetime import datetime
from enum import Enum, auto
from functools import partial
from pathlib import Path
from typing import TypeVar

from msgspec.structs import replace as with_entries

from lightpen.cameras.protocol import Frame
from lightpen.detection.pen_detection import PenDetection
from lightpen.detection.pixel_box import RegionOfInterest
from lightpen.errors import FileError, LightpenError
from lightpen.local_time import local_now
from lightpen.messages import Message, message
from lightpen.record.folder import TOUCHES, TrialOutcome
from lightpen.record.results.result_folder import FolderArchive
from lightpen.record.swings.header import Header
from lightpen.record.swings.writing import make_record_folder
from lightpen.runners import (
    BackgroundTask,
    FaultReporter,
    Report,
    StartThread,
    WorkflowRunner,
)
from lightpen.swing.preparation import Preparation
from lightpen.swing.swing_recorder import record_header
from lightpen_extensions.measure.probing.current_tip import (
    CurrentTip,
    read_tip_in_force,
)
from lightpen_extensions.measure.session import (
    ReadingState,
    SessionEventKind,
    SessionState,
    SessionTransition,
    VerificationListener,
    VerificationStatus,
    end_run,
    end_task,
    ending,
    event_kinds,
    setup_of,
    with_pen_at_rest,
    without_last_touch,
)
from lightpen_extensions.measure.storage.session_files import SessionKeeping
from lightpen_extensions.measure.storage.session_record import (
    InterruptedVerification,
    ResumedVerification,
    resume_verification,
)
from lightpen_extensions.measure.tasks.registry import task_of
from lightpen_extensions.measure.tasks.task import VerificationChoices

ANOTHER = message("verification.another-under-way")
NOT_READY = message("verification.not-ready")
BUG = message("verification.bug")

T = TypeVar("T")

_logger = logging.getLogger(__name__)


class Cause(Enum):
    """The cause of a fault that can end automatically."""

    IMAGES = auto()  # of touches cannot be kept
    NOTE = auto()  # the checkpoint cannot be written


class VerificationWorkflow:
    """Successive verifications of the current tip, with results in a data folder.

    Not thread-safe.
    """

    def __init__(
        self,
        archive: FolderArchive,
        data: Path,
        listener: VerificationListener,
        now: Callable[[], datetime],
        start: StartThread,
    ) -> None:
        self._archive = archive
        self._listener = listener
        self._now = now
        self._status = VerificationStatus()
        self._preparation: Preparation | None = None
        self._choices = VerificationChoices()
        self._keeping = SessionKeeping(data, self._begin_record, now)
        self._faults = FaultReporter(listener)
        self._task = BackgroundTask(start, self.recover, listener.on_progress)

    @property
    def status(self) -> VerificationStatus:
        """The verification as published last."""
        return self._status

    def recover(self) -> None:
        """Continue after an internal error, paused, as the next image may repeat it."""
        self._task.drop()
        status = replace(self._status, reading=ReadingState.NOTHING, is_paused=True)
        refusal = BUG if status.tip is None else status.refusal
        self._publish(replace(status, refusal=refusal))
        self._faults.report(BUG)

    # Commands

    def choose(self, preparation: Preparation, choices: VerificationChoices) -> None:
        """Set the choices; while an operator is present, the tip is read again."""
        before, self._preparation = self._preparation, preparation
        self._choose_how(choices)
        is_other = (
            before is None
            or not before.swings_like(preparation)
            or before.source != preparation.source
        )
        status = self._status
        has_none = status.tip is None and status.refusal is None and not status.reading
        if status.is_here and (is_other or has_none):
            self._read_tip()

    def note_arrival(self) -> None:
        """Operator present: read the current tip, and take images."""
        self._publish(replace(self._rested(), is_here=True))
        self._write()
        if self._status.reading is not ReadingState.IMAGES:
            self._read_tip()

    def note_departure(self) -> None:
        """Operator absent: take no images."""
        self._publish(replace(self._status, is_here=False))

    def toggle_pause(self) -> None:
        """Pause or resume the capture."""
        self._publish(replace(self._rested(), is_paused=not self._status.is_paused))

    def start_over(self) -> None:
        """Discard all touches and read the current tip again; files are kept."""
        self._task.drop()
        self._faults.end()
        self._give_up()
        self._publish(VerificationStatus(is_here=self._status.is_here))
        self._read_tip()

    def undo(self) -> None:
        """Take back the last point of the current run; its images do not count."""
        before = self._status.state
        if before is None or not before.touches:
            return
        self._follow(before, SessionTransition(without_last_touch(before)))

    def end_task(self) -> None:
        """End the current task with its touches, if they suffice."""
        status = self._status
        if status.setup is None or status.state is None:
            return
        self._follow(status.state, end_task(status.setup, status.state))

    def _follow(self, before: SessionState, transition: SessionTransition) -> None:
        """Keep what no image brought about, or report why that is impossible."""
        try:
            self._keeping.images.follow(before, transition)
        except FileError as error:
            self._faults.report(error.message)
            return
        self._become(transition)

    def continue_session(self, interrupted: InterruptedVerification) -> None:
        """Resume an interrupted verification, or report why that is impossible."""
        preparation, under_way = self._preparation, interrupted.under_way
        status = self._status
        if preparation is None or under_way is None or self._task.is_there:
            return
        if status.began is not None and not status.is_done:
            self._faults.report(ANOTHER)
            return
        if preparation.missing_inputs():
            self._faults.report(NOT_READY)
            return
        chosen = replace(under_way.choices, limits=self._choices.limits)
        again = with_entries(under_way, choices=chosen)
        archive, path = self._archive, interrupted.path
        self._start(
            ReadingState.IMAGES,
            lambda _: resume_verification(archive, preparation, path, again),
            partial(self._on_continued, path),
            self._on_not_resumed,
        )

    def _on_continued(self, path: Path, before: ResumedVerification) -> None:
        self._give_up()
        try:
            self._keeping.take_over(path, before)
        except FileError as error:
            self._on_not_resumed(error.message)
            return
        self._faults.end()
        self._choices = before.setup.choices  # of that session
        state = with_pen_at_rest(before.state)
        self._status = VerificationStatus(
            tip=before.tip,
            setup=before.setup,
            state=state,
            region=before.tip.region,
            began=before.under_way.began,
            files=before.files,
            is_here=self._status.is_here,
            refusal=self._why_not(before.tip),
        )
        transition = end_run(before.setup, state)
        if transition.state is state:
            self._publish(self._status)
        else:  # it was interrupted before its complete run was ended
            self._follow(state, transition)

    def shut_down(self) -> None:
        """Write pending records and stop."""
        self._task.drop()
        self._give_up()
        self._write()
        self._keeping.release()

    # Images

    def process_image(
        self, frame: Frame, detection: PenDetection | None, region: RegionOfInterest
    ) -> None:
        """Process an image, see `VerificationRunner.process_image`."""
        status = self._status
        if not status.is_touching or region is not status.region or detection is None:
            return
        setup, state = status.setup, status.state
        assert setup is not None
        assert state is not None
        if status.began is None:
            self._status = replace(status, began=self._now())
        try:
            images = self._keeping.images
            transition = images.process_image(setup, state, frame, detection)
        except FileError as error:  # an image that is not kept does not count
            self._faults.report(error.message, Cause.IMAGES)
            return
        self._faults.end_of(Cause.IMAGES)
        self._become(transition)

    def _begin_record(self) -> tuple[Path, Header]:
        """Make the folder for the images of the session, and return its header."""
        status, preparation = self._status, self._preparation
        assert preparation is not None
        assert status.tip is not None
        tip = status.tip
        header = record_header(preparation)
        touches = self._keeping.root(tip) / TOUCHES
        return make_record_folder(touches, tip.names, header.created), header

    def _become(self, transition: SessionTransition) -> None:
        before = self._status.state
        self._status = replace(self._status, state=transition.state)
        happened = event_kinds(before, transition)
        if transition.finished is not None:
            happened.append(ending(self._status))
            self._conclude()
        self._publish(self._status, *happened)

    def _rested(self) -> VerificationStatus:
        """Return the status for a pen that may have been put down."""
        state = self._status.state
        if state is None:
            return self._status
        return replace(self._status, state=with_pen_at_rest(state))

    # The tip

    def _choose_how(self, choices: VerificationChoices) -> None:
        if choices == self._choices:
            return
        self._choices = choices
        if self._status.reading is ReadingState.IMAGES:
            self._task.drop()  # they use the previous choices
            self._publish(replace(self._status, reading=ReadingState.NOTHING))
        status, tip, setup = self._status, self._status.tip, self._status.setup
        if tip is None or setup is None:
            return
        if choices.kind != setup.choices.kind:
            self._begin(tip)
            return
        setup = setup_of(tip, choices)
        refusal = self._why_not(tip)
        self._publish(replace(status, setup=setup, refusal=refusal))

    def _begin(self, tip: CurrentTip) -> None:
        """Begin the next verification with a tip."""
        self._give_up()
        self._publish(
            VerificationStatus(
                tip=tip,
                setup=setup_of(tip, self._choices),
                state=with_pen_at_rest(SessionState()),
                region=tip.region,
                is_here=self._status.is_here,
                refusal=self._why_not(tip),
            )
        )

    def _read_tip(self) -> None:
        preparation = self._preparation
        if preparation is None or preparation.missing_inputs():
            return
        self._task.drop()
        archive = self._archive
        self._start(
            ReadingState.TIP,
            lambda _: read_tip_in_force(archive, preparation),
            self._on_tip_read,
            self._on_no_tip,
        )

    def _on_tip_read(self, tip: CurrentTip) -> None:
        status = replace(self._status, reading=ReadingState.NOTHING)
        if status.tip is None or not tip.is_like(status.tip):
            self._begin(tip)
        else:
            self._publish(replace(status, refusal=self._why_not(tip)))

    def _on_no_tip(self, why: Message) -> None:
        self._give_up()
        self._publish(VerificationStatus(is_here=self._status.is_here, refusal=why))

    def _why_not(self, tip: CurrentTip) -> Message | None:
        """Return why the selection cannot be verified."""
        task = task_of(self._choices.kind)
        return task.missing(self._choices, tip.names.ball_diameter)

    def _on_not_resumed(self, why: Message) -> None:
        self._faults.report(why)
        self._publish(replace(self._status, reading=ReadingState.NOTHING))

    def _start(
        self,
        reading: ReadingState,
        work: Callable[[Report], T],
        then: Callable[[T], None],
        otherwise: Callable[[Message], None],
    ) -> None:
        self._task.begin(work, then, otherwise)
        self._publish(replace(self._status, reading=reading))

    # Records

    def _conclude(self) -> None:
        """Write the result of the task, and what becomes of the tip."""
        found = self._status.assessment
        is_kept = found is not None and found.is_accepted
        self._keeping.add_task(self._status)
        outcome = TrialOutcome.ACCEPTED if is_kept else TrialOutcome.REFUSED
        self._keeping.conclude(self._status, outcome)
        self._write()

    def _give_up(self) -> None:
        """Conclude an incomplete verification."""
        with suppress(FileError):  # its images stay interrupted
            self._keeping.give_up(self._status)
        self._write()
        self._keeping.begin()

    def _write(self) -> None:
        """Write pending records, or report why that is impossible."""
        if not self._keeping.is_behind:
            return
        try:
            self._keeping.write()
            self._faults.end()
        except LightpenError as error:
            self._faults.report(error.message)
        self._status = replace(self._status, files=self._keeping.files)

    def _note_under_way(self) -> None:
        """Write the checkpoint from which the verification can be resumed."""
        try:
            self._keeping.note(self._status)
        except FileError as error:
            if not self._faults.is_any:  # it may be reported already
                self._faults.report(error.message, Cause.NOTE)
            return
        self._faults.end_of(Cause.NOTE)

    def _publish(self, status: VerificationStatus, *events: SessionEventKind) -> None:
        """Set the status and notify."""
        if status.tip is not None and status.tip is not self._status.tip:
            _logger.info("tip read: %s", status.tip.tip_file.path)
        for event in events:
            _logger.info("event: %s", event)
        self._status = status
        self._note_under_way()
        self._listener.on_verification(status, events)


class VerificationRunner(WorkflowRunner[VerificationWorkflow]):
    """Verifies the current tip, by live images and by recorded ones.

    Every method returns at once, but for `take` and `await_end`. A command that
    cannot be carried out in the state that the verification is in by then does
    nothing.
    """

    def __init__(
        self,
        archive: FolderArchive,
        data: Path,
        listener: VerificationListener,
        now: Callable[[], datetime] = local_now,
    ) -> None:
        super().__init__(
            "verification", partial(VerificationWorkflow, archive, data, listener, now)
        )

    @property
    def status(self) -> VerificationStatus:
        """The last published status; thread-safe."""
        return self._workflow.status

    @property
    def is_here(self) -> bool:
        """Whether an operator is present."""
        return self.status.is_here

    @property
    def region(self) -> RegionOfInterest | None:
        """What is searched for in the images; None while none are taken."""
        status = self.status
        return status.region if status.is_touching else None

    @property
    def stage(self) -> object:
        """The task that takes images."""
        status = self.status
        return status.task if status.is_touching else None

    def process_image(
        self, frame: Frame, detection: PenDetection | None, region: RegionOfInterest
    ) -> None:
        """Take an image, and return when it is processed.

        The detection is None if the image has the wrong size; images searched for
        another region are ignored.
        """
        self._queue.ask_and_wait(
            lambda: self._workflow.process_image(frame, detection, region)
        )
