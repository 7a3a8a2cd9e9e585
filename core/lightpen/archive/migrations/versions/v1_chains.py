"""Chains of entries, and the records that these vouch for: the first tables."""

revision = "1"
down_revision = None
