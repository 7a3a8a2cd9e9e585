"""Chains of entries, and the records that these refer to.

The tables are made as they are now, see `lightpen.archive.store.tables`. A version that
changes them adds a module beside this one, whose ``upgrade`` migrates the previous
tables.
"""

revision = "1"
down_revision = None
