"""Tests of the worker processes."""

import time
from pathlib import Path

import pytest

from lightpen.errors import Cancelled
from lightpen_extensions.comparisons.monte_carlo import local_workers


def square(number: int) -> int:
    return number * number


def touch_file(place: str) -> None:
    Path(place).touch()
    time.sleep(0.1)


@pytest.mark.slow
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
