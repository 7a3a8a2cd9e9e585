"""Chains of entries, and the records that these vouch for."""

import sqlalchemy as sa
from alembic import op

revision = "1"
down_revision = None


def upgrade() -> None:
    """Make the tables."""
    op.create_table(
        "archive_chains",
        sa.Column("chain", sa.String(32), primary_key=True),
        sa.Column("is_own", sa.Boolean, nullable=False),
        sa.Column("number", sa.Integer, nullable=False),
        sa.Column("sha256", sa.String(64), nullable=False),
    )
    op.create_table(
        "archive_entries",
        sa.Column("chain", sa.String(32), primary_key=True),
        sa.Column("number", sa.Integer, primary_key=True, autoincrement=False),
        sa.Column("sha256", sa.String(64), nullable=False),
        sa.Column("since_us", sa.BigInteger, nullable=False),
        *(
            sa.Column(name, sa.Text, nullable=False)
            for name in ("kind", "station", "pen", "tip")
        ),
        sa.Column("is_simulated", sa.Boolean, nullable=False),
        sa.Column("swing", sa.Text, nullable=False),
        sa.Column("result", sa.Text, nullable=False),
        sa.Column("concerns", sa.String(64), nullable=False),
        sa.Column("record_sha256", sa.String(64), nullable=False),
        sa.Column("text", sa.Text, nullable=False),
    )
    for name, columns in {
        "archive_of_tip": ["pen", "tip", "is_simulated", "kind", "since_us"],
        "archive_in_order": ["since_us", "chain", "number"],
        "archive_of_station": ["station", "since_us", "chain", "number"],
        "archive_of_swing": ["chain", "swing"],
        "archive_of_result": ["chain", "result"],
        "archive_of_entry": ["concerns"],
        "archive_by_hash": ["sha256"],
    }.items():
        op.create_index(name, "archive_entries", columns)
    op.create_table(
        "archive_records",
        sa.Column("sha256", sa.String(64), primary_key=True),
        sa.Column("text", sa.Text, nullable=False),
    )
