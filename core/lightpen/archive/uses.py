"""Who uses something that is open to many threads, so that it closes after them."""

from collections.abc import Iterator
from contextlib import contextmanager
from threading import Condition

from lightpen.errors import ArchiveError


class UseCount:
    """Counts those who use an archive, until no more are let in."""

    def __init__(self) -> None:
        self._changed = Condition()
        self._n = 0
        self._is_over = False

    @property
    def are_over(self) -> bool:
        """Whether nobody is let in any more."""
        return self._is_over

    @contextmanager
    def one(self) -> Iterator[None]:
        """Use it.

        Raises
        ------
        ArchiveError
            It was closed.
        """
        with self._changed:
            if self._is_over:
                raise closed()
            self._n += 1
        try:
            yield
        finally:
            with self._changed:
                self._n -= 1
                self._changed.notify_all()

    def end(self, timeout_s: float) -> None:
        """Let nobody in any more, and wait for those who use it, so long at most."""
        with self._changed:
            self._is_over = True
            self._changed.wait_for(lambda: self._n == 0, timeout_s)


def closed() -> ArchiveError:
    """Return that an archive is closed."""
    return ArchiveError("archive.closed")
