"""Images from a folder, a pattern or a video, decoded one by one."""

import glob
import os
import re
from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from threading import Condition
from typing import TypeVar

from lightpen.arrays import Image
from lightpen.errors import FileError
from lightpen.formats.decoding import (
    IMAGE_FILE,
    MAX_FILE_SIZE,
    TIFF_SUFFIXES,
    keep_freed_memory,
    opened_image,
    read_image,
)
from lightpen.formats.files import opened, unreadable
from lightpen.formats.image_headers import read_image_header
from lightpen.formats.mosaic import is_mosaic
from lightpen.formats.orientation import orientation_remark
from lightpen.formats.tiff_pages import PagePlace, is_tiff, page_places
from lightpen.formats.video_process import count_frames, frame_loaders
from lightpen.messages import Message, message, printable


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


SUFFIXES = (*TIFF_SUFFIXES, ".png", ".bmp", ".jpg", ".jpeg", ".pgm", ".webp")
VIDEO_SUFFIXES = (".avi", ".mp4", ".mkv", ".mov", ".m4v", ".mpg", ".mpeg", ".webm")
IMAGE_FOLDER = "images"
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
        return self if bits is None else replace(self, full_scale=2**bits - 1)


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
    pages = [(file, place) for file in files for place in _pages(file)]
    n_pages = Counter(file for file, _ in pages)
    numbers: Counter[Path] = Counter()
    names = []
    for file, _ in pages:
        numbers[file] += 1
        page = f"{file.stem} page {numbers[file]}"
        names.append(file.name if n_pages[file] == 1 else page)

    def loaders() -> Iterator[Callable[[], Image]]:
        for file, place in pages:
            yield partial(_page, file, place)

    return ImageSource(
        tuple(names),
        tuple(files),
        loaders,
        _stated_full_scale(files),
        partial(orientation_remark, tuple(files)),
    )


def _pages(file: Path) -> Sequence[PagePlace | FileError | None]:
    """Return the pages of a TIFF, or its fault; None for the image of other formats."""
    if file.suffix.lower() not in TIFF_SUFFIXES:
        return [None]
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
    if not files or files[0].suffix.lower() != ".pgm":
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
            raise FileError(
                "images.empty-folder",
                folder=printable(where),
                suffixes=", ".join(SUFFIXES),
            )
    elif path.is_file():
        if path.suffix.lower() in VIDEO_SUFFIXES:
            return _video(path)
        files = [path]
    else:
        files = [Path(name) for name in glob.glob(where)]  # noqa: PTH207 - any root
        if not files:
            raise FileError("images.nothing-there", place=printable(where))
    return image_files(sorted(files, key=_by_name))


def _image_files_in(folder: Path) -> list[Path]:
    return [file for file in folder.iterdir() if file.suffix.lower() in SUFFIXES]


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
