"""Run `lightpen` with the arguments given; then print the peak memory, MB (Linux)."""

import sys
from pathlib import Path

from lightpen_program.extensions import main


def peak_memory() -> float:
    """Return the most memory that this process held at once, MB."""
    status = Path("/proc/self/status").read_text(encoding="ascii")
    line = next(line for line in status.splitlines() if line.startswith("VmHWM:"))
    return int(line.split()[1]) / 1e3  # kB


if __name__ == "__main__":
    exit_status = main()
    if sys.platform == "linux":
        print(peak_memory())
    sys.exit(exit_status)
