"""The one owner of a verification, from the current tip to its verdict.

Its own thread has its workflow. Commands reach it through one queue, and so do the
images, one at a time; it publishes every change and every event. Reading results and
recorded images takes long and runs in background threads; results are written on its
own thread, between two images.
"""

from collections.abc import Callable
from datetime import datetime
from pathlib import Path

from lightpen.cameras.protocol import Frame
from lightpen.detection.pen_detection import PenDetection
from lightpen.detection.pixel_box import RegionOfInterest
from lightpen.local_time import local_now
from lightpen.record.results.result_folder import FolderArchive
from lightpen.runners import SerialQueue
from lightpen_extensions.measure.session import VerificationListener, VerificationStatus
from lightpen_extensions.measure.workflow import VerificationWorkflow


class VerificationRunner:
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
        self._queue = SerialQueue("verification", lambda: self._workflow.recover())
        self._workflow = VerificationWorkflow(
            archive, data, listener, now, self._queue.start
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

    def ask(self, command: Callable[[VerificationWorkflow], None]) -> None:
        """Queue a command: a call of the workflow."""
        self._queue.ask(lambda: command(self._workflow))

    def shut_down(self) -> None:
        """Carry out all commands, write the results, and end."""
        self._queue.end(lambda: self._workflow.shut_down())

    def await_end(self, timeout_s: float) -> bool:
        """Wait for the end after `shut_down` and return whether it came."""
        return self._queue.await_end(timeout_s)

    def take(
        self, frame: Frame, detection: PenDetection | None, region: RegionOfInterest
    ) -> None:
        """Take an image, and return when it is processed.

        The detection is None if the image has the wrong size; images searched for
        another region are ignored.
        """
        self._queue.ask_and_wait(lambda: self._workflow.take(frame, detection, region))
