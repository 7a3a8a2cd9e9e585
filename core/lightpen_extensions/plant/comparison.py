"""Comparison of a chain with its copy on a server.

Each entry contains the hash of the one before: where one is the same on both sides, so
are all before it.
"""

from bisect import bisect_left
from collections.abc import Iterator
from dataclasses import dataclass

from lightpen.archive.chains.chains import chain_at_home, chain_head, hash_in
from lightpen.archive.chains.entries import SHORT
from lightpen.archive.checks.check import check_archive
from lightpen.archive.store.database import Database
from lightpen.errors import ArchiveError
from lightpen.messages import Message, message


@dataclass(frozen=True)
class ServerCheckResult:
    """Entries on a server, all examined, those not delivered yet, and discrepancies."""

    n_entries: int
    n_waiting: int
    findings: tuple[Message, ...]


def check_server(database: Database, server: Database) -> ServerCheckResult:
    """Check every entry and record on a server, and compare both sides.

    A server may show a station its own chain alone.
    """
    checked = check_archive(server)
    home = chain_at_home(database) or ""
    here, there = (chain_head(each, home).number for each in (database, server))
    found = [message("archive.on-server", finding=each) for each in checked.findings]
    return ServerCheckResult(
        n_entries=checked.n_entries,
        n_waiting=max(0, here - there),
        findings=(*found, *_findings(database, home, server)),
    )


def require_same(database: Database, chain: str, server: Database) -> None:
    """Refuse a server that is ahead of the own chain or differs."""
    for each in _findings(database, chain, server):
        raise ArchiveError(each)


def first_difference(
    database: Database, chain: str, server: Database, end: int
) -> int | None:
    """Return the number of the first entry, up to one, in which both sides differ."""

    def differs(number: int) -> bool:
        with database.reading() as here, server.reading() as there:
            return hash_in(here, chain, number) != hash_in(there, chain, number)

    if end == 0 or not differs(end):
        return None
    return 1 + bisect_left(range(1, end), True, key=differs)


def _findings(database: Database, chain: str, server: Database) -> Iterator[Message]:
    here, there = (chain_head(each, chain).number for each in (database, server))
    different = first_difference(database, chain, server, min(here, there))
    if different is not None:
        yield message("archive.server-differs", number=different, chain=chain[:SHORT])
    elif there > here:
        yield message("archive.server-ahead", here=here, there=there)
