"""Image size and decoding memory, from the header of an image file alone.

A kilobyte can claim to be an image of gigapixels, and a decoder believes it. So the
formats that cameras write are recognised by their first bytes and their headers are
read as their decoders read them; other formats are refused.
"""

import re
import struct
from collections.abc import Callable
from dataclasses import dataclass
from typing import BinaryIO, TypeAlias

from lightpen.errors import FileError
from lightpen.formats.files import AN_IMAGE, HEAD, kind_of
from lightpen.messages import Message

MAX_PIXELS = 70_000_000  # the largest usual sensors have 9344 x 7000
SHORTEST_IMAGE = 16  # bytes; any format can be told from as many
PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"

_PNM_GAP = rb"(?:\s|#[^\r\n]*[\r\n])"
_PNM_HEAD = re.compile(
    rb"P([1-6])%b+(\d{1,9})%b+(\d{1,9})(?:%b+(\d{1,9}))?" % ((_PNM_GAP,) * 3)
)
_PNM_HEAD_LENGTH = 4096  # bytes, with comments
_BMP_HEAD_OF_OS2 = 12  # bytes
_JPEG_FRAMES = frozenset((*range(0xC0, 0xD0), 0xF7)) - {0xC4, 0xC8, 0xCC}
_JPEG_PROGRESSIVE = frozenset({0xC2, 0xCA})
_JPEG_LOSSLESS = frozenset({0xC3, 0xC7, 0xCB, 0xCF, 0xF7})
JPEG_SCAN = 0xDA
_JPEG_WITHOUT_LENGTH = frozenset({0x01, *range(0xD0, 0xD9)})
_JPEG_MARKERS = 1000  # before the pixels; a colour profile takes 255
_WEBP_ANIMATED = 0x02  # of the flags


@dataclass(frozen=True)
class ImageHeader:
    """Size of an image, px; memory of the decoded image, and for decoding, bytes.

    `full_scale` is the brightest value of a pixel, if the file states it.
    """

    width: int
    height: int
    decoded: int
    working: int = 0
    full_scale: int | None = None


_Name: TypeAlias = str | Message
_Reader: TypeAlias = Callable[[BinaryIO, _Name], ImageHeader]


def read_image_header(stream: BinaryIO, name: str | Message) -> ImageHeader:
    """Read the header of an image from its first byte; refuse implausibly large images.

    Raises `FileError` if the format is not known or the header is damaged.
    """
    start = stream.read(HEAD)
    stream.seek(0)
    header = _reader(start, name)(stream, name)
    if header.width == 0 or header.height == 0:
        raise damaged_image(name)
    check_pixels(header.width, header.height, name)
    return header


def check_pixels(
    width: int, height: int, name: str | Message, most: int = MAX_PIXELS
) -> None:
    """Refuse an image with too many pixels."""
    if width * height > most:
        raise FileError(
            "image.too-many-pixels", name=name, width=width, height=height, most=most
        )


def damaged_image(name: str | Message) -> FileError:
    """Return the error of a damaged image."""
    return FileError("image.damaged", name=name)


def _unknown_image(start: bytes, name: str | Message) -> FileError:
    """Return the error of a file that is of another kind, or damaged."""
    kind = kind_of(start, str(name))
    if len(start) < SHORTEST_IMAGE:
        return cut_off_image(name)
    if not kind:
        return FileError("image.unknown", name=name)
    known = FileError("image.kind", name=name, kind=kind)
    return damaged_image(name) if kind == AN_IMAGE else known


def cut_off_image(name: str | Message) -> FileError:
    """Return the error of a truncated image."""
    return FileError("image.cut-off", name=name)


def animated_image(name: str | Message) -> FileError:
    """Return the error of an animated image."""
    return FileError("image.animated", name=name)


def _reader(start: bytes, name: _Name) -> _Reader:
    if start.startswith(PNG_SIGNATURE):
        return _png
    if start.startswith(b"\xff\xd8\xff"):
        return _jpeg
    if start.startswith(b"BM"):
        return _bmp
    if start.startswith(b"RIFF") and start[8:12] == b"WEBP":
        return _webp
    if re.match(rb"P[1-6][\s#]", start):
        return _pnm
    raise _unknown_image(start, name)


def exactly(stream: BinaryIO, count: int, name: _Name) -> bytes:
    """Return bytes of a file that is long enough; else raise `FileError`."""
    data = stream.read(count)
    if len(data) < count:
        raise cut_off_image(name)
    return data


