"""Seeded damage to files: flipped bits and malicious values."""

import json
from copy import deepcopy
from typing import Any

import numpy as np

from lightpen.formats.own_json import with_checksum

DEEP = 3000  # levels of nesting, more than Python's recursion takes
VALUES: tuple[Any, ...] = (
    *(None, True, -1, 0, 0.5, 2**31, 2**63, 10**400, 1e300, -1e300, 5e-324),
    *("", "x", "\x00", "\udc80", "\ud800", "NaN", "../..", "w" * 5000),
    *("0001-01-01T00:00:00+00:00", "9999-12-31T23:59:59-12:00", "2026-01-01"),
    *([], {}, [None], [[1]], [1e300] * 3, [0.0, 0.0, 0.0], {"": {}}, ["a"] * 300),
)
WORDS = (b"NaN", b"Infinity", b"-Infinity", b"1e999", b"9" * 5000, b"\0", b"\xff")


def flipped(content: bytes, bit: int) -> bytes:
    """Return bytes with one bit the other way."""
    damaged = bytearray(content)
    damaged[bit // 8] ^= 1 << bit % 8
    return bytes(damaged)


def mutated(content: bytes, rng: np.random.Generator) -> bytes:
    """Return the text of a JSON object, damaged somehow.

    Half of what stays an object gets a right checksum, to come past it.
    """
    if rng.random() < 0.5:
        return _mutated_bytes(content, rng)
    try:
        entries = json.loads(content)
    except ValueError:
        return _mutated_bytes(content, rng)
    if not isinstance(entries, dict):
        return _mutated_bytes(content, rng)
    entries.pop("checksum", None)
    for _ in range(int(rng.integers(1, 3))):
        _mutate(entries, rng)
    text = json.dumps(entries).encode("utf-8", "backslashreplace")
    return with_checksum(text) if rng.random() < 0.9 else text


def _mutate(entries: dict[str, Any], rng: np.random.Generator) -> None:
    """Change one value, anywhere in the tree."""
    place: Any = entries
    while True:
        keys = list(place) if isinstance(place, dict) else list(range(len(place)))
        if not keys:
            return
        key = keys[int(rng.integers(len(keys)))]
        below = place[key]
        if not isinstance(below, dict | list) or rng.random() < 0.3:
            break
        place = below
    match int(rng.integers(4)):
        case 0:
            del place[key]
        case 1 if isinstance(below, float):
            place[key] = below * float(rng.choice([-1.0, 10.0, 1e9, 1e-9]))
        case _:
            # A copy, as the next change may be within it.
            place[key] = deepcopy(VALUES[int(rng.integers(len(VALUES)))])


def _mutated_bytes(content: bytes, rng: np.random.Generator) -> bytes:
    start, end = sorted(rng.integers(len(content) + 1, size=2).tolist())
    match int(rng.integers(7)):
        case 0:
            return flipped(content, int(rng.integers(8 * len(content))))
        case 1:
            return content[:start]
        case 2:
            return content[:start] + content[end:]
        case 3:
            return content[:end] + content[start:]
        case 4:
            return b"[" * DEEP + content
        case 5:
            return content[:start] + b'{"a":' * DEEP + content[start:]
        case _:
            word = WORDS[int(rng.integers(len(WORDS)))]
            return content[:start] + word + content[start:]
