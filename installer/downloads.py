"""What a build downloads, each file checked by its hash, kept in the user's cache."""

import subprocess
import sys
from collections.abc import Iterable
from hashlib import sha256
from pathlib import Path

from installer import runtime
from installer.locked import Pin
from installer.places import cache

PIP = (sys.executable, "-m", "pip", "--disable-pip-version-check")
WINDOWS = (
    *("--only-binary", ":all:", "--platform", "win_amd64"),
    *("--implementation", "cp", "--python-version", runtime.VERSION),
)


def download_runtime() -> Path:
    """Return the distribution that holds the Windows runtime."""
    return _downloaded([runtime.REQUIREMENT], "runtime", ["--no-binary", ":all:"])[0]


def download_wheels(pins: Iterable[Pin]) -> list[Path]:
    """Return the wheels for 64-bit Windows, in the order of their names."""
    return _downloaded([pin.line() for pin in pins], "wheels", WINDOWS)


def _downloaded(lines: list[str], what: str, options: Iterable[str]) -> list[Path]:
    """Return the files of requirements, in a folder that holds nothing else."""
    text = "\n".join([*lines, ""])
    folder = cache() / f"{what}-{sha256(text.encode()).hexdigest()[:16]}"
    done = folder / "requirements.txt"
    if not done.exists():
        part = folder / "requirements.part"
        folder.mkdir(exist_ok=True)
        part.write_text(text, encoding="ascii")
        pip = [*PIP, "download", "--quiet", "--no-deps", "--require-hashes", *options]
        subprocess.run([*pip, "--requirement", part, "--dest", folder], check=True)
        part.replace(done)  # last: an interrupted download is done again
    return sorted(path for path in folder.iterdir() if path.suffix != ".txt")
