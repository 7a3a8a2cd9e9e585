"""The seal of an archive's file: its hash, taken when it was closed.

Chains and hashes tell of every entry and record that was changed, but a file of SQLite
has bytes that belong to neither. As long as nothing was entered since, the file must be
as it was sealed, bit by bit.
"""

from pathlib import Path

from msgspec import Struct

from lightpen.archive.chains import heads
from lightpen.archive.database import Database
from lightpen.archive.entries import Head, text_sha256
from lightpen.errors import FileError
from lightpen.estimation.report import json_bytes
from lightpen.formats.files import MEGABYTE, printable, read_bytes, sha256, write_whole
from lightpen.formats.own_json import (
    DamagedError,
    Digest,
    parse_checked,
    with_checksum,
)
from lightpen.sentences import sentence


class Seal(Struct, frozen=True):
    """What a file was when it was closed.

    Attributes
    ----------
    heads : str
        Hash of how far each chain had come.
    sha256 : str
        Of the file.
    """

    heads: Digest
    sha256: Digest


def seal_of(archive: Path) -> Path:
    """Return the file of the seal of an archive."""
    return archive.with_suffix(".seal")


def close_sealed(database: Database) -> None:
    """Close an archive, and seal its file if nobody else has it open.

    Raises
    ------
    ArchiveError, FileError
        It cannot be read any more, or the seal not be written.
    """
    ends = heads(database)
    database.close()
    archive = database.file
    if archive is not None and not Path(f"{archive}-wal").exists():
        seal = {"heads": _told(ends), "sha256": sha256(archive)}
        write_whole(seal_of(archive), with_checksum(json_bytes(seal)))


def is_sealed_otherwise(archive: Path, ends: tuple[Head, ...]) -> bool:
    """Return whether a file is not as it was sealed, though nothing was entered.

    Raises
    ------
    FileError
        The seal is damaged, or one of the files cannot be read.
    """
    path = seal_of(archive)
    if not path.exists() or Path(f"{archive}-wal").exists():
        return False
    data = read_bytes(path, sentence("file.seal", "seal"), MEGABYTE)
    try:
        seal = parse_checked(data, Seal)
    except DamagedError as error:
        raise FileError(
            sentence(
                "archive.seal-damaged",
                "The seal {file} of the archive was changed or damaged.",
                file=printable(str(path)),
            )
        ) from error
    return seal.heads == _told(ends) and seal.sha256 != sha256(archive)


def _told(ends: tuple[Head, ...]) -> str:
    return text_sha256(" ".join(f"{h.chain} {h.number} {h.sha256}" for h in ends))
