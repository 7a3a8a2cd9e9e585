"""Archives of earlier versions, read as they would be now where nothing may change."""

import sqlite3
from contextlib import suppress

from lightpen.archive.entries import at_us

VERSIONS = ("1",)  # of the tables
_IN_FORCE = "SELECT version_num FROM archive_version"
_AS_NOW = """\
CREATE TEMP VIEW archive_entries AS
SELECT *, at_us(text, since_us) AS at_us FROM main.archive_entries"""


def show_as_now(connection: sqlite3.Connection) -> None:
    """Let what is read through a connection have the columns of now.

    Nothing is written to its file.
    """
    with suppress(sqlite3.Error):  # it holds no archive, which is found out later
        if connection.execute(_IN_FORCE).fetchone() in [(each,) for each in VERSIONS]:
            connection.create_function("at_us", 2, at_us, deterministic=True)
            connection.execute(_AS_NOW)
