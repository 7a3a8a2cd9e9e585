"""Computations in worker processes of this machine or of a Dask cluster."""

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from importlib import import_module
from multiprocessing import get_context
from typing import Any, Protocol, TypeVar

from lightpen.errors import UsageError

ONE_THREAD = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
CONNECTING = 10  # s

T = TypeVar("T")
S = TypeVar("S")
Report = Callable[[float], None]


class Map(Protocol):
    """Does something to all items, wherever that is."""

    def __call__(
        self, function: Callable[[S], T], items: Sequence[S], report: Report
    ) -> list[T]:
        """Return the results of the function for all items, in order.

        ``report`` is called with the fraction done; an exception from it ends the
        computation, and pending items are dropped.
        """


@contextmanager
def local_workers(n_workers: int | None = None) -> Iterator[Map]:
    """Open worker processes on this machine, by default one a core."""
    context = get_context("spawn")  # a fork would copy threads that hold locks
    with ProcessPoolExecutor(
        n_workers or os.cpu_count() or 1, context, initializer=_use_one_thread
    ) as executor:

        def mapped(
            function: Callable[[S], T], items: Sequence[S], report: Report
        ) -> list[T]:
            futures = [executor.submit(function, item) for item in items]
            return _gathered(futures, as_completed(futures), report)

        yield mapped


@contextmanager
def cluster_workers(address: str) -> Iterator[Map]:
    """Open the workers of a Dask cluster by the address of its scheduler.

    Raises `UsageError` if Dask is not installed, or no scheduler answers there.
    """
    try:
        distributed: Any = import_module("distributed")
    except ImportError as error:
        raise UsageError("workers.no-dask") from error
    try:
        client = distributed.Client(address, timeout=CONNECTING)
    except (OSError, ValueError) as error:
        raise UsageError("workers.no-scheduler", address=address) from error
    with client:

        def mapped(
            function: Callable[[S], T], items: Sequence[S], report: Report
        ) -> list[T]:
            futures = client.map(function, list(items), pure=False)
            return _gathered(futures, distributed.as_completed(futures), report)

        yield mapped


def _gathered(
    futures: Sequence[Any], ended: Iterator[Any], report: Report
) -> list[Any]:
    """Return the results of futures in order, with progress."""
    try:
        for n_done, _ in enumerate(ended, 1):
            report(n_done / len(futures))
        return [future.result() for future in futures]
    except BaseException:
        for future in futures:
            future.cancel()
        raise


def _use_one_thread() -> None:
    """Let each process keep to its core."""
    for name in ONE_THREAD:
        os.environ[name] = "1"
