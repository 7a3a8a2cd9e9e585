"""The workflow of a swing: effects of commands, images and solutions on its status.

Nothing here knows threads: the owner makes all calls in turn, and runs long
computations elsewhere.
"""

from collections.abc import Callable
from dataclasses import replace
from datetime import datetime
from pathlib import Path

from lightpen.archive.lazy_logbook import LazyLogbook
from lightpen.cameras.protocol import Frame, Stats
from lightpen.detection.pen_detection import PenDetection
from lightpen.errors import LightpenError
from lightpen.messages import Message, message
from lightpen.record.results.result_folder import FolderArchive
from lightpen.record.swings.interrupted import discard_swing
from lightpen.record.swings.reading import Record
from lightpen.record.swings.solving import Solution
from lightpen.record.swings.writing import RecordWriter, make_record_folder
from lightpen.runners import StartThread, Task
from lightpen.swing.capture.kept_images import seen_by_rig
from lightpen.swing.capture.rules import (
    advance_swing,
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
from lightpen.swing.preparation import Preparation
from lightpen.swing.solving import SwingSolving
from lightpen.swing.status import Activity, PublishedSwing, SwingListener, SwingStatus
from lightpen.swing.swing_recorder import (
    Resumable,
    SwingRecorder,
    read_for_more,
    read_resumable,
    record_header,
)

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
        self._now = now
        self._shown = PublishedSwing(listener)
        self._faults = self._shown.faults
        self._logbook = logbook or LazyLogbook.none()
        self._start_beside = start
        self._catching_up: Task | None = None  # with events in files only
        self._recorder: SwingRecorder | None = None
        self._first: tuple[SwingStatus, Record] | None = None  # during a press test
        self._stopped_at: SwingStatus | None = None  # by a bug
        self.solving = SwingSolving(
            self._shown, archive, listener, now, start, self._logbook, self._end_press
        )

    @property
    def status(self) -> SwingStatus:
        """The status as published last."""
        return self._shown.status

    def recover(self) -> None:
        """Pause after an internal error; the swing is unchanged.

        Images are ignored until the status changes: all of them may cause it.
        """
        if not self.solving.is_busy:  # it may have ended by this bug
            self._shown.status = replace(self._shown.status, activity=Activity.NONE)
        try:
            self.pause()
            self._shown.republish()
            self._faults.report(message("swing.bug"))
        finally:
            self._stopped_at = self._shown.status

    def continue_swing(self, swing: Resumable) -> None:
        """Resume a swing that was read back, or report why it cannot be."""
        self._faults.trying(lambda: self._enter(swing))

    # Presence of the operator

    def choose(self, preparation: Preparation) -> None:
        """Set the choices for the next swing; another source ends this one."""
        before = self._shown.presence.choices
        self._shown.presence = self._shown.presence.choose(preparation)
        is_other = before is not None and before.sources != preparation.sources
        if is_other and self._shown.status.is_capturing:
            self.abandon()
        self._shown.republish()

    def keep_choices(self) -> None:
        """Continue with the choices that the swing began with."""
        presence = self._shown.presence
        self._shown.presence = replace(presence, begun_with=presence.choices)
        self._shown.republish()

    def note_arrival(self) -> None:
        """Begin with the next image, or resume a swing that was paused by leaving."""
        was_paused = self._shown.presence.paused_by_leaving
        self._shown.presence = self._shown.presence.arrived()
        if self._shown.status.result is not None:  # that swing is concluded
            self.abandon()
        if was_paused:
            self._change(lambda state: Transition(resume(state)))
        self._shown.republish()

    def note_departure(self) -> None:
        """Begin no swing, and pause the capture."""
        self._shown.presence = self._shown.presence.left()
        self._pause_unattended()

    def _pause_unattended(self) -> None:
        """Pause a swing without an operator."""
        status = self._shown.status
        goes_on = status.is_capturing and not status.is_paused_by_user
        if goes_on and self._shown.presence.is_away:
            self._shown.presence = replace(self._shown.presence, paused_by_leaving=True)
            self._change(lambda state: Transition(pause(state)))

    def try_again(self) -> None:
        """Forget why no swing could begin."""
        self._shown.presence = replace(self._shown.presence, refusal=None)
        self._shown.republish()

    # Capture

    def begin(self, preparation: Preparation, *, is_press_test: bool = False) -> None:
        """Begin a new swing, or report why it cannot begin."""
        try:
            folder = make_record_folder(self._records, preparation.names, self._now())
            RecordWriter.create(
                folder, record_header(preparation, is_press_test=is_press_test)
            ).close()
            self._enter(read_resumable(folder))  # so with the files as recorded
        except LightpenError as error:
            self._shown.presence = replace(self._shown.presence, refusal=error.message)
            self._faults.report(error.message)
            self._shown.republish()

    def _enter(self, swing: Resumable) -> None:
        """Enter a new swing, or resume an old one, as read from the disk."""
        status, record = self._shown.status, swing.record
        if status.is_capturing and record.folder == status.record_folder:
            return  # it continues already
        names = record.header.names
        recorder = SwingRecorder(record)
        self.solving.drop()
        self._close_record()
        self._first = None
        self._recorder, self.solving.record = recorder, record
        if record.folder != status.record_folder:
            self._shown.presence = self._shown.presence.begun()
        self._faults.end()
        self._shown.publish(
            SwingStatus(
                setup=swing.setup,
                state=replace(swing.state, heading=self._heading_for(swing)),
                record_folder=record.folder,
                names=names,
                origin=record.header.origin,
            )
        )
        self._pause_unattended()
        if not swing.setup.is_recording and has_enough(swing.setup, swing.state):
            self.finish()  # it was interrupted after its last image

    def press(self) -> None:
        """Begin a short swing with firm pressure, to be compared with this one."""
        first, record, choices = (
            self._shown.status,
            self.solving.record,
            self._shown.presence.choices,
        )
        if first.solution is None or self.solving.is_busy or first.is_recording:
            return
        if record is None or choices is None:
            return
        is_other = (
            self._shown.presence.has_other_choices or choices.names != first.names
        )
        if is_other or choices.missing_inputs():
            self._faults.report(message("press-test.other-choices"))
            return
        limits = replace(
            choices.limits, min_images=PRESS_IMAGES, max_uncertainty=PRESS_UNCERTAINTY
        )
        self.begin(replace(choices, limits=limits), is_press_test=True)
        if self._shown.status.record_folder != first.record_folder:
            self._first = replace(first, pressed=None), record

    def _end_press(self, pressed: Solution | None) -> bool:
        """Return from a swing with firm pressure, if it is one, to the one before."""
        folder = self._shown.status.record_folder
        if self._first is None or folder is None:
            return False
        (first, self.solving.record), self._first = self._first, None
        assert first.solution is not None
        self.solving.drop()
        self._close_record()
        self._faults.trying(lambda: discard_swing(folder))
        self.solving.wanted = first.solution.excluded
        done = SwingEvent(SwingEventKind.DONE)
        self._shown.publish(replace(first, pressed=pressed), done)
        return True

    def _heading_for(self, swing: Resumable) -> float | None:
        """Return the operator's heading from this swing or from the station."""
        status, choices = self._shown.status, self._shown.presence.choices
        if swing.setup.is_recording:
            return None
        if status.record_folder == swing.record.folder and status.state is not None:
            return status.state.heading
        return None if choices is None else choices.heading

    def forget_side(self) -> None:
        """Ask the operator again which side is the right one."""
        self._change(lambda state: Transition(forget_side(state)))

    def process_image(
        self,
        frame: Frame,
        detection: PenDetection | None,
        setup: SwingSetup | None,
        n_images: int | None,
        stats: Stats | None,
    ) -> None:
        """Process an image; see `SwingRunner.process_image`."""
        status, choices = self._shown.status, self._shown.presence.choices
        if status is self._stopped_at:
            return
        if detection is not None and setup is not None:
            detection = seen_by_rig(setup.rig, setup.pen, detection)
        if status.state is None:
            if self._shown.presence.is_due and choices is not None:
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
        setup, recorder = self._shown.status.setup, self._recorder
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
        setup = self._shown.status.setup
        assert setup is not None
        state = advance_swing(setup, before, detection, frame.host_ts_ns * 1e-9).state
        says_yes = stillness(state) == 1.0 and stillness(before) < 1.0
        events = (SwingEvent(SwingEventKind.CONFIRMED),) if says_yes else ()
        self._shown.publish(replace(self._shown.status, state=state), *events)

    def pause(self) -> None:
        """Pause for the user."""
        self._shown.presence = replace(self._shown.presence, paused_by_leaving=False)
        self._change(lambda state: Transition(pause(state)))

    def resume(self) -> None:
        """Resume after a pause by the user."""
        self._shown.presence = replace(self._shown.presence, paused_by_leaving=False)
        self._change(lambda state: Transition(resume(state)))

    def _change(self, act: Callable[[SwingState], Transition]) -> None:
        """Apply a command to a swing that is being captured."""
        status = self._shown.status
        if status.is_capturing and status.state is not None:
            self._become(act(status.state))

    def _become(self, transition: Transition, *, has_fault: bool = False) -> None:
        state = transition.state
        ends = state.phase is Phase.SOLVING
        status = replace(self._shown.status, state=state)
        if ends:
            self._close_record()
            status = replace(status, activity=Activity.SOLVING)
        has_fault = has_fault or (status.has_fault and status.is_paused_by_user)
        self._shown.publish(replace(status, has_fault=has_fault), *transition.events)
        if ends:
            self.solving.solve()

    def abandon(self) -> None:
        """Suspend the swing; its record stays on disk."""
        self._end_press(None)
        self.solving.drop()
        self._close_record()
        self._shown.publish(SwingStatus(setup=self._shown.status.setup))

    def discard(self) -> None:
        """Discard the swing, or report why that cannot be recorded."""
        self._faults.trying(self._discard)

    def _discard(self) -> None:
        if self._end_press(None):
            return
        status = self._shown.status
        if status.record_folder is None or status.result is not None:
            return
        if self._recorder is None:
            discard_swing(status.record_folder)
        else:
            self._recorder.discard()
        self.abandon()
        self._faults.trying(
            lambda: self._logbook.enter_unused(
                status.solution, status.assessment, self._now()
            )
        )

    def start_over(self) -> None:
        """Discard the swing, unless it is accepted, and begin a new one."""
        if self._shown.status.result is None:
            self.discard()
        else:
            self.abandon()
        self.try_again()

    def capture_more(self) -> None:
        """Read the images of a swing that has its verdict, and capture more."""
        status = self._shown.status
        folder, state = status.record_folder, status.state
        if folder is None or state is None or status.result is not None:
            return
        if state.phase is not Phase.VERDICT or status.is_reading:
            return
        if status.setup is None or status.setup.is_recording:
            return
        self.solving.cancel()
        self.solving.start(
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
        self._shown.publish(replace(self._shown.status, activity=Activity.NONE))

    def _close_record(self) -> None:
        recorder, self._recorder = self._recorder, None
        if recorder is not None:
            recorder.close()

    def finish(self) -> None:
        """End the capture with the present images."""
        self._change(finish)

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
