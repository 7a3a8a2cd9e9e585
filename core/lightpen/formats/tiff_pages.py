"""Pages of TIFF files, classic and BigTIFF, decoded one by one.

OpenCV decodes each page from a file in memory that holds this page alone, made of the
tags that say how its pixels are stored. So the file may be larger than memory, what a
page takes is known before, and other tags, such as the orientation, have no effect.

References
----------
.. [1] Adobe, "TIFF Revision 6.0", 1992.
.. [2] Aware Systems, "The BigTIFF File Format".
"""

import re
import struct
from collections.abc import Collection
from dataclasses import dataclass
from itertools import accumulate
from typing import BinaryIO, TypeAlias

from lightpen.errors import FileError
from lightpen.formats.image_headers import (
    ImageHeader,
    check_pixels,
    damaged_image,
    exactly,
)
from lightpen.messages import Message

MAX_PAGES = 30_000  # as many as frames of a video
MAX_CHANNELS = 4
MAX_ENTRIES = 500  # of a directory
MAX_VALUES = 500_000  # of an entry: strips of one row in three planes, or a palette

_SIGNATURES = {b"II*\0": "<", b"MM\0*": ">", b"II+\0": "<", b"MM\0+": ">"}
_TYPES = {1: "B", 3: "H", 4: "I", 13: "I", 16: "Q", 18: "Q"}
_TEXT = 2
_KIND, _WIDTH, _HEIGHT, _BITS, _COMPRESSION, _PHOTOMETRIC = 254, 256, 257, 258, 259, 262
_DESCRIPTION, _STRIPS, _ORIENTATION, _CHANNELS, _STRIP_ROWS = 270, 273, 274, 277, 278
_STRIP_SIZES, _PLANES, _TILE_WIDTH, _TILE_HEIGHT, _TILES = 279, 284, 322, 323, 324
_TILE_SIZES, _SUB_PAGES, _EXTRA, _FORMAT, _SUBSAMPLING = 325, 330, 338, 339, 530
_STACK = 33629  # of MetaMorph: an entry for each page
_KEPT = (
    *(_WIDTH, _HEIGHT, _BITS, _COMPRESSION, _PHOTOMETRIC, 266, _CHANNELS, _STRIP_ROWS),
    *(_PLANES, 317, 320, _TILE_WIDTH, _TILE_HEIGHT, _EXTRA, _SUBSAMPLING),
)
_READ = frozenset(
    (*_KEPT, _KIND, _STRIPS, _STRIP_SIZES, _TILES, _TILE_SIZES, _ORIENTATION, _FORMAT)
)
_FORMS = {1: "uint", 2: "int", 3: "float", 4: "uint", 6: "complex"}  # _FORMAT
_REDUCED, _MASK = 1, 4  # bits of _KIND
_MIN_IS_WHITE, _MIN_IS_BLACK, _MOSAIC = 0, 1, 32803
_LOSSLESS = frozenset({1, 5, 8, 32773, 32946})  # none, LZW, deflate, PackBits
_NAMES = dict.fromkeys((6, 7), "JPEG") | dict.fromkeys((3, 4), "CCITT fax")
_NAMES |= {34712: "JPEG 2000", 34887: "LERC", 34925: "LZMA"}
_NAMES |= {50000: "ZSTD", 50001: "WebP", 50002: "JPEG XL"}
# How ImageJ, beyond 4 GB, and tifffile describe pages that have no directory.
_STACKS = (
    rb"ImageJ=[^\0]*?\nimages=(\d{1,6})\n",
    rb'\{"shape": \[(\d{1,6}), \d+, \d+\], "truncated": true',
)

_Name: TypeAlias = str | Message
_Tags: TypeAlias = dict[int, tuple[int, ...]]


@dataclass(frozen=True)
class PagePlace:
    """Place of a page in its file."""

    directory: int  # bytes from the start
    skipped: int = 0  # bytes of pixels of this directory's earlier pages


