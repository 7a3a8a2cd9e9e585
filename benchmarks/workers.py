"""Processes that have one processor core each, and times measured in them."""

import os
import statistics
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from multiprocessing import get_context
from queue import SimpleQueue
from typing import TypeVar

import cv2

Item = TypeVar("Item")
Result = TypeVar("Result")

WARM_UP = 3  # calls that are not timed


class Workers:
    """Processes bound to one core each.

    A process is bound before it imports anything: the threads that numpy's BLAS would
    otherwise start, one for each core it sees, slow down whatever shares the cores.
    """

    def __init__(self, processes: Sequence[ProcessPoolExecutor]) -> None:
        self._processes = processes

    def call(self, function: Callable[[], Result]) -> Result:
        """Return what a function returns on the first core, all else being idle."""
        return self._processes[0].submit(function).result()

    def map(
        self, function: Callable[[Item], Result], items: Sequence[Item]
    ) -> list[Result]:
        """Return what a function returns for each item, in their order."""
        idle: SimpleQueue[ProcessPoolExecutor] = SimpleQueue()
        for process in self._processes:
            idle.put(process)

        def run(item: Item) -> Result:
            process = idle.get()
            try:
                return process.submit(function, item).result()
            finally:
                idle.put(process)

        with ThreadPoolExecutor(len(self._processes)) as threads:
            return list(threads.map(run, items))


@contextmanager
def one_core_workers() -> Iterator[Workers]:
    """Start a worker on every core."""
    with ExitStack() as stack:
        processes = []
        for core in _cores():
            with _bound_to(core):
                process = stack.enter_context(
                    ProcessPoolExecutor(1, get_context("spawn"), _use_one_thread)
                )
                process.submit(int).result()  # it starts here
            processes.append(process)
        yield Workers(processes)


def median_ms(function: Callable[[], object], repeats: int) -> float:
    """Return the median time of a call, ms."""
    for _ in range(WARM_UP):
        function()
    return statistics.median(elapsed_ms(function) for _ in range(repeats))


def elapsed_ms(function: Callable[[], object]) -> float:
    """Return the time of one call, ms."""
    start = time.perf_counter()
    function()
    return 1e3 * (time.perf_counter() - start)


def _use_one_thread() -> None:
    cv2.setNumThreads(1)


def _cores() -> list[int]:
    if sys.platform == "linux":
        return sorted(os.sched_getaffinity(0))
    return list(range(os.cpu_count() or 1))


@contextmanager
def _bound_to(core: int) -> Iterator[None]:
    """Bind this process to a core (Linux), and so the processes started meanwhile."""
    if sys.platform != "linux":
        yield
        return
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {core})
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)
