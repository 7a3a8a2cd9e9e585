"""Comparison of a chain with its copy on a server.

Long chains are compared by one hash for each block of entries, so that little travels;
only of a block that differs the entries are compared, each by its hash.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from hashlib import sha256

from sqlalchemy import select, text

from lightpen.archive.chains.chains import chain_at_home, chain_head, delivered_number
from lightpen.archive.chains.entries import SHORT
from lightpen.archive.checks.check import check_archive
from lightpen.archive.store.database import Database
from lightpen.archive.store.tables import ENTRIES
from lightpen.errors import ArchiveError
from lightpen.messages import Message, message

BLOCK = 1000  # entries
_BLOCKS = text("""\
SELECT (number - 1) / :size AS block, encode(sha256(convert_to(
    string_agg(number || ' ' || sha256 || ';', '' ORDER BY number), 'UTF8')), 'hex')
    AS hash
FROM archive_entries WHERE chain = :chain AND number BETWEEN 1 AND :end
GROUP BY block""")


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


def require_continued(database: Database, chain: str, server: Database) -> None:
    """Refuse a server whose last entry of the own chain is not where it should be."""
    head = chain_head(server, chain)
    here = _hashes(database, chain, head.number - 1, head.number)
    is_same = head.number == 0 or here == [(head.number, head.sha256)]
    if not is_same or head.number < delivered_number(database, chain):
        require_same(database, chain, server)


def require_same(database: Database, chain: str, server: Database) -> None:
    """Refuse a server that is ahead of the own chain, lost some of it or differs."""
    for each in _findings(database, chain, server):
        raise ArchiveError(each)


def first_difference(
    database: Database, chain: str, server: Database, end: int
) -> int | None:
    """Return the number of the first entry, up to one, in which both sides differ."""
    pairs = zip(
        *(_block_hashes(each, chain, end) for each in (database, server)), strict=False
    )
    for block, (one, other) in enumerate(pairs):
        if one != other:
            first = block * BLOCK
            here, there = (
                dict(_hashes(each, chain, first, first + BLOCK))
                for each in (database, server)
            )
            return min(n for n in here | there if here.get(n) != there.get(n))
    return None


def _findings(database: Database, chain: str, server: Database) -> Iterator[Message]:
    here, there = (chain_head(each, chain).number for each in (database, server))
    different = first_difference(database, chain, server, min(here, there))
    if different is not None:
        yield message("archive.server-differs", number=different, chain=chain[:SHORT])
    if different is None and there > here:
        yield message("archive.server-ahead", here=here, there=there)
    delivered = delivered_number(database, chain)
    if there < delivered:
        yield message("archive.server-lost", first=there + 1, last=delivered)


def _block_hashes(database: Database, chain: str, end: int) -> list[str]:
    """Return a hash of each block of entries up to a number, in their order."""
    n_blocks = -(-end // BLOCK)
    if database.file is not None:
        hashes = [sha256() for _ in range(n_blocks)]
        for number, digest in _hashes(database, chain, 0, end):
            hashes[(number - 1) // BLOCK].update(f"{number} {digest};".encode())
        return [each.hexdigest() for each in hashes]
    wanted = {"size": BLOCK, "chain": chain, "end": end}
    found = {row.block: row.hash for row in database.rows(_BLOCKS, wanted)}
    return [found.get(n, sha256().hexdigest()) for n in range(n_blocks)]


def _hashes(
    database: Database, chain: str, after: int, end: int
) -> list[tuple[int, str]]:
    wanted = (
        select(ENTRIES.c.number, ENTRIES.c.sha256)
        .where(ENTRIES.c.chain == chain, ENTRIES.c.number.between(after + 1, end))
        .order_by(ENTRIES.c.number)
    )
    return [(row.number, row.sha256) for row in database.rows(wanted)]
