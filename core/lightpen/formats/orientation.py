"""Orientation tags of images, which say how a viewer turns the stored pixels.

No tag is applied, whatever the format: intrinsics are of the sensor, and cameras store
what it reads. A program that turned the pixels when it saved them may have left a tag
behind, so images with one are reported.

References
----------
.. [1] CIPA DC-008, "Exchangeable image file format", 4.6.4, tag Orientation.
"""

import struct
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import BinaryIO

from lightpen.errors import FileError
from lightpen.formats.decoding import opened_image
from lightpen.formats.image_headers import PNG_SIGNATURE
from lightpen.formats.tiff_pages import is_tiff, read_page
from lightpen.messages import Message, message, printable

MAX_PARTS = 30_000  # segments or chunks before the tag
LARGEST_EXIF = 2**16  # bytes

_EXIF = b"Exif\0\0"
_MEANINGS = {
    2: message("orientation.mirrored"),
    3: message("orientation.half-turn"),
    4: message("orientation.flipped"),
    5: message("orientation.quarter-mirrored"),
    6: message("orientation.quarter-right"),
    7: message("orientation.quarter-mirrored"),
    8: message("orientation.quarter-left"),
}


def orientation_remark(files: tuple[Path, ...]) -> Message | None:
    """Return a remark on the image files whose tag asks for another orientation."""
    tags = [(file, tag) for file in files if (tag := read_orientation(file)) != 1]
    if not tags:
        return None
    first, tag = tags[0]
    return message(
        "images.orientation",
        n_tagged=len(tags),
        n_images=len(files),
        name=printable(first.name),
        tag=tag,
        meaning=_MEANINGS[tag],
    )


def read_orientation(path: Path) -> int:
    """Return the orientation tag of an image file, 1 to 8; 1 if it has none."""
    try:
        with opened_image(path) as stream:
            start = stream.read(12)
            stream.seek(0)
            exif: BinaryIO | None = stream
            if not is_tiff(start):
                exif = next(map(BytesIO, _exif(stream, start)), None)
            tag = 1 if exif is None else read_page(exif, path.name, None).orientation
    except FileError:  # what is wrong with it is said when it is decoded
        return 1
    return tag if tag in _MEANINGS else 1


def _exif(stream: BinaryIO, start: bytes) -> Iterator[bytes]:
    """Yield the contents of the Exif parts of a JPEG, PNG or WebP."""
    if start.startswith(b"\xff\xd8"):
        parts = _jpeg_parts(stream)
    elif start.startswith(PNG_SIGNATURE):
        parts = _chunks(stream, len(PNG_SIGNATURE), ">I4s", b"eXIf", 4)
    elif start[8:] == b"WEBP":
        parts = _chunks(stream, len(start), "<4sI", b"EXIF", 0)
    else:
        return
    for part in parts:
        exif = part.removeprefix(_EXIF)
        if is_tiff(exif):
            yield exif


def _jpeg_parts(stream: BinaryIO) -> Iterator[bytes]:
    """Yield the APP1 segments of a JPEG."""
    stream.seek(2)
    for _ in range(MAX_PARTS):
        head = stream.read(4)
        if len(head) < 4 or head[0] != 0xFF or head[1] in (0xD9, 0xDA):
            return
        length = int.from_bytes(head[2:], "big") - 2
        if head[1] == 0xE1:
            yield stream.read(max(length, 0))
        else:
            stream.seek(length, 1)


def _chunks(
    stream: BinaryIO, place: int, head: str, wanted: bytes, checksum: int
) -> Iterator[bytes]:
    """Yield the content of chunks of one kind of a PNG or WebP."""
    for _ in range(MAX_PARTS):
        stream.seek(place)
        data = stream.read(8)
        if len(data) < 8:
            return
        length, kind = sorted(
            struct.unpack(head, data), key=lambda e: isinstance(e, bytes)
        )
        if kind == wanted:
            yield stream.read(min(length, LARGEST_EXIF))
        place += 8 + length + checksum
        place += place % 2 if checksum == 0 else 0  # WebP pads to even places
