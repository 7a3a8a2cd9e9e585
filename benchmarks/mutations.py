"""Files spoiled at random: flipped bits, lost and repeated parts, absurd numbers."""

import re
import struct
import zlib
from collections.abc import Callable
from typing import TypeAlias

import numpy as np

MOST_STEPS = 4
LARGEST = 200_000  # bytes, that a mutation makes a file grow to
WORDS = (
    *(b"nan", b"inf", b"-1", b"0", b"1e999", b"-1e308", b"1e-320", b"99999999999"),
    *(b"1" * 3000 + b"a", b"0x10", b"1,5", b"1_000", b"null", b"true", b'"x"', b"[]"),
    *(b"{}", b"[" * 60, b"<a>", b"&amp;", b"!!python/none", b"&a [*a]", b"%", b"\t"),
    *(b"\0", b"\xff\xfe", b"\xc3\xa9", "²".encode(), "\u22125".encode(), b" " * 2000),
)
NUMBERS = (0, 1, 127, 128, 255, 256, 32767, 65535, 2**24, 2**31 - 1, 2**31, 2**32 - 1)
NUMBER_LAYOUTS = ("<H", ">H", "<I", ">I", "B")
PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"

Rng: TypeAlias = np.random.Generator
_Step: TypeAlias = Callable[[bytes, Rng], bytes]


def mutated(data: bytes, rng: Rng) -> bytes:
    """Return a file with a few things wrong in it; it may come out as it was.

    The checksums of a PNG are mostly mended, as the decoder sees nothing else of it.
    """
    for _ in range(int(rng.integers(1, MOST_STEPS + 1))):
        step = _STEPS[int(rng.integers(len(_STEPS)))]
        data = step(data, rng)[:LARGEST] if data else rng.bytes(10)
    if data.startswith(PNG_SIGNATURE) and rng.random() < 0.8:
        return _with_checksums(data)
    return data


def _part(data: bytes, rng: Rng, longest: int = 64) -> slice:
    start = int(rng.integers(len(data)))
    return slice(start, start + int(rng.integers(1, longest + 1)))


def _with(data: bytes, part: slice, new: bytes) -> bytes:
    return data[: part.start] + new + data[part.stop :]


def _flip(data: bytes, rng: Rng) -> bytes:
    place = int(rng.integers(len(data)))
    return _with(
        data, slice(place, place + 1), bytes([data[place] ^ 1 << rng.integers(8)])
    )


def _overwrite(data: bytes, rng: Rng) -> bytes:
    part = _part(data, rng, 8)
    return _with(data, part, rng.bytes(part.stop - part.start))


def _number(data: bytes, rng: Rng) -> bytes:
    """Put an extreme binary number somewhere, mostly in the first bytes."""
    layout = NUMBER_LAYOUTS[int(rng.integers(len(NUMBER_LAYOUTS)))]
    size = struct.calcsize(layout)
    number = NUMBERS[int(rng.integers(len(NUMBERS)))] % 256**size
    start = int(rng.integers(min(len(data), 400) if rng.random() < 0.7 else len(data)))
    return _with(data, slice(start, start + size), struct.pack(layout, number))


def _drop(data: bytes, rng: Rng) -> bytes:
    return _with(data, _part(data, rng, 1 + len(data) // 4), b"")


def _cut(data: bytes, rng: Rng) -> bytes:
    return data[: int(rng.integers(len(data)))]


def _repeat(data: bytes, rng: Rng) -> bytes:
    part = _part(data, rng, 1 + len(data) // 4)
    return _with(data, part, data[part] * int(rng.choice([2, 3, 300])))


def _insert(data: bytes, rng: Rng) -> bytes:
    start = int(rng.integers(len(data)))
    return _with(data, slice(start, start), rng.bytes(int(rng.integers(1, 20))))


def _move(data: bytes, rng: Rng) -> bytes:
    part = _part(data, rng, 1 + len(data) // 4)
    rest = _with(data, part, b"")
    place = int(rng.integers(len(rest) + 1))
    return rest[:place] + data[part] + rest[place:]


def _word(data: bytes, rng: Rng) -> bytes:
    """Put an absurd word in the place of a number or a name of a text."""
    words = list(re.finditer(rb"[\w.+-]+", data[:20_000]))
    if not words:
        return data
    found = words[int(rng.integers(len(words)))]
    word = WORDS[int(rng.integers(len(WORDS)))]
    return _with(data, slice(*found.span()), word)


def _swap_lines(data: bytes, rng: Rng) -> bytes:
    lines = data.split(b"\n")
    one, other = rng.integers(len(lines), size=2)
    lines[one], lines[other] = lines[other], lines[one]
    return b"\n".join(lines)


_STEPS: tuple[_Step, ...] = (
    *(_flip, _overwrite, _number, _number, _drop, _cut, _repeat, _insert, _move),
    *(_word, _word, _word, _swap_lines),
)


def _with_checksums(data: bytes) -> bytes:
    """Return a PNG with the right checksum on every chunk that is there."""
    chunks = [data[:8]]
    place = 8
    while place + 12 <= len(data):
        (length,) = struct.unpack_from(">I", data, place)
        body = data[place + 4 : place + 8 + length]
        checksum = zlib.crc32(body).to_bytes(4, "big")
        chunks += [data[place : place + 4], body, checksum]
        place += 12 + length
    return b"".join(chunks)
