"""Computations in worker processes."""

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from multiprocessing import get_context
from typing import Protocol, TypeVar

ONE_THREAD = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")

T = TypeVar("T")
S = TypeVar("S")
Report = Callable[[float], None]


class Map(Protocol):
    """Does something to all items in worker processes."""

    def __call__(
        self, function: Callable[[S], T], items: Sequence[S], report: Report
    ) -> list[T]:
        """Return the results of the function for all items, in order.

        ``report`` is called with the fraction done; an exception from it ends the
        computation, and pending items are dropped.
        """


@contextmanager
def local_workers(n_workers: int | None = None) -> Iterator[Map]:
    """Open worker processes, by default one a core."""
    context = get_context("spawn")  # a fork would copy threads that hold locks
    with ProcessPoolExecutor(
        n_workers or os.cpu_count() or 1, context, initializer=_use_one_thread
    ) as executor:

        def mapped(
            function: Callable[[S], T], items: Sequence[S], report: Report
        ) -> list[T]:
            futures = [executor.submit(function, item) for item in items]
            try:
                for n_done, _ in enumerate(as_completed(futures), 1):
                    report(n_done / len(futures))
                return [future.result() for future in futures]
            except BaseException:
                for future in futures:
                    future.cancel()
                raise

        yield mapped


def _use_one_thread() -> None:
    """Let each process keep to its core."""
    for name in ONE_THREAD:
        os.environ[name] = "1"
