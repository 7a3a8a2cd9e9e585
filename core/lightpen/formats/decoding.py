"""Read, check and decode an image file to grey values, within memory limits."""

import ctypes
import os
import struct
import sys
import zlib
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from io import BytesIO
from pathlib import Path
from threading import Condition
from typing import Any, BinaryIO

import cv2
import numpy as np
import numpy.typing as npt

from lightpen.arrays import Image
from lightpen.errors import FileError
from lightpen.formats.files import opened
from lightpen.formats.image_headers import (
    PNG_SIGNATURE,
    ImageHeader,
    animated_image,
    cut_off_image,
    damaged_image,
    read_image_header,
)
from lightpen.formats.tiff_pages import PagePlace, TiffPage, is_tiff, read_page
from lightpen.messages import Message, message

IMAGE_FILE = message("file.image")
MAX_FILE_SIZE = 150_000_000  # bytes; the largest image, of 16 bits, not compressed
MAX_STACK_SIZE = 10**12  # bytes, of all pages of a TIFF
TIFF_SUFFIXES = (".tif", ".tiff", ".btf", ".tf8", ".stk", ".lsm")
MAX_MEMORY = 250_000_000  # bytes that all images take while they are decoded
PNG_CHANNELS = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}  # by the colour type
MAX_PNG_CHUNKS = (
    30_000  # the largest image in chunks of 8 kB, as libpng writes, has 18,000
)
PNG_RESERVE = 2**16  # bytes of compressed data beyond the largest possible image
MAX_SCANS = 64  # of a JPEG; each takes as long as the image, 10 are usual
M_TRIM_THRESHOLD, M_MMAP_THRESHOLD, M_ARENA_MAX = -1, -3, -8  # of malloc.h
MAX_KEPT_BLOCK = 32 * 2**20  # bytes; the most that malloc takes
MAX_KEPT_MEMORY = 64 * 2**20
SENSOR_BITS = (10, 12, 14, 16)
BELOW_TOP = 32  # levels below the highest, which noise fills where nothing is clipped
PILE = 8.0  # times the pixels of each of these, at a level where light is clipped
FEWEST_CLIPPED = 5  # pixels
MAX_ARENAS = 1  # of threads; free memory in one is unusable for another


def keep_freed_memory() -> None:
    """Reuse the memory of freed images (Linux with glibc).

    Blocks as large as an image otherwise go back to the kernel when freed, and come
    again page by page, zeroed: two fifths of the time that decoding takes. Threads that
    begin later share one arena; several would each keep the memory of an image or two.
    """
    if sys.platform != "linux":
        return
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    if mallopt is not None:
        mallopt(M_MMAP_THRESHOLD, MAX_KEPT_BLOCK)
        mallopt(M_TRIM_THRESHOLD, MAX_KEPT_MEMORY)
        mallopt(M_ARENA_MAX, MAX_ARENAS)


def release_freed_memory() -> None:
    """Return to the system what `keep_freed_memory` has kept (Linux with glibc).

    It takes some 15 ms, in which threads that need memory wait. What is free between
    blocks in use is too small for the next image, so that the memory of a program in
    which cameras are opened again and again would grow. To be called now and then.
    """
    if sys.platform != "linux":
        return
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(0)


def read_image(path: Path, page: PagePlace | None = None) -> Image:
    """Read one image file, or a page of a TIFF, as grey values of 8 or 16 bit.

    The bytes are read first and decoded then: `cv2.imread` fails on names outside
    the code page of Windows. Pixels stay as stored, whatever an orientation tag says.
    """
    with opened_image(path) as stream:
        return _read(stream, path.name, page)


def decode_image(data: bytes, name: str) -> Image:
    """Decode the bytes of an image file as grey values of 8 or 16 bit, (H, W)."""
    return _read(BytesIO(data), name, None)


def opened_image(path: Path) -> AbstractContextManager[BinaryIO]:
    """Open an image file; a TIFF, which may have many pages, of any size."""
    is_stack = path.suffix.lower() in TIFF_SUFFIXES
    return opened(path, IMAGE_FILE, MAX_STACK_SIZE if is_stack else MAX_FILE_SIZE)


def full_scale_of(image: Image) -> int:
    """Return the brightest value that a pixel of an image can have, by its levels.

    A sensor clips light: of 16-bit images, whose files seldom state their depth, the
    highest level is the full scale where pixels pile up at it. Elsewhere nothing is
    clipped, and it is that of the least depth that holds all levels.
    """
    if image.itemsize == 1:
        return 255
    top = int(image.max(initial=0))
    near = image[image >= top - BELOW_TOP]
    n_top = int(np.count_nonzero(near == top))
    usual = (near.size - n_top) / BELOW_TOP
    if top >= 255 and n_top > max(FEWEST_CLIPPED, PILE * usual):
        return top
    levels: list[int] = [2**bits - 1 for bits in SENSOR_BITS]
    return min(level for level in levels if top <= level)


def encode_png(image: Image) -> bytes:
    """Return a grey image as PNG, made for dark images: runs of equal values.

    No row is predicted from the last, which costs time and gains nothing on noise.
    """
    options = [
        *(cv2.IMWRITE_PNG_COMPRESSION, 1),
        *(cv2.IMWRITE_PNG_STRATEGY, cv2.IMWRITE_PNG_STRATEGY_RLE),
    ]
    if hasattr(cv2, "IMWRITE_PNG_FILTER"):  # OpenCV 4.12 and later
        options += [cv2.IMWRITE_PNG_FILTER, cv2.IMWRITE_PNG_FILTER_NONE]
    return cv2.imencode(".png", image, options)[1].tobytes()


