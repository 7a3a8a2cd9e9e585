"""Images from a folder, a pattern or a video, decoded one by one."""

import glob
import os
import re
from collections import deque
from collections.abc import Callable, Iterator
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
    keep_freed_memory,
    read_image,
)
from lightpen.formats.files import opened, unreadable
from lightpen.formats.image_headers import read_image_header
from lightpen.formats.video_process import count_frames, frame_loaders
from lightpen.messages import message, printable


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


SUFFIXES = (".png", ".bmp", ".tif", ".tiff", ".jpg", ".jpeg", ".pgm", ".webp")
VIDEO_SUFFIXES = (".avi", ".mp4", ".mkv", ".mov", ".m4v", ".mpg", ".mpeg", ".webm")
IMAGE_FOLDER = "images"
IN_FLIGHT = 4  # images per thread that may wait in memory
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
    processors.
    """
    keep_freed_memory()
    room = MemoryRoom(WORK_MEMORY)

    def look_in_room(load: Callable[[], Image]) -> Seen:
        def loaded() -> Image:
            image = load()
            room.note(memory_a_pixel * image.size)
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
        while waiting:
            yield waiting.popleft().result()


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
    """Return the source of these image files, in their order."""

    def loaders() -> Iterator[Callable[[], Image]]:
        for file in files:
            yield partial(read_image, file)

    names = tuple(file.name for file in files)
    return ImageSource(names, tuple(files), loaders, _stated_full_scale(files))


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
    n_frames = count_frames(path)
    names = tuple(f"frame {i + 1}" for i in range(n_frames))
    return ImageSource(names, (path,), partial(frame_loaders, path, n_frames))


def _by_name(path: Path) -> list[tuple[int, str]]:
    return natural_order(path.name)
