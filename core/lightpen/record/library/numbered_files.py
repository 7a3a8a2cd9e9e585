"""A folder of JSON files that are written once, each named by its number in order.

A file's number is one higher than that of any before, an order that no clock that was
set back can turn round. Of two programs that take the same number one gets it, and the
other the next.
"""

from contextlib import suppress
from itertools import count
from pathlib import Path

from lightpen.errors import FileError, NameTakenError
from lightpen.formats.files import (
    FOLDER,
    create_whole,
    printable,
    sync_folder,
    unreadable,
)
from lightpen.formats.system_reasons import strerror


def add_numbered(folder: Path, data: bytes) -> Path:
    """Add a file, the newest of all, and return it.

    When this returns, it is kept whatever happens next; when it raises, or is killed,
    it is kept whole or not at all.

    Raises
    ------
    FileError
        It cannot be written.
    """
    make_folder(folder)
    newest = numbered_files(folder)[:1]
    for free in count(1 + (_number(newest[0]) if newest else 0)):
        file = folder / f"{free:06d}.json"
        with suppress(NameTakenError):  # by another program, just now
            create_whole(file, data)
            break
    return file


def make_folder(folder: Path) -> None:
    """Create a folder and its parents.

    Raises
    ------
    FileError
        It cannot be made.
    """
    try:
        new = [each for each in folder.parents if not each.exists()]
        folder.mkdir(parents=True, exist_ok=True)
        for each in (folder, *new):
            sync_folder(each.parent)
    except OSError as error:
        raise FileError(
            "results.no-folder", folder=printable(str(folder)), reason=strerror(error)
        ) from error


def numbered_files(folder: Path) -> list[Path]:
    """Return the files, the newest first; others are left alone.

    Raises
    ------
    FileError
        The folder cannot be read.
    """
    try:
        paths = list(folder.iterdir()) if folder.is_dir() else []
    except OSError as error:
        raise unreadable(folder, FOLDER, error) from error
    files = [path for path in paths if path.suffix == ".json" and _number(path)]
    return sorted(files, key=lambda file: (_number(file), file.name), reverse=True)


def _number(file: Path) -> int:
    """Return the place of a file in the order; 0 for a foreign file."""
    return int(file.stem) if file.stem.isdecimal() else 0
