"""`lightpen calibrate` as a whole: its time against decoding alone, its memory."""

import statistics
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from benchmarks.rows import Row, without_data
from benchmarks.workers import elapsed_ms

HERE = Path(__file__).parent
N_RUNS = 5
RATIO_LIMIT = 1.3
MEMORY_LIMIT = 400.0  # MB
MAX_GROWTH = 50.0  # MB, ten images; more would mean that images are kept
COUNTS = (60, 300, 900)


def program_rows(data: Path | None) -> list[Row]:
    """Return time and memory of the whole program on `swing-full`."""
    names = (
        "`lightpen calibrate` on `swing-full`: time over that of decoding its images",
        f"peak memory of it with {', '.join(map(str, COUNTS))} images",
    )
    if data is None:
        return without_data(*names)
    folder = data / "swing-full"
    return [_time_row(names[0], folder), _memory_row(names[1], folder)]


def _time_row(what: str, folder: Path) -> Row:
    images = folder / "images"
    with tempfile.TemporaryDirectory() as scratch:
        record = Path(scratch) / "record.json"
        calibrate = _calibration(folder, images, "--json", str(record))
        decode = [sys.executable, str(HERE / "decode_images.py"), str(images)]
        _output(calibrate)
        _output(decode)
        calibrating, decoding = [], []
        for _ in range(N_RUNS):
            calibrating.append(elapsed_ms(lambda: _output(calibrate)) / 1e3)
            decoding.append(float(_output(decode)))
    whole, alone = statistics.median(calibrating), statistics.median(decoding)
    ratio = whole / alone
    return Row(
        what,
        f"{ratio:.2f} ({whole:.2f} s over {alone:.2f} s)",
        f"<= {RATIO_LIMIT}",
        met=ratio <= RATIO_LIMIT,
    )


def _memory_row(what: str, folder: Path) -> Row:
    if sys.platform != "linux":
        return Row(what, "needs Linux")
    peaks = [_peak_memory(folder, count) for count in COUNTS]
    met = max(peaks) <= MEMORY_LIMIT and max(peaks) - min(peaks) <= MAX_GROWTH
    return Row(
        what,
        ", ".join(f"{peak:.0f}" for peak in peaks) + " MB",
        f"<= {MEMORY_LIMIT:.0f} MB, equal within {MAX_GROWTH:.0f} MB (ten images)",
        met=met,
    )


def _peak_memory(folder: Path, count: int) -> float:
    """Return the peak memory with so many images, of which some are repeated, MB."""
    images = sorted((folder / "images").iterdir())
    with tempfile.TemporaryDirectory() as scratch:
        for i in range(count):
            link = Path(scratch) / f"frame_{i:04d}.png"
            link.symlink_to(images[i % len(images)])
        command = _calibration(folder, Path(scratch))
        return float(_output(command).splitlines()[-1])


def _calibration(folder: Path, images: Path, *options: str) -> list[str]:
    """Return the command that calibrates and prints its peak memory at the end."""
    files = ["--camera", str(folder / "camera.yaml"), "--pen", str(folder / "leds.csv")]
    script = str(HERE / "calibrate_images.py")
    return [sys.executable, script, "calibrate", str(images), *files, *options]


def _output(command: Sequence[str]) -> str:
    return subprocess.run(
        command, check=True, stdout=subprocess.PIPE, encoding="utf-8"
    ).stdout
