"""Images from a folder, a pattern or a video, decoded one by one."""

import glob
import os
import re
import struct
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from io import BytesIO
from pathlib import Path
from threading import Condition
from typing import BinaryIO, TypeVar

import cv2
import numpy as np

from lightpen.arrays import FloatArray, Image
from lightpen.errors import FileError
from lightpen.formats.decoding import (
    IMAGE_FILE,
    MAX_FILE_SIZE,
    TIFF_SUFFIXES,
    keep_freed_memory,
    opened_image,
    read_image,
)
from lightpen.formats.files import HEAD, kind_of, opened, unreadable
from lightpen.formats.image_headers import (
    JPEG_SCAN,
    PNG_SIGNATURE,
    jpeg_segment,
    read_image_header,
)
from lightpen.formats.tiff_pages import PagePlace, is_tiff, page_places, read_page
from lightpen.formats.video_process import count_frames, frame_loaders
from lightpen.messages import Message, message, printable

# Recognise the raw image of a colour camera by the pattern of its filters.
#
# Each pixel of a Bayer mosaic sees one colour, so cells of 2 x 2 pixels repeat a
# pattern: one diagonal is green, on the other are red and blue. Where the colours of
# the light differ, the centre of an LED moves by its place in the pattern. Infrared
# light passes all filters alike; then there is no pattern, and no harm.


LIT = 0.25  # of the range of an image: cells above it are looked at
MIN_CELLS = 50
LEAST_SPREAD = 0.08  # of the mean; uneven columns of a sensor differ by 0.02
SAME = 0.25  # of the spread, that the two green pixels of a cell differ by at most


