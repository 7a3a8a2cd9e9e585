"""The program's own JSON: read as it was written, or not at all; by many threads."""

import subprocess
import sys

import pytest
from msgspec import Struct

from lightpen.formats.own_json import (
    DamagedError,
    parse_checked,
    parse_own_json,
    with_checksum,
)

# A crash of the interpreter would end the tests with it.
READERS = """
import sys
from dataclasses import make_dataclass
from threading import Barrier, Thread
from lightpen.formats.own_json import in_shape

sys.setswitchinterval(1e-6)
names = [f"n{i}" for i in range(6)]
tree = {name: dict.fromkeys(names, 1.0) for name in names}
for _ in range(60):
    inner = [make_dataclass("Inner", [(n, float) for n in names]) for _ in names]
    shape = make_dataclass("Shape", list(zip(names, inner)))
    together = Barrier(4)

    def read():
        together.wait()
        in_shape(tree, shape)

    threads = [Thread(target=read) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
print("done")
"""


def test_a_shape_that_was_never_read_is_read_by_many_threads_at_once() -> None:
    outcome = subprocess.run(
        [sys.executable, "-c", READERS],
        capture_output=True,
        encoding="utf-8",
        check=False,
    )

    assert outcome.stdout == "done\n", outcome.stderr


def test_what_stands_behind_a_checksum_is_damage() -> None:
    text = with_checksum(b'{"a": 1}')
    assert parse_checked(text, dict)["a"] == 1

    with pytest.raises(DamagedError, match="checksum"):
        parse_checked(text.removesuffix(b"}") + b', "a": 2}', dict)


def test_an_entry_that_is_given_twice_is_damage() -> None:
    with pytest.raises(DamagedError, match="twice"):
        parse_checked(with_checksum(b'{"a": 1, "a": 2}'), dict)


class Converted(Struct):
    """A value that is made a float when it is read."""

    length: int

    def __post_init__(self) -> None:
        float(self.length)


def test_a_number_larger_than_any_float_is_damage() -> None:
    with pytest.raises(DamagedError, match="too large"):
        parse_own_json(b'{"length": 1%b}' % (b"0" * 400), Converted)


def test_a_text_with_more_values_than_are_ever_written_is_damage(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("lightpen.formats.own_json.MOST_VALUES", 10)
    assert parse_own_json(b"[" + b"[]," * 4 + b"1]", list) == [[], [], [], [], 1]
    for value in (b"[]", b"{}", b"1"):
        with pytest.raises(DamagedError, match="too many"):
            parse_own_json(b"[" + (value + b",") * 10 + b"1]", list)
