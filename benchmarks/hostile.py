"""Malformed input to the program, and its reaction."""

from benchmarks.hostile_files import hostile_file_rows
from benchmarks.hostile_kills import hostile_kill_rows
from benchmarks.hostile_records import hostile_record_rows
from benchmarks.rows import Row


def hostile_rows() -> list[Row]:
    """Return what becomes of spoiled files, of flipped bits and of kills."""
    return [*hostile_file_rows(), *hostile_record_rows(), *hostile_kill_rows()]
