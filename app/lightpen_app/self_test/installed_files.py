"""Whether the files of an installed program are as they were built.

The installer puts a list of checksums beside the program, as ``sha256sum`` writes it.
A program that was installed otherwise has none, and nothing is checked.
"""

import sys
from hashlib import sha256
from pathlib import Path

FILE_LIST = "files.sha256"


def file_list() -> Path:
    """Return where the list is if the program was installed by its installer."""
    return Path(sys.prefix).parent / FILE_LIST


def damaged_files(files: Path) -> tuple[str, ...]:
    """Return the files of a list that are missing, or not as they were built."""
    lines = files.read_text(encoding="utf-8").splitlines()
    entries = [line.split("  ", maxsplit=1) for line in lines]
    return tuple(
        name for digest, name in entries if _digest(files.parent / name) != digest
    )


def _digest(path: Path) -> str:
    try:
        return sha256(path.read_bytes()).hexdigest()
    except OSError:
        return "unreadable"
