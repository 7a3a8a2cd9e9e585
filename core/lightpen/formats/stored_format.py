"""The format of results, revocations, swings, and changes of limits and library."""

from typing import Annotated, Any, TypeVar

from msgspec import Meta, Struct

from lightpen.formats.own_json import in_shape, parse_checked

FORMAT = 1
T = TypeVar("T")


class LaterFormatError(ValueError):
    """A file was written by a later version, which has the format ``number``."""

    def __init__(self, number: int) -> None:
        super().__init__(f"Format {number} is not known.")
        self.number = number


class _Format(Struct):
    format: Annotated[int, Meta(ge=1)]


def parse_stored(data: bytes, shape: type[T]) -> T:
    """Parse a text with checksum in the present format.

    Raises `DamagedError` if it has no checksum or is not of the format that it names,
    and `LaterFormatError` if that is a later one.
    """
    entries = parse_checked(data, dict[str, Any])
    require_format(entries)
    return in_shape(entries, shape)


def require_format(entries: dict[str, Any]) -> None:
    """Refuse entries of another format; see `parse_stored`."""
    number = in_shape(entries, _Format).format
    if number > FORMAT:
        raise LaterFormatError(number)
