"""A stored file is of the present format, or refused as later or damaged."""

import pytest
from msgspec import Struct

from lightpen.formats.own_json import (
    FORMAT,
    DamagedError,
    LaterFormatError,
    parse_stored,
    record_bytes,
)


class Rod(Struct):
    format: int
    length_mm: float


def read(**entries: object) -> Rod:
    return parse_stored(record_bytes(entries), Rod)


def test_the_present_format_is_read() -> None:
    assert read(format=FORMAT, length_mm=5) == Rod(FORMAT, 5.0)


@pytest.mark.parametrize(
    "entries",
    [
        {},
        {"format": 0, "length_mm": 5},
        {"format": None, "length_mm": 5},
        {"format": FORMAT, "length_cm": 5},
        {"format": FORMAT, "length_mm": None},
    ],
)
def test_what_is_not_of_the_format_that_it_names_is_damaged(
    entries: dict[str, object],
) -> None:
    with pytest.raises(DamagedError):
        read(**entries)


def test_a_later_format_is_distinguished() -> None:
    with pytest.raises(LaterFormatError) as reported:
        read(format=FORMAT + 1, length_mm=5)
    assert reported.value.number == FORMAT + 1


def test_a_text_without_a_checksum_is_damaged() -> None:
    with pytest.raises(DamagedError):
        parse_stored(b'{"format": 1, "length_mm": 5.0}', Rod)
