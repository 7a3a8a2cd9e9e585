"""Spoiled files of every kind are read, or refused in words, whoever reads them."""

from collections import Counter
from pathlib import Path

import pytest
from benchmarks.hostile_files import MOST_SECONDS, Sample, samples, spoiled

N_FILES = 5000
FIRST = 1_000_000  # other ones than the benchmark's


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> list[Sample]:
    return samples(tmp_path_factory.mktemp("good"))


def test_good_files_are_read(good: list[Sample], tmp_path: Path) -> None:
    for sample in good:
        path = tmp_path / sample.name
        path.write_bytes(sample.data)
        sample.read(path)


@pytest.mark.slow
def test_a_spoiled_file_is_read_or_refused_in_words_and_soon(
    good: list[Sample], tmp_path: Path
) -> None:
    endings = [spoiled(good, tmp_path, seed) for seed in range(FIRST, FIRST + N_FILES)]

    assert [e for e in endings if not e.is_right or e.seconds > MOST_SECONDS] == []
    counts = Counter(ending.outcome for ending in endings)
    assert min(counts["read"], counts["refused"]) > N_FILES / 10
