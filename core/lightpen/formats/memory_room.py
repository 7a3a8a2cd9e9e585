"""How many images may be worked on at once, by the memory they take."""

from collections.abc import Iterator
from contextlib import contextmanager
from threading import Condition


class MemoryRoom:
    """Lets threads in one by one until the first image is known, then as fit in.

    One is let in whatever it takes.

    Parameters
    ----------
    budget : int
        bytes that all of them may take.
    """

    def __init__(self, budget: int) -> None:
        self._budget = budget
        self._changed = Condition()
        self._n = 0
        self._largest: int | None = None

    @contextmanager
    def one(self) -> Iterator[None]:
        """Work on an image, once there is room."""
        with self._changed:
            self._changed.wait_for(self._has_room)
            self._n += 1
        try:
            yield
        finally:
            with self._changed:
                self._n -= 1
                self._changed.notify_all()

    def note(self, n_bytes: int) -> None:
        """Take note of what work on an image takes."""
        with self._changed:
            self._largest = max(n_bytes, self._largest or 0)
            self._changed.notify_all()

    def _has_room(self) -> bool:
        if self._n == 0:
            return True
        largest = self._largest
        return largest is not None and (self._n + 1) * largest <= self._budget