def is_mosaic(image: Image) -> bool | None:
    """Return whether an image (H, W) is a mosaic; None if too little of it is lit."""
    height, width = (side // 2 for side in image.shape)
    if not height or not width:
        return None
    whole = image[: 2 * height, : 2 * width]
    cells = cv2.resize(whole, (width, height), interpolation=cv2.INTER_AREA)
    dark, bright = float(cells.min()), float(cells.max())
    rows, columns = np.nonzero(cells > dark + LIT * (bright - dark))
    if len(rows) < MIN_CELLS:
        return None
    levels = np.array(
        [
            [whole[2 * rows + i, 2 * columns + j].mean() - dark for j in (0, 1)]
            for i in (0, 1)
        ]
    )
    return _is_pattern(levels)


def _is_pattern(levels: FloatArray) -> bool:
    """Tell from the mean levels (2, 2) of the pixels of a cell."""
    spread = float(np.ptp(levels))
    diagonals = abs(levels[0, 0] - levels[1, 1]), abs(levels[0, 1] - levels[1, 0])
    is_uneven = spread > LEAST_SPREAD * levels.mean()
    return bool(is_uneven and min(diagonals) < SAME * spread)


# Orientation tags of images, which say how a viewer turns the stored pixels.
#
# No tag is applied, whatever the format: intrinsics are of the sensor, and cameras
# store what it reads. A program that turned the pixels when it saved them may have left
# a tag behind, so images with one are reported.
#
# References
# ----------
# .. [1] CIPA DC-008, "Exchangeable image file format", 4.6.4, tag Orientation.


MAX_PARTS = 30_000  # segments or chunks before the tag
LARGEST_EXIF = 2**16  # bytes
MOST_CAMERAS = 8
SHARED = 0.5  # of the numbers of images, that those of several cameras share

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


def cameras_remark(files: Sequence[Path]) -> Message | None:
    """Return a remark on files that seem to be of several cameras, by their names."""
    for number in (r"(?a)\d+(?=\D*$)", r"(?a)\d+"):  # the last, or the first
        series: dict[str, dict[int, str]] = {}
        for file in files:
            if found := re.search(number, file.stem):
                others = file.stem[: found.start()] + file.stem[found.end() :]
                series.setdefault(others, {})[int(found[0])] = file.name
        each = sorted(series.values(), key=len)
        if not 1 < len(each) <= MOST_CAMERAS:
            continue
        n_shared = len(set.intersection(*map(set, each)))
        # Milliseconds at the end of names are no numbers of images.
        span = max(each[-1]) - min(each[-1])
        if n_shared > max(SHARED * len(each[-1]), 2) and span < 2 * len(each[-1]):
            first, second = (each[i][min(each[i])] for i in (0, 1))
            return message(
                "images.several-cameras",
                n_series=len(each),
                first=printable(min(first, second)),
                second=printable(max(first, second)),
            )
    return None


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
        marker, length = jpeg_segment(stream, "")
        if marker == JPEG_SCAN:
            return
        content = stream.read(length)
        if marker == 0xE1:
            yield content


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


class MemoryRoom:
    """Limits the threads that decode at once by the memory they need, bytes.

    One thread is always admitted.
    """

    def __init__(self, budget: int) -> None:
        self._budget = budget
        self._changed = Condition()
        self._n = 0
        self._largest: int | None = None

    @contextmanager
    def one(self) -> Iterator[None]:
        """Wait for memory, and hold it for one image."""
        with self._changed:
            self._changed.wait_for(self._has_room)
            self._n += 1
        try:
            yield
        finally:
            with self._changed:
                self._n -= 1
                self._changed.notify_all()

    def note(self, n_bytes: int) -> None:
        """Record the memory that an image needed."""
        with self._changed:
            self._largest = max(n_bytes, self._largest or 0)
            self._changed.notify_all()

    def _has_room(self) -> bool:
        if self._n == 0:
            return True
        largest = self._largest
        return largest is not None and (self._n + 1) * largest <= self._budget


SUFFIXES = (
    *TIFF_SUFFIXES,
    *(".png", ".bmp", ".jpg", ".jpeg", ".jpe", ".jfif", ".webp"),
    *(".pgm", ".pnm", ".ppm", ".pbm"),
)
VIDEO_SUFFIXES = (
    *(".avi", ".mp4", ".mkv", ".mov", ".m4v", ".mpg", ".mpeg", ".webm"),
    *(".mjpeg", ".mjpg", ".ts", ".mts", ".m2ts", ".wmv", ".flv", ".y4m", ".3gp"),
    *(".ogv", ".mxf", ".vob", ".f4v", ".h264", ".264", ".h265", ".hevc"),
)
IMAGE_FOLDER = "images"
SAID = 5  # files or folders in a folder without images that are looked at
IN_FLIGHT = 4  # images per thread that may wait in memory
LOOKED_AT_FIRST = 4  # images, whether they are raw ones of a colour camera
WORK_MEMORY = 250_000_000  # bytes that all threads take

Seen = TypeVar("Seen")


@dataclass(frozen=True)
class ImageSource:
    """Images to be decoded one by one."""

    names: tuple[str, ...]  # file names, or ``frame 17`` of a video
    files: tuple[Path, ...]  # files to be hashed as the input: the images, or the video
    open: Callable[[], Iterator[Callable[[], Image]]]  # one loader an image
    # Brightest value that a pixel can have, if stated; else levels of each image show
    # it, see `lightpen.formats.decoding.full_scale_of`.
    full_scale: int | None = None
    # Returns what is to be said of the files, such as their orientation tags.
    remark: Callable[[], Message | None] = lambda: None

    def of_bits(self, bits: int | None) -> "ImageSource":
        """Return these images of a stated bit depth, if it is stated."""
        if bits is None:
            return self

        def loaders() -> Iterator[Callable[[], Image]]:
            for name, load in zip(self.names, self.open(), strict=True):
                yield partial(_right_aligned, load, name, bits)

        return replace(self, open=loaders, full_scale=2**bits - 1)


def _right_aligned(load: Callable[[], Image], name: str, bits: int) -> Image:
    """Return an image with its bits at the low end, whichever its file has them at.

    Raises `FileError` if it has more of them.
    """
    image = load()
    top = int(image.max(initial=0))
    if top < 2**bits:
        return image
    depth = 8 * image.itemsize
    aligned = np.right_shift(image, depth - bits, dtype=image.dtype)
    if top < 2 ** (depth - 2):
        # At the high end, one level is left one; these, lower, are merged if too deep.
        n_levels, n_left = (np.unique(each[::2, ::2]).size for each in (image, aligned))
        if n_left < n_levels:
            raise FileError("image.more-bits", name=printable(name), top=top, bits=bits)
    return aligned


def look_at_all(
    source: ImageSource,
    look: Callable[[Callable[[], Image]], Seen],
    memory_a_pixel: int,
    n_threads: int | None = None,
) -> Iterator[Seen]:
    """Process all images in threads; yield the results in order.

    Images are released at once; processing runs a few images ahead. ``look`` takes the
    loader of an image; an exception ends the processing. ``memory_a_pixel``, bytes,
    limits the threads by `WORK_MEMORY`; they are at most as many as there are
    processors. Raises `FileError` if the first images are raw ones of a colour camera.
    """
    keep_freed_memory()
    room = MemoryRoom(WORK_MEMORY)
    mosaics: list[bool] = []  # of the first images

    def look_in_room(load: Callable[[], Image]) -> Seen:
        def loaded() -> Image:
            image = load()
            room.note(memory_a_pixel * image.size)
            if (
                len(mosaics) < LOOKED_AT_FIRST
                and (found := is_mosaic(image)) is not None
            ):
                mosaics.append(found)
            return image

        with room.one():
            return look(loaded)

    n_threads = n_threads or os.cpu_count() or 1
    with ThreadPoolExecutor(n_threads) as executor:
        waiting: deque[Future[Seen]] = deque()
        for load in source.open():
            waiting.append(executor.submit(look_in_room, load))
            if len(waiting) >= IN_FLIGHT * n_threads:
                yield waiting.popleft().result()
                _require_no_mosaics(mosaics, source)
        while waiting:
            yield waiting.popleft().result()
            _require_no_mosaics(mosaics, source)


def _require_no_mosaics(first: list[bool], source: ImageSource) -> None:
    if len(first) >= min(LOOKED_AT_FIRST, len(source.names)) and all(first):
        raise FileError("image.mosaic", name=printable(source.names[0]))


def find_images(*places: str) -> ImageSource:
    """Find the images of a folder, a pattern such as ``swing/*.png``, or a video.

    A folder without images may have them in its subfolder ``images``. Several places
    are image files, as a shell makes them of a pattern. Images are taken in the natural
    order of their names: 2 before 10.
    """
    if len(places) > 1:
        return image_files(sorted(map(Path, places), key=_by_name))
    path = Path(places[0])
    try:
        return _images_at(path, places[0])
    except OSError as error:
        raise unreadable(path, message("file.image-source"), error) from error


def image_files(files: list[Path]) -> ImageSource:
    """Return the source of these image files, in their order, with all their pages."""
    pages: list[tuple[Path, PagePlace | FileError | None]] = []
    names: list[str] = []
    for file in files:
        places = _pages(file)
        pages += [(file, place) for place in places]
        numbered = [f"{file.stem} page {i + 1}" for i in range(len(places))]
        names += numbered if len(places) > 1 else [file.name]

    def loaders() -> Iterator[Callable[[], Image]]:
        for file, place in pages:
            yield partial(_page, file, place)

    return ImageSource(
        tuple(names),
        tuple(files),
        loaders,
        _stated_full_scale(files),
        lambda: cameras_remark(files) or orientation_remark(tuple(files)),
    )


def _pages(file: Path) -> Sequence[PagePlace | FileError | None]:
    """Return the pages of a TIFF, or its fault; None for the image of other formats."""
    try:
        with opened_image(file) as stream:
            is_stack = is_tiff(stream.read(4))
            return page_places(stream, file.name) if is_stack else [None]
    except FileError as error:
        return [error]


def _page(file: Path, page: PagePlace | FileError | None) -> Image:
    if isinstance(page, FileError):
        raise page
    return read_image(file, page)


def _stated_full_scale(files: list[Path]) -> int | None:
    """Return the full scale that the first file states, if it is readable."""
    if not files or files[0].suffix.lower() not in (".pgm", ".pnm", ".ppm"):
        return None
    try:
        with opened(files[0], IMAGE_FILE, MAX_FILE_SIZE) as stream:
            return read_image_header(stream, files[0].name).full_scale
    except FileError:
        return None


def natural_order(name: str) -> list[tuple[int, str]]:
    """Return a sort key with numbers in numeric order: 2 before 10."""
    parts = re.split(r"(?a:(\d+))", name)  # text and digits take turns
    return [(int(part), "") if i % 2 else (-1, part) for i, part in enumerate(parts)]


def _images_at(path: Path, where: str) -> ImageSource:
    if path.is_dir():
        files = _image_files_in(path)
        inner = path / IMAGE_FOLDER
        if not files and inner.is_dir():
            files = _image_files_in(inner)
        if not files:
            raise _without_images(path, where)
    elif path.is_file():
        if path.suffix.lower() in VIDEO_SUFFIXES:
            return _video(path)
        files = [path]
    else:
        files = [Path(name) for name in glob.glob(where)]  # noqa: PTH207 - any root
        if not files:
            raise FileError("images.nothing-there", place=printable(where))
    return image_files(sorted(files, key=_by_name))


def _without_images(folder: Path, where: str) -> FileError:
    """Return the error that names what a folder has instead of images."""
    inside = sorted(folder.iterdir())
    others = [file for file in inside if file.is_file()]
    if inside and not others:
        inner = ", ".join(printable(each.name) for each in inside[:SAID])
        return FileError("images.only-folders", folder=printable(where), inner=inner)
    if not others:
        return FileError("images.empty-folder", folder=printable(where))
    name, kind = others[0].name, others[0].suffix or "?"
    for file in reversed(others[:SAID]):
        with file.open("rb") as stream:
            if known := kind_of(stream.read(HEAD), file.name):
                name, kind = file.name, known
    return FileError(
        "images.only-others",
        folder=printable(where),
        count=len(others),
        name=printable(name),
        kind=kind,
    )


def _image_files_in(folder: Path) -> list[Path]:
    files = [file for file in folder.iterdir() if file.suffix.lower() in SUFFIXES]
    hidden = ".~"  # or open in another program
    return [file for file in files if file.name[0] not in hidden and not file.is_dir()]


def _video(path: Path) -> ImageSource:
    n_frames, degrees = count_frames(path)
    names = tuple(f"frame {i + 1}" for i in range(n_frames))
    turned = message("video.orientation", name=printable(path.name), degrees=degrees)
    return ImageSource(
        names,
        (path,),
        partial(frame_loaders, path, n_frames),
        remark=lambda: turned if degrees else None,
    )


def _by_name(path: Path) -> list[tuple[int, str]]:
    return natural_order(path.name)