@dataclass(frozen=True)
class TiffPage:
    """A page of which the directory was read."""

    order: str  # of bytes, as of `struct`
    tags: _Tags
    place: PagePlace
    name: _Name

    @property
    def orientation(self) -> int:
        """Orientation by its tag: 1 as stored, to 8."""
        return self._first(_ORIENTATION, 1)

    @property
    def n_planes(self) -> int:
        """Number of planes that hold one channel each; 1 of all channels."""
        return self._first(_CHANNELS, 1) if self._first(_PLANES, 1) == 2 else 1

    @property
    def is_inverted(self) -> bool:
        """Return whether the least value is white."""
        return self._first(_PHOTOMETRIC, _MIN_IS_BLACK) == _MIN_IS_WHITE

    @property
    def is_plain(self) -> bool:
        """Return whether its pixels are stored one after the other."""
        return self._first(_COMPRESSION, 1) == 1 and self.n_planes == 1

    @property
    def unused_bits(self) -> int:
        """Number of bits by which OpenCV scales values of 10, 12 or 14 bits up."""
        depth = self._first(_BITS, 1)
        return 16 - depth if depth in (10, 12, 14) else 0

    @property
    def n_bytes(self) -> int:
        """Size of the stored pixels."""
        return sum(self._parts[1])

    @property
    def header(self) -> ImageHeader:
        """Size and memory; raises `FileError` if the page cannot be decoded."""
        width, height = self._first(_WIDTH, 0), self._first(_HEIGHT, 0)
        depth, channels = self._first(_BITS, 1), self._first(_CHANNELS, 1)
        compression = self._first(_COMPRESSION, 1)
        if compression not in _LOSSLESS:
            kind = _NAMES.get(compression, str(compression))
            raise FileError("image.tiff-compression", name=self.name, compression=kind)
        if self._first(_PHOTOMETRIC, _MIN_IS_BLACK) == _MOSAIC:
            raise FileError("image.mosaic", name=self.name)
        if channels > MAX_CHANNELS:
            raise FileError("image.channels", name=self.name, n_channels=channels)
        if channels == 0 or depth > 64 or width == 0 or height == 0:
            raise damaged_image(self.name)
        kind = f"{_FORMS.get(self._first(_FORMAT, 1), '')}{depth}"
        if depth > 16 or not kind.startswith("uint"):
            raise FileError("image.value-type", name=self.name, value_type=kind)
        check_pixels(width, height, self.name)
        # It is decoded strip by strip or tile by tile, each from a copy.
        strip = width * min(self._first(_STRIP_ROWS, height), height)
        if self._is_tiled:
            strip = self._first(_TILE_WIDTH, 0) * self._first(_TILE_HEIGHT, 0)
        return ImageHeader(
            width,
            height,
            width * height * channels * -(-depth // 8),
            4 * strip * max(-(-depth // 8), 1),
        )

    def file_of_plane(self, stream: BinaryIO, plane: int) -> bytes:
        """Return a TIFF file of this page, or of one of its planes, from 0."""
        offsets, sizes = self._parts
        count = len(offsets) // self.n_planes
        own = slice(plane * count, (plane + 1) * count)
        pixels = []
        for offset, size in zip(offsets[own], sizes[own], strict=True):
            stream.seek(offset + self.place.skipped)
            pixels.append(exactly(stream, size, self.name))
        tags = {tag: self.tags[tag] for tag in _KEPT if tag in self.tags}
        if self.n_planes > 1:
            tags = {tag: values[:1] for tag, values in tags.items() if tag != _EXTRA}
            tags |= {_CHANNELS: (1,), _PLANES: (1,)}
        if self.n_planes > 1 or self.is_inverted:
            tags[_PHOTOMETRIC] = (_MIN_IS_BLACK,)
        return _file(self.order, tags, self._is_tiled, pixels)

    @property
    def _is_tiled(self) -> bool:
        return _TILE_WIDTH in self.tags or _TILE_HEIGHT in self.tags

    @property
    def _parts(self) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """Offsets and sizes of strips or tiles, bytes."""
        where, how_long = (
            (_TILES, _TILE_SIZES) if self._is_tiled else (_STRIPS, _STRIP_SIZES)
        )
        offsets, sizes = self.tags.get(where, ()), self.tags.get(how_long, ())
        if not sizes and len(offsets) == 1:  # early writers leave them out
            sizes = (self.header.decoded,)
        if not offsets or len(offsets) != len(sizes) or len(offsets) % self.n_planes:
            raise damaged_image(self.name)
        return offsets, sizes

    def _first(self, tag: int, default: int) -> int:
        return self.tags[tag][0] if tag in self.tags else default


def is_tiff(start: bytes) -> bool:
    """Return whether a file begins as TIFF."""
    return start[:4] in _SIGNATURES


def page_places(stream: BinaryIO, name: _Name) -> list[PagePlace]:
    """Return the places of all pages, but for previews and masks."""
    places: list[PagePlace] = []
    seen: set[int] = set()
    layout = _Layout.read(stream, name)
    waiting = [layout.first(stream, name)]
    while waiting:
        directory = waiting.pop()
        if directory in seen or len(seen) + len(waiting) >= MAX_PAGES:
            raise damaged_image(name)
        seen.add(directory)
        wanted = (_KIND, _SUB_PAGES)
        tags, following = layout.directory(stream, directory, name, wanted)
        waiting += [following] * (following > 0)
        if not tags.get(_KIND, (0,))[0] & (_REDUCED | _MASK):
            places.append(PagePlace(directory))
        else:  # of some cameras the image is a page of its preview
            waiting += tags.get(_SUB_PAGES, ())
    if len(places) == 1:
        return places + _pages_without_directory(stream, name, places[0])
    return places or [PagePlace(min(seen))]


def read_page(stream: BinaryIO, name: _Name, place: PagePlace | None) -> TiffPage:
    """Read the directory of a page, by default of the first."""
    layout = _Layout.read(stream, name)
    place = place or PagePlace(layout.first(stream, name))
    tags, _ = layout.directory(stream, place.directory, name, _READ)
    return TiffPage(layout.order, tags, place, name)


def _pages_without_directory(
    stream: BinaryIO, name: _Name, first: PagePlace
) -> list[PagePlace]:
    """Return further pages whose pixels follow those of the only directory."""
    layout = _Layout.read(stream, name)
    count = layout.n_stacked(stream, first.directory, name)
    page = read_page(stream, name, first)
    if count == 1 or not page.is_plain:
        return []
    return [PagePlace(first.directory, page.n_bytes * i) for i in range(1, count)]


@dataclass(frozen=True)
class _Layout:
    """Byte order and sizes of a file."""

    order: str
    is_big: bool

    @staticmethod
    def read(stream: BinaryIO, name: _Name) -> "_Layout":
        stream.seek(0)
        start = exactly(stream, 4, name)
        if not is_tiff(start):
            raise damaged_image(name)
        return _Layout(_SIGNATURES[start], b"+" in start)

    def first(self, stream: BinaryIO, name: _Name) -> int:
        """Return the place of the first directory."""
        stream.seek(8 if self.is_big else 4)
        return self._number(stream, name)

    def directory(
        self, stream: BinaryIO, place: int, name: _Name, wanted: Collection[int]
    ) -> tuple[_Tags, int]:
        """Return the wanted tags of a directory, and the place of the next one or 0."""
        entries, following = self._entries(stream, place, name)
        tags: _Tags = {}
        for tag, kind, count, inline in entries:
            if tag not in wanted:
                continue
            # A decoder may take the first of a tag, or the last.
            if kind not in _TYPES or not 0 < count <= MAX_VALUES or tag in tags:
                raise damaged_image(name)
            values = f"{self.order}{count}{_TYPES[kind]}"
            data = self._data(stream, inline, struct.calcsize(values), name)
            tags[tag] = struct.unpack(values, data)
        return tags, following

    def n_stacked(self, stream: BinaryIO, place: int, name: _Name) -> int:
        """Return the number of pages that share a directory, as far as it says so."""
        stated = 1
        entries, _ = self._entries(stream, place, name)
        for tag, kind, count, inline in entries:
            if tag == _STACK:
                stated = count
            elif tag == _DESCRIPTION and kind == _TEXT:
                text = self._data(stream, inline, min(count, MAX_VALUES), name)
                for each in filter(None, (re.match(one, text) for one in _STACKS)):
                    stated = int(each[1])
        return min(stated, MAX_PAGES)

    def _entries(
        self, stream: BinaryIO, place: int, name: _Name
    ) -> tuple[list[tuple[int, int, int, bytes]], int]:
        stream.seek(place)
        head = f"{self.order}{'Q' if self.is_big else 'H'}"
        (count,) = struct.unpack(head, exactly(stream, struct.calcsize(head), name))
        if count > MAX_ENTRIES:
            raise damaged_image(name)
        entry = f"{self.order}HH{'Q8s' if self.is_big else 'I4s'}"
        data = exactly(stream, struct.calcsize(entry) * count, name)
        return list(struct.iter_unpack(entry, data)), self._number(stream, name)

    def _number(self, stream: BinaryIO, name: _Name) -> int:
        layout = f"{self.order}{'Q' if self.is_big else 'I'}"
        data = exactly(stream, struct.calcsize(layout), name)
        return int(struct.unpack(layout, data)[0])

    def _data(self, stream: BinaryIO, inline: bytes, size: int, name: _Name) -> bytes:
        if size <= len(inline):
            return inline[:size]
        (offset,) = struct.unpack(f"{self.order}{'Q' if self.is_big else 'I'}", inline)
        stream.seek(offset)
        return exactly(stream, size, name)


def _file(order: str, tags: _Tags, is_tiled: bool, pixels: list[bytes]) -> bytes:
    """Return a classic TIFF file of one page; all its tags are of 32 bits."""
    where, how_long = (_TILES, _TILE_SIZES) if is_tiled else (_STRIPS, _STRIP_SIZES)
    sizes = tuple(map(len, pixels))
    tags = tags | {where: sizes, how_long: sizes}  # offsets follow
    end = 8 + 2 + 12 * len(tags) + 4  # where values begin that an entry cannot hold
    start = end + sum(4 * len(values) for values in tags.values() if len(values) > 1)
    tags[where] = tuple(accumulate(sizes[:-1], initial=start))
    entries, further = [], []
    for tag, values in sorted(tags.items()):
        data = struct.pack(f"{order}{len(values)}I", *values)
        if len(values) > 1:
            further.append(data)
            data, end = struct.pack(f"{order}I", end), end + len(data)
        entries.append(struct.pack(f"{order}HHI4s", tag, 4, len(values), data))
    head = struct.pack(
        f"{order}2sHIH", b"II" if order == "<" else b"MM", 42, 8, len(tags)
    )
    return b"".join([head, *entries, bytes(4), *further, *pixels])
