"""When each entry was by its own clock, to be searched by.

Its time in the order of all is another one, after a clock that was ahead.
"""

import sqlalchemy as sa
from alembic import op

from lightpen.archive.entries import at_us

revision = "2"
down_revision = "1"

NAME = "archive_entries"
BATCH = 2000
_ENTRIES = sa.table(
    NAME,
    *(sa.column(name) for name in ("chain", "number", "since_us", "text", "at_us")),
)
_PLACE = sa.tuple_(_ENTRIES.c.chain, _ENTRIES.c.number)


def upgrade() -> None:
    """Add the column, from the texts."""
    op.add_column(NAME, sa.Column("at_us", sa.BigInteger))
    _fill(op.get_bind())
    with op.batch_alter_table(NAME) as entries:
        entries.alter_column("at_us", nullable=False)
    columns = ["at_us", "since_us", "chain", "number"]
    op.create_index("archive_by_clock", NAME, columns)


def _fill(connection: sa.Connection) -> None:
    here = (
        (_ENTRIES.c.chain == sa.bindparam("of_chain"))
        & (_ENTRIES.c.number == sa.bindparam("of_number"))
    )  # fmt: skip
    filled = sa.update(_ENTRIES).where(here).values(at_us=sa.bindparam("clock_us"))
    batch = sa.select(_ENTRIES).order_by(*_PLACE.clauses).limit(BATCH)
    rows = connection.execute(batch).all()
    while rows:
        values = [
            {
                "of_chain": row.chain,
                "of_number": row.number,
                "clock_us": at_us(row.text, row.since_us),
            }
            for row in rows
        ]
        connection.execute(filled, values)
        last = rows[-1]
        rows = connection.execute(batch.where((last.chain, last.number) < _PLACE)).all()
