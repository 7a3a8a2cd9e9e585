"""Formats of the program's files, and their upgrades.

The newest format of a kind of file is one more than it has upgrades. To change a
format, append the function that converts entries of the previous format to the new one;
all readers of such files then read both.
"""

from collections.abc import Callable, Mapping
from typing import Annotated, Any, TypeAlias, TypeVar

from msgspec import Meta, Struct

from lightpen.formats.own_json import DamagedError, in_shape, parse_checked

Entries: TypeAlias = Mapping[str, Any]
Upgrade: TypeAlias = Callable[[Entries], Entries]
T = TypeVar("T")

RESULT = "result"
WITHDRAWAL = "withdrawal"  # of a result
SWING = "swing"  # the header of a recorded swing
LIBRARY = "tip library"  # a change of it
LIMITS = "limits"  # a change of them

UPGRADES: dict[str, tuple[Upgrade, ...]] = {
    RESULT: (),
    WITHDRAWAL: (),
    SWING: (),
    LIBRARY: (),
    LIMITS: (),
}


class LaterFormatError(ValueError):
    """A file was written by a later version, which has the format ``number``."""

    def __init__(self, number: int) -> None:
        super().__init__(f"Format {number} is not known.")
        self.number = number


class _Format(Struct):
    format: Annotated[int, Meta(ge=1)]


def newest_format(kind: str) -> int:
    """Return the format in which a kind of file is written."""
    return 1 + len(UPGRADES[kind])


def parse_upgraded(data: bytes, shape: type[T], kind: str) -> T:
    """Parse a text with checksum, upgraded to the newest format of its kind.

    Raises `DamagedError` if it has no checksum or is not of the format that it names,
    and `LaterFormatError` if that is later than the newest.
    """
    return in_shape(upgraded(parse_checked(data, dict[str, Any]), kind), shape)


def upgraded(entries: Entries, kind: str) -> Entries:
    """Return entries as the newest format has them; see `parse_upgraded`."""
    number = in_shape(entries, _Format).format
    if number > newest_format(kind):
        raise LaterFormatError(number)
    try:
        for each in UPGRADES[kind][number - 1 :]:
            entries = each(entries)
    except (ArithmeticError, LookupError, TypeError, ValueError) as error:
        raise DamagedError(f"Its format is not {number}.") from error
    return {**entries, "format": newest_format(kind)}