class _Memory:
    """Semaphore on decoding memory."""

    def __init__(self, n_bytes: int) -> None:
        self._free = n_bytes
        self._changed = Condition()

    @contextmanager
    def given(self, n_bytes: int) -> Iterator[None]:
        with self._changed:
            self._changed.wait_for(lambda: self._free >= n_bytes)
            self._free -= n_bytes
        try:
            yield
        finally:
            with self._changed:
                self._free += n_bytes
                self._changed.notify_all()


_MEMORY = _Memory(MAX_MEMORY)


def _read(stream: BinaryIO, name: str, place: PagePlace | None) -> Image:
    start = stream.read(4)
    if is_tiff(start):
        page = read_page(stream, name, place)
        with _MEMORY.given(_needed(page.header, 2 * page.n_bytes, name)):
            return _in_order(_page(stream, page, name), name)
    stream.seek(0)
    header = read_image_header(stream, name)
    size = stream.seek(0, os.SEEK_END)
    with _MEMORY.given(_needed(header, size, name)):
        stream.seek(0)
        image = grey_image(_decoded(stream.read(size), name), name)
    return _in_order(image, name, header.full_scale)


def _in_order(image: Image, name: str, full_scale: int | None = None) -> Image:
    """Return an image; refuse one whose values have their two bytes exchanged."""
    if image.dtype == np.uint16:
        most, low = int(image.max(initial=0)), int((image & 255).max(initial=0))
        # Of 14 bits or fewer, a high byte that stands in the place of the low is small.
        is_small = 0 < low < 64 and most >= 1 << 14 and np.unique(image).size > 64
        if is_small or most > (full_scale or most):
            raise FileError("image.exchanged-bytes", name=name)
    return image


def _page(stream: BinaryIO, page: TiffPage, name: str) -> Image:
    planes = [
        _decoded(page.file_of_plane(stream, plane), name)
        for plane in range(page.n_planes)
    ]
    # Of planes the order is red, green, blue; OpenCV's is the other way round.
    image = planes[0] if len(planes) < 3 else np.stack(planes[2::-1], axis=-1)
    grey = grey_image(image, name)
    if page.is_inverted:
        grey = np.bitwise_not(grey)
    if page.unused_bits:
        return np.right_shift(grey, page.unused_bits, dtype=np.uint16)
    return grey


def _needed(header: ImageHeader, size: int, name: str) -> int:
    """Return the memory needed to decode bytes of this number, with them."""
    # OpenCV decodes into memory of its own and then copies the image to numpy's.
    needed = size + header.decoded + max(header.decoded, header.working)
    if needed > MAX_MEMORY:
        raise FileError(
            "image.too-much-memory",
            name=name,
            width=header.width,
            height=header.height,
            needed=needed / 1e6,
            most=MAX_MEMORY / 1e6,
        )
    return needed


def _decoded(data: bytes, name: str) -> npt.NDArray[Any]:
    if data.startswith(PNG_SIGNATURE):
        _check_png(data, name)
    elif data.startswith(b"\xff\xd8"):
        _check_jpeg(data, name)
    elif data[:2] in (b"P2", b"P3"):
        data += b"\n"  # which OpenCV needs after the last number
    try:
        image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    except cv2.error as error:
        raise FileError("image.undecodable", name=name, problem=error.err) from error
    if image is None:
        raise damaged_image(name)
    return np.asarray(image)


def grey_image(image: npt.NDArray[Any], name: str | Message) -> Image:
    """Return a decoded image in grey values of 8 or 16 bit, (H, W); refuse others."""
    if image.dtype not in (np.uint8, np.uint16):
        raise FileError("image.value-type", name=name, value_type=str(image.dtype))
    if image.ndim == 2:
        return image
    conversion = {3: cv2.COLOR_BGR2GRAY, 4: cv2.COLOR_BGRA2GRAY}.get(image.shape[2])
    if conversion is None:
        return np.ascontiguousarray(image[..., 0])
    grey: Image = np.asarray(cv2.cvtColor(image, conversion), dtype=image.dtype)
    return grey


def _check_png(data: bytes, name: str) -> None:
    """Check the chunks of a PNG, as the decoder only prints errors.

    It would also unpack what comes after the image, however much that is.
    """
    position = len(PNG_SIGNATURE)
    left = _most_png_data(data)
    for _ in range(MAX_PNG_CHUNKS):
        head = data[position : position + 8]
        if len(head) < 8:
            raise cut_off_image(name)
        length, kind = struct.unpack(">I4s", head)
        body = data[position + 4 : position + 8 + length]
        checksum = data[position + 8 + length : position + 12 + length]
        if len(checksum) < 4:
            raise cut_off_image(name)
        if zlib.crc32(body) != int.from_bytes(checksum, "big"):
            raise FileError("image.wrong-checksum", name=name)
        if kind == b"acTL":
            raise animated_image(name)
        if kind == b"IDAT":
            left -= length
        if left < 0:
            raise damaged_image(name)
        if kind == b"IEND":
            return
        position += 12 + length
    raise damaged_image(name)


def _most_png_data(data: bytes) -> int:
    """Return the largest possible size of a PNG's compressed data, bytes."""
    width, height, depth, colour = map(int, struct.unpack_from(">IIBB", data, 16))
    row = 1 + -(-width * depth * PNG_CHANNELS.get(colour, 4) // 8)
    # What cannot be compressed grows by an eighth at most.
    return height * row * 9 // 8 + PNG_RESERVE


def _check_jpeg(data: bytes, name: str) -> None:
    """Reject a JPEG without a proper end."""
    if data.rfind(b"\xff\xd9") < data.rfind(b"\xff\xda"):
        raise cut_off_image(name)
    n_scans = data.count(b"\xff\xda")
    if n_scans > MAX_SCANS:
        raise FileError(
            "image.too-many-scans", name=name, n_scans=n_scans, most=MAX_SCANS
        )
