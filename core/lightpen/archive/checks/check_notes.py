"""Observations of an archive check that prove no change.

A power cut leaves files that are not entered yet, and a data folder may move to another
computer. Neither proves a change.
"""

from collections.abc import Iterator
from pathlib import Path

from lightpen.archive.chains.chains import chain_at_home, entry_of_result
from lightpen.archive.chains.entries import SHORT
from lightpen.archive.events.station_events import station_files
from lightpen.archive.store.database import Database
from lightpen.messages import Message, message, printable
from lightpen.record.library.signing.account import owed_files, remembered_head
from lightpen.record.library.signing.keys import station_key
from lightpen.record.library.tip_library import library_files
from lightpen.record.results.result_folder import FolderArchive


def check_notes(database: Database, data: Path) -> Iterator[Message]:
    """Yield notes on the archive of a data folder.

    A chain that is not known here, and files without entries.
    """
    home = chain_at_home(database)
    if home is not None:
        yield from _unknown_here(home)
        yield from _not_entered(database, data, home)


def _unknown_here(home: str) -> Iterator[Message]:
    if station_key(home) is None and remembered_head(home) is None:
        yield message("archive.unknown-here", chain=home[:SHORT])


def _not_entered(database: Database, data: Path, home: str) -> Iterator[Message]:
    results = FolderArchive(data)
    files = (*results.all_files(), *library_files(data), *station_files(data))
    owed = {each.place for each in owed_files(home)}
    for file in files:
        place = results.place_of(file)
        if entry_of_result(database, home, place) is not None:
            continue
        if place in owed:
            yield message("archive.file-owed", file=printable(place))
        else:
            yield message("archive.file-not-entered", file=printable(place))
