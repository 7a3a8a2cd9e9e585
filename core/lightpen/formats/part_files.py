"""Temporary files for atomic writes, and their clean-up.

A part is locked as long as it is written, so that one whose lock can be had was left
behind by a program that was killed. Windows cannot rename open files, and some disks
support no locks: there a leftover is recognised by its age.
"""

import contextlib
import os
import re
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import IO

from lightpen.formats.file_locks import PAUSE, locked

PATIENCE = 2.0  # s to wait for a clean-up in another process
LONGEST_WRITE = 60.0  # s, after which a part that cannot be locked is taken as left
_NAME = re.compile(r"\.[0-9a-f]{16}\.part")


@contextlib.contextmanager
def part_of(target: Path, data: bytes, mode: int = 0o666) -> Iterator[Path]:
    """Write data to a temporary file beside its target, of a mode as of `os.open`."""
    part, stream = _own_part(target.parent, mode)
    try:
        with stream:
            stream.write(data)
            stream.flush()
            os.fsync(stream.fileno())
            if os.name != "posix":
                stream.close()
            yield part
    finally:
        with contextlib.suppress(OSError):
            part.unlink(missing_ok=True)


def renamed(rename: Callable[[Path], object], target: Path) -> None:
    """Rename a temporary file; on Windows, retry while it is open elsewhere.

    Scanners for viruses open what was just written, others the file that is replaced,
    and both keep Windows from renaming.
    """
    deadline = time.monotonic() + PATIENCE
    while True:
        try:
            rename(target)
        except PermissionError:
            if os.name != "nt" or time.monotonic() >= deadline:
                raise
            time.sleep(PAUSE)
        else:
            return


def sweep_parts(folder: Path) -> None:
    """Remove temporary files of interrupted writes from a folder, if possible."""
    with contextlib.suppress(OSError):  # they do no harm where they are
        for path in list(folder.iterdir()):
            if _NAME.fullmatch(path.name):
                _sweep(path)


def _own_part(folder: Path, mode: int) -> tuple[Path, IO[bytes]]:
    """Create a temporary file that no clean-up removes."""
    while True:
        part = folder / f".{os.urandom(8).hex()}.part"
        stream = open(part, "xb", opener=partial(os.open, mode=mode))  # noqa: SIM115
        try:
            # A clean-up may have run between creation and lock.
            if locked(stream.fileno(), patience_s=PATIENCE) and part.exists():
                return part, stream
        except OSError:  # a disk without locks
            return part, stream
        stream.close()


def _sweep(part: Path) -> None:
    if os.name == "posix":
        with part.open("rb") as stream, contextlib.suppress(OSError):  # without locks
            if locked(stream.fileno()):
                part.unlink()  # no other process can lock it meanwhile
            return
    if time.time() - part.stat().st_mtime > LONGEST_WRITE:
        part.unlink()
