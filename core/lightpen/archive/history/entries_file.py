"""All entries of an archive in a file.

An exported archive is text. Its first line names the format, and each of the others
holds one entry with its record, but for the last: it says how many entries there are,
and the checksum of all lines before it.
"""

import json
import os
from collections.abc import Iterator
from hashlib import sha256
from pathlib import Path

from lightpen.archive.chains.chains import chain_names, entries_of, records_of
from lightpen.archive.store.database import Database
from lightpen.errors import FileError, NameTakenError
from lightpen.formats.system_reasons import strerror

FORMAT = 1


def export_entries(database: Database, path: Path) -> int:
    """Write all entries of an archive to a new file; return their number."""
    n_entries, checksum = 0, sha256()
    try:
        with path.open("xb") as stream:
            for content in _contents(database):
                line = _entry_line(content)
                stream.write(line)
                checksum.update(line)
                n_entries += "entry" in content
            end = {"n_entries": n_entries, "sha256": checksum.hexdigest()}
            stream.write(_entry_line(end))
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


def _entry_line(content: object) -> bytes:
    return json.dumps(content).encode() + b"\n"
