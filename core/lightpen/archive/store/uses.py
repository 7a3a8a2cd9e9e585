"""Counts the users of a shared resource, which closes after the last one."""

from collections.abc import Iterator
from contextlib import contextmanager
from threading import Condition

from lightpen.errors import ArchiveError


class UseCount:
    """Counts the users of an archive and admits no more once it is closing."""

    def __init__(self) -> None:
        self._changed = Condition()
        self._n = 0
        self._is_over = False

    @property
    def are_over(self) -> bool:
        """Whether new users are refused."""
        return self._is_over

    @contextmanager
    def one(self) -> Iterator[None]:
        """Use it."""
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
        """Refuse new users and wait for the present ones, up to a time limit."""
        with self._changed:
            self._is_over = True
            self._changed.wait_for(lambda: self._n == 0, timeout_s)


def closed() -> ArchiveError:
    """Return the error that an archive is closed."""
    return ArchiveError("archive.closed")
