"""Tests of the workers: processes here, and a real Dask cluster."""

import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from lightpen.errors import Cancelled, UsageError
from lightpen.estimation.statistics.workers import cluster_workers, local_workers

NO_CLUSTER = "needs the extra cluster, which the Windows installer leaves out"


def square(number: int) -> int:
    return number * number


def touch_file(place: str) -> None:
    Path(place).touch()
    time.sleep(0.1)


@pytest.fixture(scope="module")
def scheduler() -> Iterator[str]:
    """Return the address of a cluster of two processes on this machine."""
    distributed: Any = pytest.importorskip("distributed", reason=NO_CLUSTER)
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=None
    ) as cluster:
        yield cluster.scheduler_address


def test_processes_return_what_they_made_in_order_and_tell_how_far_they_are() -> None:
    reported: list[float] = []

    with local_workers(2) as in_workers:
        found = in_workers(square, range(5), reported.append)

    assert found == [0, 1, 4, 9, 16]
    assert reported == pytest.approx([0.2, 0.4, 0.6, 0.8, 1.0])


def test_a_computation_that_is_cancelled_ends_and_begins_no_more(
    tmp_path: Path,
) -> None:
    def cancel(fraction: float) -> None:
        raise Cancelled

    places = [str(tmp_path / str(i)) for i in range(200)]
    with pytest.raises(Cancelled), local_workers(1) as in_workers:
        in_workers(touch_file, places, cancel)

    assert len(list(tmp_path.iterdir())) < len(places)


def test_a_dask_cluster_does_the_same(scheduler: str) -> None:
    reported: list[float] = []

    with cluster_workers(scheduler) as in_workers:
        found = in_workers(square, range(5), reported.append)

    assert found == [0, 1, 4, 9, 16]
    assert reported[-1] == 1.0


@pytest.mark.slow
def test_a_scheduler_that_does_not_answer_is_reported(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    pytest.importorskip("distributed", reason=NO_CLUSTER)
    monkeypatch.setattr("lightpen.estimation.statistics.workers.CONNECTING", 0.5)

    with (
        pytest.raises(UsageError, match="No Dask scheduler responds at "),
        cluster_workers("tcp://127.0.0.1:9"),
    ):
        pass
