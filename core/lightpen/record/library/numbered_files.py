"""A folder of JSON files that are written once, each named by its number in order.

Numbers increase by one, so the order does not depend on clocks. Of two programs that
try the same number, one gets it and the other the next. An empty ``000007.missing``
reserves the number of a lost file.
"""

from contextlib import suppress
from pathlib import Path

from lightpen.errors import FileError, NameTakenError
from lightpen.formats.files import FOLDER, create_whole, sync_folder, unreadable
from lightpen.formats.system_reasons import strerror

MISSING = ".missing"


def numbered_file(folder: Path, number: int) -> Path:
    """Return the file of a number."""
    return folder / f"{number:06d}.json"


def newest_number(folder: Path) -> int:
    """Return the number of the newest file, lost ones counted; 0 without any."""
    return max(map(number_of, _paths_in(folder)), default=0)


def make_folder(folder: Path) -> None:
    """Create a folder and its parents."""
    try:
        new = [each for each in folder.parents if not each.exists()]
        folder.mkdir(parents=True, exist_ok=True)
        for each in (folder, *new):
            sync_folder(each.parent)
    except OSError as error:
        raise FileError(
            "results.no-folder", folder=folder, reason=strerror(error)
        ) from error


def numbered_files(folder: Path) -> list[Path]:
    """Return the files, the newest first; others are left alone."""
    files = [p for p in _paths_in(folder) if p.suffix == ".json" and number_of(p)]
    return sorted(files, key=lambda file: (number_of(file), file.name), reverse=True)


def reserve_number(lost: Path) -> None:
    """Reserve the number of a lost file."""
    make_folder(lost.parent)
    with suppress(NameTakenError):
        create_whole(lost.with_suffix(MISSING), b"")


def _paths_in(folder: Path) -> list[Path]:
    try:
        paths = list(folder.iterdir()) if folder.is_dir() else []
    except OSError as error:
        raise unreadable(folder, FOLDER, error) from error
    return [path for path in paths if path.suffix in (".json", MISSING)]


def number_of(file: Path) -> int:
    """Return the place of a file in the order; 0 for a foreign file."""
    return int(file.stem) if file.stem.isdecimal() else 0
