"""A process gets no more memory than it is allowed."""

import subprocess
import sys

import pytest

LIMITED = """
import ctypes, sys
from lightpen.formats.video_process import limit_memory
limit_memory(100_000_000)
block = bytearray(50_000_000)
if sys.platform == "win32":
    windows, in_job = ctypes.WinDLL("kernel32"), ctypes.c_int()
    this = ctypes.c_void_p(-1)
    assert windows.IsProcessInJob(this, None, ctypes.byref(in_job)) and in_job.value
    if hasattr(ctypes.WinDLL("ntdll"), "wine_get_version"):
        sys.exit("Wine keeps to no limit.")
try:
    block = bytearray(150_000_000)
except MemoryError:
    print("refused")
"""


@pytest.mark.skipif(sys.platform not in {"linux", "win32"}, reason="knows no limit")
def test_no_more_memory_than_is_allowed_is_had() -> None:
    done = subprocess.run(
        [sys.executable, "-c", LIMITED], capture_output=True, text=True, check=False
    )

    if "Wine" in done.stderr:
        pytest.skip("Wine takes the limit, and keeps to none")
    assert done.stdout.strip() == "refused", done.stderr
