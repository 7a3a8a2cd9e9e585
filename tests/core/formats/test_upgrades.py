"""A file of an earlier format is read by its upgrades, one after the other."""

import pytest
from msgspec import Struct

from lightpen.formats.json_records import record_bytes
from lightpen.formats.own_json import DamagedError
from lightpen.formats.upgrades import (
    UPGRADES,
    Entries,
    LaterFormatError,
    newest_format,
    parse_upgraded,
)


class Now(Struct):
    format: int
    length_mm: float


def renamed(old: Entries) -> Entries:
    return {"length_cm": old["length"]}


def in_millimetres(old: Entries) -> Entries:
    return {"length_mm": 10 * old["length_cm"]}


@pytest.fixture(autouse=True)
def kind(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(UPGRADES, "rod", (renamed, in_millimetres))


def read(**entries: object) -> Now:
    return parse_upgraded(record_bytes(entries), Now, "rod")


def test_every_format_is_read_as_the_newest() -> None:
    assert newest_format("rod") == 3
    assert read(format=3, length_mm=5) == Now(3, 5.0)
    assert read(format=2, length_cm=5) == Now(3, 50.0)
    assert read(format=1, length=5) == Now(3, 50.0)


@pytest.mark.parametrize(
    "entries",
    [
        {},
        {"format": 0, "length": 5},
        {"format": None, "length": 5},
        {"format": 1, "length_cm": 5},
        {"format": 2, "length_cm": None},
        {"format": 3, "length_cm": 5},
    ],
)
def test_what_is_not_of_the_format_that_it_names_is_damaged(
    entries: dict[str, object],
) -> None:
    with pytest.raises(DamagedError):
        read(**entries)


def test_a_later_format_is_distinguished() -> None:
    with pytest.raises(LaterFormatError) as reported:
        read(format=4, length_mm=5)
    assert reported.value.number == 4


def test_a_text_without_a_checksum_is_damaged() -> None:
    with pytest.raises(DamagedError):
        parse_upgraded(b'{"format": 3, "length_mm": 5.0}', Now, "rod")
