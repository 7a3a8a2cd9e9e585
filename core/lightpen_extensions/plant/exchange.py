"""Delivery of entries to a server.

Entries are delivered in their order, and what is there already is passed over: a
delivery that was cut off is simply made again.
"""

from dataclasses import dataclass

from lightpen.archive.chains.chains import batch_of, chain_head, records_of
from lightpen.archive.chains.growth import copy_entries
from lightpen.archive.store.database import Database
from lightpen_extensions.plant.comparison import require_same

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
