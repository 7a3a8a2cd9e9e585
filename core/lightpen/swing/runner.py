"""The owner of a swing, from its first image to the accepted tip.

Its own thread runs the workflow. Commands and images reach it through one queue:
an accepted image is on the disk before the next is taken. A listener is notified of
every change and event. Solving and reading run in the background; all other work on
the disk is done between two images.
"""

from collections.abc import Callable, Iterable
from datetime import datetime
from pathlib import Path

from lightpen.archive.logbook.lazy_logbook import LazyLogbook
from lightpen.cameras.protocol import Frame, Stats
from lightpen.detection.pen_detection import PenDetection
from lightpen.local_time import local_now
from lightpen.record.library.supervision import Signature
from lightpen.record.results.result_folder import FolderArchive
from lightpen.record.results.results import Result
from lightpen.runners.serial_queue import SerialQueue
from lightpen.swing.capture.state import SwingSetup
from lightpen.swing.preparation import Preparation
from lightpen.swing.resuming import Resumable
from lightpen.swing.status import SwingListener, SwingStatus
from lightpen.swing.workflow import SwingWorkflow


class SwingRunner:
    """Captures, solves and accepts one swing after another.

    Every method returns at once, except `take` and `await_end`. A command that is not
    possible in the state of the swing by then is ignored.

    Parameters
    ----------
    records : Path
        Folder that a new swing's record is made in.
    logbook : LazyLogbook, optional
        Archive for the outcome of swings; without it the outcome is only in files.
    """

    def __init__(
        self,
        records: Path,
        archive: FolderArchive,
        listener: SwingListener,
        now: Callable[[], datetime] = local_now,
        logbook: LazyLogbook | None = None,
    ) -> None:
        self._queue = SerialQueue("swing", lambda: self._workflow.recover())
        self._workflow = SwingWorkflow(
            records, archive, listener, now, self._queue.start, logbook
        )

    @property
    def status(self) -> SwingStatus:
        """The last published status; thread-safe."""
        return self._workflow.status

    # Commands

    def begin(self, preparation: Preparation) -> None:
        """Begin a new swing; the previous one remains on disk."""
        self._queue.ask(lambda: self._workflow.begin(preparation))

    def go_on(self, swing: Resumable) -> None:
        """Resume an interrupted swing that was read back."""
        self._queue.ask(lambda: self._workflow.go_on(swing))

    def choose(self, preparation: Preparation) -> None:
        """Set the choices for the next swing that begins automatically.

        Another source of images ends a swing that is being captured.
        """
        self._queue.ask(lambda: self._workflow.choose(preparation))

    def keep_choices(self) -> None:
        """Continue with the choices that the swing began with."""
        self._queue.ask(self._workflow.keep_choices)

    def come(self) -> None:
        """Operator present: begin with the next image, or resume."""
        self._queue.ask(self._workflow.come)

    def leave(self) -> None:
        """Operator absent: pause the capture."""
        self._queue.ask(self._workflow.leave)

    def try_again(self) -> None:
        """Retry the automatic begin after it was refused."""
        self._queue.ask(self._workflow.try_again)

    def pause(self) -> None:
        """Pause the capture for its user."""
        self._queue.ask(self._workflow.pause)

    def resume(self) -> None:
        """Resume after a pause by the user."""
        self._queue.ask(self._workflow.resume)

    def forget_side(self) -> None:
        """Learn the operator's left and right again."""
        self._queue.ask(self._workflow.forget_side)

    def finish(self) -> None:
        """End the capture with the present images, and solve."""
        self._queue.ask(self._workflow.finish)

    def solve(self) -> None:
        """Compute the tip from the images on the disk."""
        self._queue.ask(self._workflow.solve)

    def cancel(self) -> None:
        """Stop computing and reading; images, record and solution stay as they are."""
        self._queue.ask(self._workflow.cancel)

    def take_out(self, numbers: Iterable[int]) -> None:
        """Exclude images, and solve again."""
        chosen = tuple(numbers)
        self._queue.ask(lambda: self._workflow.take_out(chosen))

    def put_back(self, numbers: Iterable[int]) -> None:
        """Include images again, and solve again."""
        chosen = tuple(numbers)
        self._queue.ask(lambda: self._workflow.put_back(chosen))

    def capture_more(self) -> None:
        """Capture more images after the verdict."""
        self._queue.ask(self._workflow.capture_more)

    def press(self) -> None:
        """Swing again with firm pressure, to be compared with this swing."""
        self._queue.ask(self._workflow.press)

    def accept(self, reason: str = "", signature: Signature | None = None) -> None:
        """Accept the tip; the previous one stays in force if it cannot be stored.

        Parameters
        ----------
        reason : str
            Reason for accepting the result despite findings.
        signature : Signature, optional
            Signature of a supervisor, if one is required.
        """
        self._queue.ask(lambda: self._workflow.accept(reason, signature))

    def revoke(
        self,
        result: Result,
        operator: str,
        reason: str = "",
        signature: Signature | None = None,
    ) -> None:
        """Revoke a result in favour of the one before.

        Parameters
        ----------
        reason : str
            In the words of the operator.
        signature : Signature, optional
            Signature of a supervisor, if one is required.
        """
        self._queue.ask(
            lambda: self._workflow.revoke(result, operator, reason, signature)
        )

    def set_aside(self) -> None:
        """Discard the swing, for a repetition; its images are kept."""
        self._queue.ask(self._workflow.set_aside)

    def start_over(self) -> None:
        """Discard the swing and begin a new one, with the present choices."""
        self._queue.ask(self._workflow.start_over)

    def abandon(self) -> None:
        """Suspend the swing; it can be resumed."""
        self._queue.ask(self._workflow.abandon)

    def open_logbook(self) -> None:
        """Enter events in the archive that are in files only."""
        self._queue.ask(self._workflow.open_logbook)

    def shut_down(self) -> None:
        """Finish pending commands, leave the swing to be resumed, and end."""
        self._queue.end(self._workflow.shut_down)

    def await_end(self, timeout_s: float) -> bool:
        """Wait for the end after `shut_down`; return whether it came in time."""
        return self._queue.await_end(timeout_s)

    # Images

    def take(
        self,
        frame: Frame,
        detection: PenDetection | None,
        setup: SwingSetup | None = None,
        n_images: int | None = None,
        stats: Stats | None = None,
    ) -> None:
        """Process an image; returns when it is done.

        Parameters
        ----------
        detection : PenDetection or None
            Detection in the image; None if the image has the wrong size.
        setup : SwingSetup, optional
            Setup of the detection; images of another swing are ignored.
        n_images : int, optional
            Length of the recording, which is replayed in a loop; the swing ends with
            the last image.
        stats : Stats, optional
            Counters of the camera at this image.
        """
        self._queue.ask_and_wait(
            lambda: self._workflow.take(frame, detection, setup, n_images, stats)
        )
