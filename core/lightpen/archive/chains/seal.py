"""The seal of an archive file: its hash and heads at closing.

Chains and hashes tell of every entry and record that was changed, but a file of SQLite
has bytes that belong to neither. As long as nothing was entered since, the file must be
as it was sealed, bit by bit. Regardless of later entries, the archive must still hold
the entries that were last at the sealing: so removed last entries are found, and an
archive replaced by an older copy of itself.
"""

from pathlib import Path
from typing import Annotated

from msgspec import Meta, Struct, to_builtins
from sqlalchemy import select

from lightpen.archive.chains.chains import heads
from lightpen.archive.chains.entries import Chain, ChainHead
from lightpen.archive.store.database import Database, is_open
from lightpen.archive.store.tables import ENTRIES
from lightpen.errors import FileError
from lightpen.formats.files import MEGABYTE, read_bytes, sha256, write_whole
from lightpen.formats.json_records import json_bytes
from lightpen.formats.own_json import DamagedError, Digest, parse_checked, with_checksum
from lightpen.messages import message


class SealedHead(Struct, frozen=True):
    """Number and hash of the last entry of a chain."""

    chain: Chain
    number: Annotated[int, Meta(ge=0)]
    sha256: Digest


class Seal(Struct, frozen=True):
    """State of a file when it was closed."""

    heads: tuple[SealedHead, ...]
    sha256: Digest


def seal_of(archive: Path) -> Path:
    """Return the file of the seal of an archive."""
    return archive.with_suffix(".seal")


def close_sealed(database: Database) -> None:
    """Close an archive, and seal its file unless another process has it open.

    A seal that is damaged, or names entries which the archive does not hold, stays
    as it is, to be found.
    """
    archive = database.file
    try:
        ends = sealed_heads(heads(database))
        is_due = archive is not None and not _seal_disagrees(database, archive)
    finally:
        database.close()
    if archive is None or not is_due or is_open(archive):
        return
    seal = to_builtins(Seal(ends, sha256(archive)))
    write_whole(seal_of(archive), with_checksum(json_bytes(seal)))


def read_seal(archive: Path) -> Seal | None:
    """Return the seal of an archive; None where there is none."""
    path = seal_of(archive)
    if not path.exists():
        return None
    data = read_bytes(path, message("file.seal"), MEGABYTE)
    try:
        return parse_checked(data, Seal)
    except DamagedError as error:
        raise FileError("archive.seal-damaged", file=path) from error


def lost_heads(database: Database, seal: Seal) -> tuple[SealedHead, ...]:
    """Return the sealed last entries that are missing in an archive."""
    with database.reading() as connection:
        return tuple(
            head
            for head in seal.heads
            if head.number
            and connection.execute(
                select(ENTRIES.c.sha256).where(
                    ENTRIES.c.chain == head.chain, ENTRIES.c.number == head.number
                )
            ).scalar_one_or_none()
            != head.sha256
        )


def is_sealed_otherwise(archive: Path, ends: tuple[ChainHead, ...], seal: Seal) -> bool:
    """Return whether a file differs from its seal although nothing was entered."""
    if is_open(archive):
        return False
    return seal.heads == sealed_heads(ends) and seal.sha256 != sha256(archive)


def sealed_heads(ends: tuple[ChainHead, ...]) -> tuple[SealedHead, ...]:
    """Return the heads stored in a seal."""
    return tuple(SealedHead(head.chain, head.number, head.sha256) for head in ends)


def _seal_disagrees(database: Database, archive: Path) -> bool:
    try:
        seal = read_seal(archive)
    except FileError:
        return True
    return seal is not None and bool(lost_heads(database, seal))
