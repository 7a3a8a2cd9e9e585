import gc
import os
from collections.abc import Iterator

import pytest

from lightpen_program.__main__ import SEARCH_AFTER, run_program


@pytest.fixture(autouse=True)
def as_before() -> Iterator[None]:
    thresholds = gc.get_threshold()
    yield
    gc.set_threshold(*thresholds)


def test_a_program_runs_with_matrices_on_one_thread_and_garbage_rarely_searched(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.delenv("OPENBLAS_NUM_THREADS", raising=False)
    found: list[object] = []

    def program() -> int:
        found.extend((os.environ["OPENBLAS_NUM_THREADS"], gc.get_threshold()[0]))
        return 2

    assert run_program(program) == 2
    assert found == ["1", SEARCH_AFTER]


def test_threads_asked_for_from_outside_are_left(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "4")

    assert run_program(lambda: int(os.environ["OPENBLAS_NUM_THREADS"])) == 4


def test_what_a_program_leaves_is_not_searched_as_the_process_ends() -> None:
    left: list[object] = []
    left.append(left)

    def program() -> int:
        return int(any(each is left for each in gc.get_objects()))

    assert run_program(program) == 1
    assert not any(each is left for each in gc.get_objects())
