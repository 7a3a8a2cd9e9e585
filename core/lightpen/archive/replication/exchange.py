"""Exchange of entries: with a server, and by files between stations.

Whichever way they go, they are copied chain by chain in their order, and what is there
already is passed over: a copy that was cut off is simply made again.

An exported archive is text. Its first line names the format, and each of the others
holds one entry with its record, but for the last: it says how many entries there are,
and the checksum of all lines before it.
"""

import json
import os
from collections.abc import Iterator
from hashlib import sha256
from itertools import groupby, islice
from pathlib import Path
from typing import BinaryIO

from msgspec import Struct

from lightpen.archive.chains.chains import (
    BATCH,
    batch_of,
    chain_head,
    entries_of,
    heads,
    note_delivered,
    records_of,
)
from lightpen.archive.chains.entries import StoredEntry, read_entry
from lightpen.archive.chains.growth import CopyResult, copy_entries
from lightpen.archive.replication.comparison import require_continued
from lightpen.archive.store.database import Database
from lightpen.errors import FileError, NameTakenError
from lightpen.formats.files import MEGABYTE, opened
from lightpen.formats.own_json import DamagedError, parse_own_json
from lightpen.formats.system_reasons import strerror
from lightpen.messages import message

FORMAT = 1
WHAT = message("file.exported-archive")
DELIVERED = 20  # entries at one time: some MB, which a slow line carries in time
LIMIT = 10**6 * MEGABYTE  # it is read line by line
LONGEST_LINE = 10 * MEGABYTE  # an entry with its record; 2000 images take some 4
LARGEST_BATCH = 16 * MEGABYTE  # of texts that are copied in one transaction


class _FirstLine(Struct):
    lightpen_archive: int


class _EntryLine(Struct):
    entry: str
    signature: str = ""
    record: str | None = None


class _LastLine(Struct):
    n_entries: int
    sha256: str


def deliver(database: Database, chain: str, server: Database) -> CopyResult:
    """Copy the entries of a chain that a server lacks.

    Raises `ArchiveError` if it does not answer, is ahead of this chain, or holds other
    entries of it.
    """
    require_continued(database, chain, server)
    known = chain_head(server, chain).number
    n_new, last = 0, max(0, known - 1)  # the last that it has is compared
    while batch := batch_of(database, chain, last)[:DELIVERED]:
        n_new += copy_entries(server, chain, batch, records_of(database, batch)).n_new
        last = batch[-1].entry.number
        note_delivered(database, chain, last)
    return CopyResult(n_new, known)


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


def import_entries(database: Database, path: Path) -> CopyResult:
    """Copy the entries of an exported archive into another; known ones are passed.

    Raises `ArchiveError` if that holds other entries of one of the chains.
    """
    for _ in _read(path):  # all of it, before any of it is kept
        pass
    n_new = n_known = 0
    for chain, found in groupby(_read(path), lambda each: each[0].entry.chain):
        while batch := list(_few(found)):
            records = {
                entry.entry.event.record_sha256 or "": record or ""
                for entry, record in batch
            }
            entries = [entry for entry, _ in batch]
            copied = copy_entries(database, chain, entries, records)
            n_new, n_known = n_new + copied.n_new, n_known + copied.n_known
    return CopyResult(n_new, n_known)


def _few(
    found: Iterator[tuple[StoredEntry, str | None]],
) -> Iterator[tuple[StoredEntry, str | None]]:
    """Yield entries for one transaction, so few that they take little memory."""
    size = 0
    for entry, record in islice(found, BATCH):
        yield entry, record
        size += len(entry.text) + len(record or "")
        if size > LARGEST_BATCH:
            return


def _next_line(stream: BinaryIO) -> bytes:
    line = stream.readline(LONGEST_LINE + 1)
    if len(line) > LONGEST_LINE:
        raise DamagedError("A line is too long.")
    return line


def _require_text(text: str) -> None:
    """Refuse half of a character, which no database can hold."""
    try:
        text.encode("utf-8", "surrogateescape")
    except UnicodeEncodeError as error:
        raise DamagedError(str(error)) from error


def _contents(database: Database) -> Iterator[dict[str, object]]:
    yield {"lightpen_archive": FORMAT}
    for head in heads(database):
        for entry in entries_of(database, head.chain):
            name = entry.entry.event.record_sha256
            records = records_of(database, [entry])
            yield {
                "entry": entry.text,
                "signature": entry.signature,
                "record": None if name is None else records.get(name),
            }


def _line(content: object) -> bytes:
    return json.dumps(content).encode() + b"\n"


def _read(path: Path) -> Iterator[tuple[StoredEntry, str | None]]:
    """Yield the entries of an exported archive, each with its record."""
    n_read = 0
    with opened(path, WHAT, LIMIT) as stream:
        try:
            first = _next_line(stream)
            if parse_own_json(first, _FirstLine).lightpen_archive != FORMAT:
                raise DamagedError("It is of another version.")
            checksum = sha256(first)
            while line := _next_line(stream):
                if line.startswith(b'{"n_entries"'):
                    if parse_own_json(line, _LastLine) != _LastLine(
                        n_read, checksum.hexdigest()
                    ):
                        raise DamagedError("Lines are missing or changed.")
                    return
                found = parse_own_json(line, _EntryLine)
                if found.record is not None:
                    _require_text(found.record)
                yield read_entry(found.entry, found.signature), found.record
                checksum.update(line)
                n_read += 1
            raise DamagedError("Its end is missing.")
        except DamagedError as error:
            raise FileError("archive.no-export", file=path, line=n_read + 2) from error
