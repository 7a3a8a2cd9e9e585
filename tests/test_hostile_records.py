"""Damaged results, records and settings are named; nothing that is killed is lost.

The same trials as those of the benchmark's section `hostile`, in small.
"""

import os
from collections.abc import Iterator

import pytest
from benchmarks.hostile_kills import CHECKS, Victim, killed, start_victim
from benchmarks.hostile_records import Data, foreign_errors, make_data, unnamed_flips

N_FLIPS, N_MUTATIONS, N_KILLS = 150, 600, 5


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Data:
    return make_data(tmp_path_factory.mktemp("hostile"))


@pytest.mark.slow
def test_every_flipped_bit_is_named_by_the_file_that_it_is_in(data: Data) -> None:
    assert unnamed_flips(data, N_FLIPS) == (0, 0)


@pytest.mark.slow
def test_damaged_files_end_in_the_errors_of_the_program_alone(data: Data) -> None:
    assert foreign_errors(data, N_MUTATIONS) == []


@pytest.fixture(scope="module")
def victim() -> Iterator[Victim]:
    with start_victim() as process:
        yield process


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs processes that fork")
@pytest.mark.parametrize("kind", CHECKS)
def test_a_killed_write_loses_nothing_and_leaves_nothing(
    kind: str, victim: Victim
) -> None:
    outcome = killed(victim, kind, N_KILLS)

    assert outcome.n_sound == N_KILLS
    assert outcome.n_left == 0
