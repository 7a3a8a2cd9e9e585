"""Restores a data folder from the server: the entries of its chain, and their files.

An entry of a result, a verification, a camera calibration or a change of the library
has the file that states it, so that these are made again byte by byte. Swings and
their images are on no server; limits may have the hash of a password, and are set
again.
"""

from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from lightpen.archive.chains.chains import (
    batch_of,
    chain_at_home,
    chain_head,
    chain_names,
    entries_of,
    records_of,
)
from lightpen.archive.chains.entries import SHORT, StoredEntry
from lightpen.archive.chains.growth import copy_entries
from lightpen.archive.store.database import Database
from lightpen.errors import ArchiveError, NameTakenError
from lightpen.formats.files import create_whole
from lightpen.messages import message
from lightpen.record.library.numbered_files import make_folder, reserve_number
from lightpen_extensions.plant.comparison import first_difference

_UNSAFE = {"..", "."}


@dataclass(frozen=True)
class FetchResult:
    """Result of fetching."""

    n_entries: int
    n_files: int  # that were missing
    lost: tuple[str, ...]  # files of entries that are neither here nor on the server


def fetch(
    database: Database, data: Path, server: Database, chain: str = ""
) -> FetchResult:
    """Add the entries that a data folder lacks from its chain on a server, with files.

    ``chain`` is the start of the name of the chain of a folder that has none yet; not
    needed where the server shows one alone. Raises `ArchiveError` if the server has no
    such chain, or other entries than those that are here.
    """
    home = chain_at_home(database)
    if home is None or chain_head(database, home).number == 0:
        home = _chosen(server, chain)
    n_here, n_there = (chain_head(each, home).number for each in (database, server))
    if n_there == 0:
        raise ArchiveError("archive.nothing-to-fetch", name=server.name)
    number = first_difference(database, home, server, min(n_here, n_there))
    if number is not None:
        raise ArchiveError("archive.server-differs", number=number, chain=home[:SHORT])
    last = n_here
    while batch := batch_of(server, home, last):
        copy_entries(database, home, batch, records_of(server, batch))
        last = batch[-1].entry.number
    n_files, lost = _restore_files(database, data, home)
    return FetchResult(last - n_here, n_files, lost)


def _chosen(server: Database, start: str) -> str:
    """Return the chain of a server that is meant."""
    found = [chain for chain in chain_names(server) if chain.startswith(start)]
    if not found:
        raise ArchiveError("archive.nothing-to-fetch", name=server.name)
    if len(found) > 1:
        names = (_named(server, chain) for chain in found)
        raise ArchiveError("archive.which-chain", chains=", ".join(names))
    return found[0]


def _named(server: Database, chain: str) -> str:
    (last,) = batch_of(server, chain, chain_head(server, chain).number - 1)
    return f"{chain[:SHORT]} ({last.entry.event.names.station or '-'})"


def _restore_files(
    database: Database, data: Path, chain: str
) -> tuple[int, tuple[str, ...]]:
    """Write the files that are missing; return how many, and which are lost."""
    n_files, lost = 0, []
    for entry in entries_of(database, chain):
        file = _missing_file(entry, data)
        if file is None:
            continue
        content = _content(database, entry)
        if content is None:
            reserve_number(file)
            lost.append(file.relative_to(data).as_posix())
            continue
        make_folder(file.parent)
        try:
            create_whole(file, content)
        except NameTakenError:  # by another program, just now
            continue
        n_files += 1
    return n_files, tuple(lost)


def _missing_file(entry: StoredEntry, data: Path) -> Path | None:
    """Return the file that states an entry, if it is of this folder and missing."""
    result = entry.entry.event.result
    if result is None:
        return None
    place = PurePosixPath(result.place)
    if place.is_absolute() or _UNSAFE & set(place.parts) or place.suffix != ".json":
        raise ArchiveError(
            "archive.fetched-damaged",
            finding=message(
                "archive.vouched-missing", file=str(place), number=entry.entry.number
            ),
        )
    file = data / place
    return None if file.exists() else file


def _content(database: Database, entry: StoredEntry) -> bytes | None:
    event = entry.entry.event
    if event.result is None or event.record_sha256 != event.result.sha256:
        return None
    text = records_of(database, [entry]).get(event.record_sha256)
    return None if text is None else text.encode("utf-8", "surrogateescape")
