"""The tables of the archive: entries and records, on SQLite and PostgreSQL alike.

The columns of an entry repeat its text: they serve the search, and
`lightpen.archive.checks.check` compares them with it. Nothing but the entries says how
far a chain has come.
"""

from sqlalchemy import (
    BigInteger,
    Boolean,
    Column,
    FetchedValue,
    Index,
    Integer,
    MetaData,
    String,
    Table,
    Text,
)

METADATA = MetaData()

CHAIN_WRITERS = Table(  # of a server
    "archive_writers",
    MetaData(),
    Column("chain", String(32), primary_key=True),
    Column("writer", Text, nullable=False, server_default=FetchedValue()),  # its role
)

ENTRIES = Table(
    "archive_entries",
    METADATA,
    Column("chain", String(32), primary_key=True),
    Column("number", Integer, primary_key=True, autoincrement=False),
    Column("sha256", String(64), nullable=False),
    Column("since_us", BigInteger, nullable=False),  # since 1970 in UTC
    Column("kind", Text, nullable=False),
    Column("station", Text, nullable=False),
    Column("pen", Text, nullable=False),
    Column("tip", Text, nullable=False),
    Column("is_simulated", Boolean, nullable=False),
    Column("swing", Text, nullable=False),
    Column("result", Text, nullable=False),
    Column("concerns", String(64), nullable=False),
    Column("record_sha256", String(64), nullable=False),
    Column("text", Text, nullable=False),
    Column("at_us", BigInteger, nullable=False),  # by its own clock
    Column(
        "signature", Text, nullable=False
    ),  # as `lightpen.archive.chains.signatures`
    Index("archive_of_tip", "pen", "tip", "is_simulated", "kind", "since_us"),
    Index("archive_in_order", "since_us", "chain", "number"),
    Index("archive_of_station", "station", "since_us", "chain", "number"),
    Index("archive_of_swing", "chain", "swing"),
    Index("archive_of_result", "chain", "result"),
    Index("archive_of_entry", "concerns"),
    Index("archive_by_hash", "sha256"),
    Index("archive_by_record", "record_sha256"),
    Index("archive_by_clock", "at_us", "since_us", "chain", "number"),
)

RECORDS = Table(
    "archive_records",
    METADATA,
    Column("sha256", String(64), primary_key=True),
    Column("text", Text, nullable=False),
)
