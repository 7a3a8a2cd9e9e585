"""Images are worked on at once as far as they fit into memory."""

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from threading import Event

import pytest

from lightpen.formats.images import MemoryRoom


@pytest.fixture
def pool() -> Iterator[ThreadPoolExecutor]:
    with ThreadPoolExecutor() as executor:
        yield executor


def let_in(room: MemoryRoom, pool: ThreadPoolExecutor) -> tuple[Event, Event]:
    """Ask for room in a thread; return when it is in, and what lets it go."""
    is_in, may_go = Event(), Event()

    def work() -> None:
        with room.one():
            is_in.set()
            may_go.wait()

    pool.submit(work)
    return is_in, may_go


def test_one_is_let_in_until_an_image_is_known(pool: ThreadPoolExecutor) -> None:
    room = MemoryRoom(100)
    with room.one():
        second, may_go = let_in(room, pool)
        assert not second.wait(0.05)
        room.note(50)
        assert second.wait(60)
    may_go.set()


def test_no_more_are_let_in_than_fit(pool: ThreadPoolExecutor) -> None:
    room = MemoryRoom(100)
    room.note(40)
    with ExitStack() as both:
        both.enter_context(room.one())
        both.enter_context(room.one())
        third, may_go = let_in(room, pool)
        assert not third.wait(0.05)
    assert third.wait(60)
    may_go.set()


def test_one_is_let_in_whatever_it_takes() -> None:
    room = MemoryRoom(100)
    room.note(1000)
    for _ in range(2):
        with room.one():
            pass
