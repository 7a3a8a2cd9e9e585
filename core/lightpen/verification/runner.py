"""The one owner of a verification, from the tip in force to its verdict.

A thread of its own leads its course. What a user wants reaches it through one queue,
and so do the images, one at a time; it tells of every change and every event. Reading
results and recorded images takes long and runs beside it; what is found is written in
its turn, between two images.
"""

from collections.abc import Callable
from datetime import datetime
from functools import partial
from pathlib import Path

from lightpen.cameras.protocol import Frame
from lightpen.detection.aim import Aim
from lightpen.detection.sighting import Sighting
from lightpen.local_time import local_now
from lightpen.record.folder_archive import FolderArchive
from lightpen.record.supervision import Signature
from lightpen.swing.preparation import Preparation
from lightpen.swing.serial_queue import SerialQueue
from lightpen.verification.choices import TaskKind, VerificationChoices
from lightpen.verification.course import VerificationCourse
from lightpen.verification.status import VerificationListener, VerificationStatus
from lightpen.verification.under_way import InterruptedVerification


class VerificationRunner:
    """Verifies the tip in force, by live images and by recorded ones.

    Every method returns at once, but for `take` and `await_end`. What cannot be done
    in the state that the verification is in by then is not done.

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
        now: Callable[[], datetime] = local_now,
    ) -> None:
        self._queue = SerialQueue("verification", lambda: self._course.recover())
        self._course = VerificationCourse(
            archive, data, listener, now, self._queue.start
        )

    @property
    def status(self) -> VerificationStatus:
        """The verification as it was told last, from any thread."""
        return self._course.status

    def choose(self, preparation: Preparation, choices: VerificationChoices) -> None:
        """Know what is chosen: the tip, its files, and what is touched."""
        self._queue.ask(partial(self._course.choose, preparation, choices))

    def come(self) -> None:
        """Somebody is at it: the tip in force is read, and images are taken."""
        self._queue.ask(self._course.come)

    def leave(self) -> None:
        """Nobody is at it: no images are taken until somebody comes."""
        self._queue.ask(self._course.leave)

    def pause(self) -> None:
        """Take no images until it is resumed."""
        self._queue.ask(self._course.pause)

    def resume(self) -> None:
        """Take images again."""
        self._queue.ask(self._course.resume)

    def start_over(self) -> None:
        """Forget all touches and begin anew; what was found is kept on the disk."""
        self._queue.ask(self._course.start_over)

    def touch_anew(self, task: TaskKind) -> None:
        """Do one task again; what it found before is kept on the disk."""
        self._queue.ask(partial(self._course.touch_anew, task))

    def accept(self, reason: str, signature: Signature | None = None) -> None:
        """Accept the tip though something was found against it.

        Parameters
        ----------
        signature : Signature, optional
            Of a supervisor, where it takes one.
        """
        self._queue.ask(partial(self._course.accept, reason, signature))

    def end_task(self) -> None:
        """End the task at hand with the touches that there are, if they suffice."""
        self._queue.ask(self._course.end_task)

    def read(self, task: TaskKind, place: str, *, is_still: bool) -> None:
        """Do a task with recorded images; see `VerificationCourse.read`."""
        self._queue.ask(partial(self._course.read, task, place, is_still=is_still))

    def go_on(self, interrupted: InterruptedVerification) -> None:
        """Go on with an interrupted verification; its names and files are chosen."""
        self._queue.ask(partial(self._course.go_on, interrupted))

    def cancel(self) -> None:
        """Stop reading."""
        self._queue.ask(self._course.cancel)

    def shut_down(self) -> None:
        """Do what was commanded, write what is found, and end."""
        self._queue.end(self._course.shut_down)

    def await_end(self, timeout_s: float) -> bool:
        """Wait for the end after `shut_down` and return whether it came."""
        return self._queue.await_end(timeout_s)

    def take(self, frame: Frame, sighting: Sighting | None, aim: Aim) -> None:
        """Take an image, and return when all is done that it asks for.

        Parameters
        ----------
        sighting : Sighting or None
            What it shows, if it is of the right size.
        aim : Aim
            What was looked for; images looked at for something else are not taken.
        """
        self._queue.ask_and_wait(partial(self._course.take, frame, sighting, aim))
