"""Delivery of entries to a server, and their export to a file.

Entries are delivered in their order, and what is there already is passed over: a
delivery that was cut off is simply made again.

An exported archive is text. Its first line names the format, and each of the others
holds one entry with its record, but for the last: it says how many entries there are,
and the checksum of all lines before it.
"""

import json
import os
from collections.abc import Iterator
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

from lightpen.archive.chains.chains import (
    batch_of,
    chain_head,
    chain_names,
    entries_of,
    records_of,
)
from lightpen.archive.chains.growth import copy_entries
from lightpen.archive.replication.comparison import require_same
from lightpen.archive.store.database import Database
from lightpen.errors import FileError, NameTakenError
from lightpen.formats.system_reasons import strerror

FORMAT = 1
DELIVERED = 20  # entries at one time: some MB, which a slow line carries in time


@dataclass(frozen=True)
class Delivery:
    """Numbers of entries that a server got now, and had before."""

    n_new: int
    n_known: int


def deliver(database: Database, chain: str, server: Database) -> Delivery:
    """Copy the entries of a chain that a server lacks.

    Raises `ArchiveError` if it does not answer, is ahead of this chain, or holds other
    entries of it.
    """
    require_same(database, chain, server)
    known = last = chain_head(server, chain).number
    n_new = 0
    while batch := batch_of(database, chain, last)[:DELIVERED]:
        n_new += copy_entries(server, chain, batch, records_of(database, batch))
        last = batch[-1].entry.number
    return Delivery(n_new, known)


def export_entries(database: Database, path: Path) -> int:
    """Write all entries of an archive to a new file; return their number."""
    n_entries, checksum = 0, sha256()
    try:
        with path.open("xb") as stream:
            for content in _contents(database):
                line = _line(content)
                stream.write(line)
                checksum.update(line)
                n_entries += "entry" in content
            end = {"n_entries": n_entries, "sha256": checksum.hexdigest()}
            stream.write(_line(end))
            stream.flush()
            os.fsync(stream.fileno())
    except FileExistsError as error:
        raise NameTakenError("archive.export-exists", file=path) from error
    except OSError as error:
        raise FileError(
            "archive.not-exported", file=path, reason=strerror(error)
        ) from error
    return n_entries


def _contents(database: Database) -> Iterator[dict[str, object]]:
    yield {"lightpen_archive": FORMAT}
    for chain in chain_names(database):
        for entry in entries_of(database, chain):
            name = entry.entry.event.record_sha256
            records = records_of(database, [entry])
            yield {
                "entry": entry.text,
                "signature": entry.signature,
                "record": None if name is None else records.get(name),
            }


def _line(content: object) -> bytes:
    return json.dumps(content).encode() + b"\n"
