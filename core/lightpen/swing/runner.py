"""The one owner of a swing, from its first image to the accepted tip.

A thread of its own leads the course of the swing. What a user wants reaches it through
one queue, and so do the images, one at a time: an image that is kept is on the disk
before the next is asked for. It tells of every change and every event, and hears
nothing else. Solving and reading take long and run beside it; all other work on the
disk is done in its turn, between two images.
"""

from collections.abc import Callable, Iterable
from datetime import datetime
from functools import partial
from pathlib import Path

from lightpen.archive.late_logbook import LateLogbook
from lightpen.cameras.protocol import Frame, Stats
from lightpen.detection.sighting import Sighting
from lightpen.local_time import local_now
from lightpen.record.archive import Archive
from lightpen.record.results import Result
from lightpen.record.supervision import Signature
from lightpen.swing.course import SwingCourse
from lightpen.swing.preparation import Preparation
from lightpen.swing.resuming import Resumable
from lightpen.swing.serial_queue import SerialQueue
from lightpen.swing.state import SwingSetup
from lightpen.swing.status import SwingListener, SwingStatus


class SwingRunner:
    """Captures, solves and accepts one swing after another.

    Every method returns at once, but for `take` and `await_end`. What cannot be done
    in the state that the swing is in by then is not done.

    Parameters
    ----------
    records : Path
        Folder that a new swing's record is made in.
    archive : Archive
        Of the accepted results.
    now : callable
        Returns date and time with the time zone.
    logbook : LateLogbook, optional
        That what becomes of swings is entered in; without one, files alone tell of it.
    """

    def __init__(
        self,
        records: Path,
        archive: Archive,
        listener: SwingListener,
        now: Callable[[], datetime] = local_now,
        logbook: LateLogbook | None = None,
    ) -> None:
        self._queue = SerialQueue("swing", lambda: self._course.recover())
        self._course = SwingCourse(
            *(records, archive, listener, now, self._queue.start, logbook)
        )

    @property
    def status(self) -> SwingStatus:
        """The swing as it was told last, from any thread."""
        return self._course.status

    # Commands

    def begin(self, preparation: Preparation) -> None:
        """Begin a new swing; the one before stays on the disk as it is."""
        self._queue.ask(partial(self._course.begin, preparation))

    def go_on(self, swing: Resumable) -> None:
        """Go on with an interrupted swing that was read back."""
        self._queue.ask(partial(self._course.go_on, swing))

    def choose(self, preparation: Preparation) -> None:
        """Know what is chosen, for the next swing that begins by itself.

        With another source of images, a swing that is captured is left.
        """
        self._queue.ask(partial(self._course.choose, preparation))

    def keep_choices(self) -> None:
        """Go on with what the swing began with: `has_other_choices` is settled."""
        self._queue.ask(self._course.keep_choices)

    def come(self) -> None:
        """Somebody is at the swing: begin with the next image, or go on."""
        self._queue.ask(self._course.come)

    def leave(self) -> None:
        """Nobody is at the swing: pause what is captured until somebody comes."""
        self._queue.ask(self._course.leave)

    def try_again(self) -> None:
        """Begin a swing by itself that was refused before."""
        self._queue.ask(self._course.try_again)

    def pause(self) -> None:
        """Pause the capture for its user."""
        self._queue.ask(self._course.pause)

    def resume(self) -> None:
        """Go on after a pause of the user."""
        self._queue.ask(self._course.resume)

    def finish(self) -> None:
        """End the capture with what there is, and solve."""
        self._queue.ask(self._course.finish)

    def solve(self) -> None:
        """Compute the tip from the images on the disk."""
        self._queue.ask(self._course.solve)

    def cancel(self) -> None:
        """Stop computing and reading; images, record and solution stay as they are."""
        self._queue.ask(self._course.cancel)

    def take_out(self, numbers: Iterable[int]) -> None:
        """Leave images out, and solve again at once."""
        self._queue.ask(partial(self._course.take_out, tuple(numbers)))

    def put_back(self, numbers: Iterable[int]) -> None:
        """Let images take part again, and solve again at once."""
        self._queue.ask(partial(self._course.put_back, tuple(numbers)))

    def capture_more(self) -> None:
        """Go on with this swing after its verdict, as soon as its images are read."""
        self._queue.ask(self._course.capture_more)

    def accept(self, reason: str = "", signature: Signature | None = None) -> None:
        """Put the tip in force; the one before stays where it cannot be stored.

        Parameters
        ----------
        reason : str
            Why it is accepted though it is to be checked.
        signature : Signature, optional
            Of a supervisor, where it takes one.
        """
        self._queue.ask(partial(self._course.accept, reason, signature))

    def take_back(self, result: Result, operator: str) -> None:
        """Let the result before one in force be in force again.

        Parameters
        ----------
        operator : str
            Who takes it back.
        """
        self._queue.ask(partial(self._course.take_back, result, operator))

    def set_aside(self) -> None:
        """Leave the swing for good, as before a repetition; its images are kept."""
        self._queue.ask(self._course.set_aside)

    def start_over(self) -> None:
        """Set the swing aside and begin anew, with what is chosen now."""
        self._queue.ask(self._course.start_over)

    def abandon(self) -> None:
        """Leave the swing; its record can be resumed."""
        self._queue.ask(self._course.abandon)

    def open_logbook(self) -> None:
        """Have entered what the files tell of and the archive does not yet."""
        self._queue.ask(self._course.open_logbook)

    def shut_down(self) -> None:
        """Do what was commanded, leave the swing to be resumed, and end."""
        self._queue.end(self._course.shut_down)

    def await_end(self, timeout_s: float) -> bool:
        """Wait for the end after `shut_down` and return whether it came."""
        return self._queue.await_end(timeout_s)

    # Images

    def take(
        self,
        frame: Frame,
        sighting: Sighting | None,
        setup: SwingSetup | None = None,
        n_images: int | None = None,
        stats: Stats | None = None,
    ) -> None:
        """Take an image, and return when all is done that it asks for.

        Parameters
        ----------
        sighting : Sighting or None
            What it shows, if it is of the right size.
        setup : SwingSetup, optional
            What was looked for; images of another swing than the present are not kept.
        n_images : int, optional
            Of the recording that is shown over and over; a swing of recorded images
            ends with the last.
        stats : Stats, optional
            What the camera has counted by now.
        """
        self._queue.ask_and_wait(
            partial(self._course.take, frame, sighting, setup, n_images, stats)
        )
