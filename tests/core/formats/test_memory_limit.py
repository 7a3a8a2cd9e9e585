"""A process gets no more memory than it is allowed."""

import subprocess
import sys

import pytest

LIMITED = """
from lightpen.formats.video_process import limit_memory
limit_memory(100_000_000)
block = bytearray(50_000_000)
try:
    block = bytearray(150_000_000)
except MemoryError:
    print("refused")
"""


@pytest.mark.skipif(sys.platform != "linux", reason="knows no limit")
def test_no_more_memory_than_is_allowed_is_had() -> None:
    done = subprocess.run(
        [sys.executable, "-c", LIMITED], capture_output=True, text=True, check=False
    )

    assert done.stdout.strip() == "refused", done.stderr
