"""What a build downloads, each file checked by its hash, kept in the user's cache."""

import os
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


SOURCE = ("--no-binary", ":all:")
WITHOUT_WHEELS = {"crcmod"}


def download_runtime() -> Path:
    """Return the distribution that holds the Windows runtime."""
    return _downloaded([runtime.REQUIREMENT], "runtime", SOURCE)[0]


def download_wheels(pins: Iterable[Pin]) -> list[Path]:
    """Return the wheels for 64-bit Windows, in the order of their names.

    Those that have none are built: they are of Python alone where no compiler is found.
    """
    wanted = list(pins)
    lines = [pin.line() for pin in wanted if pin.name not in WITHOUT_WHEELS]
    sources = [pin.line() for pin in wanted if pin.name in WITHOUT_WHEELS]
    wheels = _downloaded(lines, "wheels", WINDOWS)
    if sources:
        wheels += [_built(source) for source in _downloaded(sources, "sources", SOURCE)]
    return sorted(wheels, key=lambda path: path.name)


def _built(source: Path) -> Path:
    """Return the wheel of a source distribution, beside it, without compiled parts."""
    folder = source.with_suffix(".wheel")
    if not any(folder.glob("*.whl")):
        words = ["wheel", "--quiet", "--no-deps", "--no-cache-dir"]
        subprocess.run(
            [*PIP, *words, "--wheel-dir", folder, source],
            env=os.environ | {"CC": "false"},
            check=True,
        )
    (wheel,) = folder.glob("*.whl")
    return wheel


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
    found = (path for path in folder.iterdir() if path.is_file())
    return sorted(path for path in found if path.suffix != ".txt")
