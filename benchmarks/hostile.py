"""What is fed to the program that no good program wrote, and what it makes of it."""

from benchmarks.hostile_files import hostile_file_rows
from benchmarks.rows import Row


def hostile_rows() -> list[Row]:
    """Return what becomes of spoiled files."""
    return hostile_file_rows()