def _png(stream: BinaryIO, name: _Name) -> ImageHeader:
    stream.seek(len(PNG_SIGNATURE))
    length, kind, width, height, depth, colour = struct.unpack(
        ">I4sIIBB", exactly(stream, 18, name)
    )
    if (length, kind) != (13, b"IHDR"):
        raise damaged_image(name)
    # All but grey may come with transparency, which makes it four channels.
    bytes_a_pixel = (1 if colour == 0 else 4) * (2 if depth == 16 else 1)
    return ImageHeader(width, height, width * height * bytes_a_pixel)


def _jpeg(stream: BinaryIO, name: _Name) -> ImageHeader:
    stream.seek(2)
    frame, channels, pixels = 0, 0, (0, 0)
    for _ in range(_JPEG_MARKERS):
        marker, length = jpeg_segment(stream, name)
        if marker == JPEG_SCAN:
            break
        if marker in _JPEG_FRAMES:
            depth, height, width, channels = struct.unpack(
                ">BHHB", exactly(stream, 6, name)
            )
            if marker in _JPEG_LOSSLESS or depth == 12:
                kind = "lossless or 12-bit JPEG"
                raise FileError("image.kind", name=name, kind=kind)
            if frame or depth != 8 or channels not in (1, 3, 4):
                raise damaged_image(name)
            frame, pixels, length = marker, (width, height), length - 6
        stream.seek(length, 1)
    else:
        raise damaged_image(name)
    (n_scanned,) = exactly(stream, 1, name)
    if not frame:
        raise damaged_image(name)
    width, height = pixels
    # Of several scans it keeps the coefficients, two bytes each.
    has_scans = frame in _JPEG_PROGRESSIVE or n_scanned < channels
    return ImageHeader(
        width,
        height,
        width * height * (1 if channels == 1 else 3),
        2 * channels * width * height if has_scans else 0,
    )


def jpeg_segment(stream: BinaryIO, name: _Name) -> tuple[int, int]:
    """Return the next marker and the length of its segment, bytes."""
    while True:
        if exactly(stream, 1, name) != b"\xff":
            raise damaged_image(name)
        (marker,) = exactly(stream, 1, name)
        while marker == 0xFF:  # fill bytes
            (marker,) = exactly(stream, 1, name)
        if marker not in _JPEG_WITHOUT_LENGTH:
            break
    (length,) = struct.unpack(">H", exactly(stream, 2, name))
    if length < 2:
        raise damaged_image(name)
    return marker, length - 2


def _bmp(stream: BinaryIO, name: _Name) -> ImageHeader:
    stream.seek(14)
    (size,) = struct.unpack("<I", exactly(stream, 4, name))
    layout = "<HHHH" if size == _BMP_HEAD_OF_OS2 else "<iiHH"
    width, height, _, bits = struct.unpack(
        layout, exactly(stream, struct.calcsize(layout), name)
    )
    if width < 0:
        raise damaged_image(name)
    return ImageHeader(
        width, abs(height), width * abs(height) * (4 if bits == 32 else 3)
    )


def _webp(stream: BinaryIO, name: _Name) -> ImageHeader:
    stream.seek(12)
    kind = exactly(stream, 4, name)
    stream.seek(20)
    head = exactly(stream, 10, name)
    if kind == b"VP8X":
        if head[0] & _WEBP_ANIMATED:
            raise animated_image(name)
        width = int.from_bytes(head[4:7], "little") + 1
        height = int.from_bytes(head[7:10], "little") + 1
    elif kind == b"VP8L":
        sizes = int.from_bytes(head[1:5], "little")
        width, height = (sizes & 0x3FFF) + 1, (sizes >> 14 & 0x3FFF) + 1
    elif kind == b"VP8 ":
        width, height = (side & 0x3FFF for side in struct.unpack("<HH", head[6:10]))
    else:
        raise damaged_image(name)
    return ImageHeader(width, height, 4 * width * height, 4 * width * height)


def _pnm(stream: BinaryIO, name: _Name) -> ImageHeader:
    head = _PNM_HEAD.match(stream.read(_PNM_HEAD_LENGTH))
    if head is None or (head[4] is None and head[1] not in b"14"):
        raise damaged_image(name)
    kind, width, height = int(head[1]), int(head[2]), int(head[3])
    brightest = 1 if kind in (1, 4) else int(head[4])
    channels = 3 if kind in (3, 6) else 1
    bytes_a_value = 2 if brightest > 255 else 1
    decoded = width * height * channels * bytes_a_value
    stream.seek(head.end() + 1 + decoded)
    if kind in (5, 6) and re.match(rb"\s*P[56]\s", stream.read(4)):
        raise animated_image(name)
    return ImageHeader(width, height, decoded, full_scale=brightest)
