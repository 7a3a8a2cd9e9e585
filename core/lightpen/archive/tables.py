"""The tables of the archive, on SQLite and on PostgreSQL alike.

What the columns of an entry say stands in its text, too: they are there to be searched
by, and `lightpen.archive.check` compares them with it.
"""

from sqlalchemy import (
    BigInteger,
    Boolean,
    Column,
    Index,
    Integer,
    MetaData,
    String,
    Table,
    Text,
)

METADATA = MetaData()

CHAINS = Table(
    "archive_chains",
    METADATA,
    Column("chain", String(32), primary_key=True),
    Column("is_own", Boolean, nullable=False),
    Column("number", Integer, nullable=False),
    Column("sha256", String(64), nullable=False),
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
    Column("signature", Text, nullable=False),  # as `lightpen.archive.signatures`
    Index("archive_of_tip", "pen", "tip", "is_simulated", "kind", "since_us"),
    Index("archive_in_order", "since_us", "chain", "number"),
    Index("archive_of_station", "station", "since_us", "chain", "number"),
    Index("archive_of_swing", "chain", "swing"),
    Index("archive_of_result", "chain", "result"),
    Index("archive_of_entry", "concerns"),
    Index("archive_by_hash", "sha256"),
    Index("archive_by_clock", "at_us", "since_us", "chain", "number"),
)

RECORDS = Table(
    "archive_records",
    METADATA,
    Column("sha256", String(64), primary_key=True),
    Column("text", Text, nullable=False),
)
