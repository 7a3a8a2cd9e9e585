"""Memory of freed images is kept for the next ones, until it is released."""

import subprocess
import sys

import pytest

# The allocator keeps its settings, so a process of its own.
FREED = """
from pathlib import Path
import numpy as np
from lightpen.formats.decoding import keep_freed_memory, release_freed_memory

def memory_mb():
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * 4096 / 2**20

keep_freed_memory()
images = [np.ones(5_000_000, np.uint8) for _ in range(20)]
last = np.ones(1_000_000, np.uint8)  # in use, above all that is freed
before = memory_mb()
images.clear()
kept = memory_mb()
release_freed_memory()
print(before - kept, before - memory_mb())
"""


@pytest.mark.skipif(sys.platform != "linux", reason="the allocator of glibc")
def test_freed_memory_is_kept_until_it_is_released() -> None:
    done = subprocess.run(
        [sys.executable, "-c", FREED], capture_output=True, text=True, check=True
    )
    at_once, released = map(float, done.stdout.split())
    assert at_once < 10
    assert released > 80  # of 95 MB
