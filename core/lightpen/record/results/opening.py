"""Opening a swing from outside the program, by any file that belongs to it.

A record is a folder, and no system opens a folder with a program of its own choice: in
each lies a small file whose name does. A result leads to the swing that it comes from.
"""

from pathlib import Path

from lightpen.errors import FileError
from lightpen.record.results.result_folder import RESULTS, SIMULATED, FolderArchive
from lightpen.record.swings.reading import is_record


def swing_folder(path: Path) -> Path:
    """Return the folder of a swing by itself, a file in it, or a result.

    Raises `FileError` if the path leads to no swing.
    """
    place = path.absolute()
    for folder in (place, place.parent):
        if is_record(folder):
            return folder
    data = data_folder_of(place)
    if data is not None:
        recorded = FolderArchive(data).read(place).record
        if is_record(recorded):
            return recorded
        raise FileError("opening.swing-moved", file=path, folder=recorded)
    raise FileError("opening.no-swing", path=path)


def data_folder_of(result: Path) -> Path | None:
    """Return the data folder that a file is a result of; None if it is in none."""
    place = result.absolute()
    if place.parent.name != RESULTS or place.suffix != ".json":
        return None
    return place.parents[2 if place.parents[1].name == SIMULATED else 1]
