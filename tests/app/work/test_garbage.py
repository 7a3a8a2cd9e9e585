"""Python's garbage collector frees Qt objects in their own thread only."""

import gc
import threading
from collections.abc import Iterator
from typing import Any

import pytest
from PySide6.QtCore import QObject
from pytestqt.qtbot import QtBot

from lightpen_app.work.job import GarbageCollector

N_CYCLES = 50_000


@pytest.fixture
def threads() -> Iterator[list[int]]:
    """The threads in which the collector ran."""
    found: list[int] = []

    def note(phase: str, details: dict[str, Any]) -> None:
        found.append(threading.get_ident())

    gc.callbacks.append(note)
    yield found
    gc.callbacks.remove(note)
    gc.unfreeze()


def make_garbage() -> None:
    for _ in range(N_CYCLES):
        cycle: list[object] = []
        cycle.append(cycle)


def in_a_thread() -> None:
    worker = threading.Thread(target=make_garbage)
    worker.start()
    worker.join()


def test_garbage_of_any_thread_is_collected_in_that_of_the_window(
    qtbot: QtBot, threads: list[int]
) -> None:
    parent = QObject()
    GarbageCollector(parent)
    threads.clear()

    in_a_thread()
    qtbot.waitUntil(lambda: bool(threads))

    assert set(threads) == {threading.get_ident()}


def test_left_to_itself_the_collector_runs_in_any_thread(threads: list[int]) -> None:
    gc.enable()
    in_a_thread()
    gc.disable()

    assert set(threads) - {threading.get_ident()}
