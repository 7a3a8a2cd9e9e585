"""What this extension adds to the program."""

from argparse import ArgumentParser, Namespace
from typing import TYPE_CHECKING

from lightpen.extension import Extension, SubParsers

if TYPE_CHECKING:
    from lightpen.archive.store import Database
    from lightpen.messages import Message
    from lightpen_extensions.plant.server import Replicator


def _check_copy(database: "Database") -> "tuple[tuple[Message, ...], str]":
    # Imported here: it takes 0.2 s.
    from lightpen_extensions.plant.command import checked_copy

    return checked_copy(database)


def _deliver(options: Namespace) -> int:
    from lightpen_extensions.plant.command import deliver_entries

    return deliver_entries(options)


def _fetch(options: Namespace) -> int:
    from lightpen_extensions.plant.command import fetch_entries

    return fetch_entries(options)


def _print_sql(options: Namespace) -> int:
    from lightpen_extensions.plant.command import print_sql

    return print_sql(options)


def _add_archive_actions(actions: SubParsers, check: ArgumentParser) -> None:
    check.add_argument(
        "--server",
        dest="check_copy",
        action="store_const",
        const=_check_copy,
        help="check the copy on the server set by LIGHTPEN_ARCHIVE, too",
    )
    actions.add_parser(
        "deliver", help="deliver the entries to the server set by LIGHTPEN_ARCHIVE"
    ).set_defaults(run=_deliver)
    fetched = actions.add_parser(
        "fetch", help="restore entries and files of this folder from the server"
    )
    fetched.set_defaults(run=_fetch)
    fetched.add_argument(
        "--chain",
        default="",
        metavar="NAME",
        help="start of the chain to restore, where the server has several",
    )
    actions.add_parser(
        "server-sql", help="print the SQL that sets up a PostgreSQL server"
    ).set_defaults(run=_print_sql)


def replicate(database: "Database", chain: str) -> "Replicator | None":
    """Deliver a chain to the server of the plant, if one is named."""
    from lightpen_extensions.plant.server import server_address

    address = server_address()
    if not address:
        return None
    from lightpen_extensions.plant.server import Replicator

    return Replicator(database, chain, address)


PLANT = Extension(
    "plant", add_archive_actions=_add_archive_actions, replicate=replicate
)
