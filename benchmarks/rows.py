"""Rows of the benchmark's table, and the table as Markdown."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

HEADER = """\
| what | Lightpen | required | others |
|---|---|---|---|"""
NO_LIMIT = "-"
NEEDS_DATA = "needs LIGHTPEN_DATA"


@dataclass(frozen=True)
class Row:
    """One figure, what is required of it, and what others reach.

    Attributes
    ----------
    met : bool
        Whether the limit is kept; true where there is none.
    """

    what: str
    measured: str
    limit: str = NO_LIMIT
    others: str = ""
    met: bool = True


def without_data(*names: str) -> list[Row]:
    """Return the rows of figures that need the image sets where these are missing."""
    return [Row(name, NEEDS_DATA) for name in names]


def table(rows: Sequence[Row]) -> str:
    """Return rows as a Markdown table; a missed limit is set in bold."""
    return "\n".join([HEADER, *map(_line, rows)])


def numbers(values: Iterable[float], decimals: int) -> str:
    """Return numbers of one kind, separated by blanks."""
    return " ".join(f"{value:.{decimals}f}" for value in values)


def _line(row: Row) -> str:
    measured = row.measured if row.met else f"**{row.measured}, missed**"
    return f"| {row.what} | {measured} | {row.limit} | {row.others} |"
