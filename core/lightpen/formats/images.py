"""Images from a folder, a pattern or a video, decoded one by one."""

import ctypes
import glob
import re
import struct
import sys
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from lightpen.arrays import Image
from lightpen.errors import FileError
from lightpen.formats.files import read_bytes, unreadable
from lightpen.sentences import Sentence, sentence

SUFFIXES = (".png", ".bmp", ".tif", ".tiff", ".jpg", ".jpeg", ".pgm", ".webp")
VIDEO_SUFFIXES = (".avi", ".mp4", ".mkv", ".mov", ".m4v", ".mpg", ".mpeg", ".webm")
IMAGE_FILE = sentence("file.image", "image")
MAX_FILE_SIZE = 512_000_000  # bytes
MAX_PIXELS = 200_000_000
M_TRIM_THRESHOLD, M_MMAP_THRESHOLD = -1, -3  # of malloc.h
MAX_KEPT_BLOCK = 32 * 2**20  # bytes; the most that malloc takes
MAX_KEPT_MEMORY = 256 * 2**20
IMAGE_FOLDER = "images"
PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"


@dataclass(frozen=True)
class ImageSource:
    """Images to be decoded one by one.

    Attributes
    ----------
    names : tuple of str
        File names, or ``frame 17`` of a video.
    files : tuple of Path
        Files to be hashed as the input: the images, or the video.
    open : callable
        Returns an iterator over loaders, one an image; a loader returns the grey
        image or raises `FileError`.
    """

    names: tuple[str, ...]
    files: tuple[Path, ...]
    open: Callable[[], Iterator[Callable[[], Image]]]


def find_images(*places: str) -> ImageSource:
    """Find the images of a folder, a pattern such as ``swing/*.png``, or a video.

    A folder without images may have them in its subfolder ``images``.

    Parameters
    ----------
    *places : str
        One folder, pattern or video, or several image files, as a shell makes them of
        a pattern. Images are taken in the natural order of their names: 2 before 10.

    Raises
    ------
    FileError
        There is nothing there, or no image, or it may not be looked at.
    """
    if len(places) > 1:
        return image_files(sorted(map(Path, places), key=_natural_order))
    path = Path(places[0])
    try:
        return _images_at(path, places[0])
    except OSError as error:
        raise unreadable(
            path, sentence("file.image-source", "source of images"), error
        ) from error


def image_files(files: list[Path]) -> ImageSource:
    """Return the source of these image files, in their order."""

    def loaders() -> Iterator[Callable[[], Image]]:
        for file in files:
            yield partial(read_image, file)

    return ImageSource(tuple(file.name for file in files), tuple(files), loaders)


def keep_freed_memory() -> None:
    """Let the next image use the memory of the last one (Linux with glibc).

    Blocks as large as an image otherwise go back to the kernel when freed, and come
    anew page by page, zeroed: two fifths of the time that decoding takes.
    """
    if sys.platform != "linux":
        return
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    if mallopt is not None:
        mallopt(M_MMAP_THRESHOLD, MAX_KEPT_BLOCK)
        mallopt(M_TRIM_THRESHOLD, MAX_KEPT_MEMORY)


def read_image(path: Path) -> Image:
    """Read one image file as grey values of 8 or 16 bit.

    The bytes are read first and decoded then: `cv2.imread` fails on names outside
    the code page of Windows.

    Raises
    ------
    FileError
        The file is missing, empty, too large, damaged or no image.
    """
    return decode_image(read_bytes(path, IMAGE_FILE, MAX_FILE_SIZE), path.name)


def decode_image(data: bytes, name: str) -> Image:
    """Decode the bytes of an image file as grey values of 8 or 16 bit, (H, W).

    Raises
    ------
    FileError
        The image is damaged, too large or no image.
    """
    if data.startswith(PNG_SIGNATURE):
        _check_png(data, name)
    try:
        image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    except cv2.error as error:
        raise FileError(
            sentence(
                "image.undecodable",
                "{name} cannot be decoded: {problem}.",
                name=name,
                problem=error.err,
            )
        ) from error
    if image is None:
        raise FileError(
            sentence(
                "image.damaged",
                "{name} is damaged or no image. Capture or copy it again.",
                name=name,
            )
        )
    return _grey(np.asarray(image), name)


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


def _images_at(path: Path, where: str) -> ImageSource:
    if path.is_dir():
        files = _image_files_in(path)
        inner = path / IMAGE_FOLDER
        if not files and inner.is_dir():
            files = _image_files_in(inner)
        if not files:
            raise FileError(
                sentence(
                    "images.empty-folder",
                    "The folder {folder} holds no images ({suffixes}). Name the "
                    "folder that the images are in.",
                    folder=where,
                    suffixes=", ".join(SUFFIXES),
                )
            )
    elif path.is_file():
        if path.suffix.lower() in VIDEO_SUFFIXES:
            return _video(path)
        files = [path]
    else:
        files = [Path(name) for name in glob.glob(where)]  # noqa: PTH207 - any root
        if not files:
            raise FileError(
                sentence(
                    "images.nothing-there",
                    "There is no folder, video or image at {place}. Check the name.",
                    place=where,
                )
            )
    return image_files(sorted(files, key=_natural_order))


def _image_files_in(folder: Path) -> list[Path]:
    return [file for file in folder.iterdir() if file.suffix.lower() in SUFFIXES]


def _grey(image: npt.NDArray[Any], name: str | Sentence) -> Image:
    if image.dtype not in (np.uint8, np.uint16):
        raise FileError(
            sentence(
                "image.value-type",
                "{name} holds values of type {value_type}; grey values of 8 or 16 "
                "bit are needed. Save the images without conversion.",
                name=name,
                value_type=str(image.dtype),
            )
        )
    if image.ndim == 2:
        return image
    conversion = {3: cv2.COLOR_BGR2GRAY, 4: cv2.COLOR_BGRA2GRAY}.get(image.shape[2])
    if conversion is None:
        return np.ascontiguousarray(image[..., 0])
    grey: Image = np.asarray(cv2.cvtColor(image, conversion), dtype=image.dtype)
    return grey


def _video(path: Path) -> ImageSource:
    capture = cv2.VideoCapture(str(path))
    n_frames = int(capture.get(cv2.CAP_PROP_FRAME_COUNT))
    readable = capture.isOpened() and n_frames > 0
    capture.release()
    if not readable:
        raise FileError(
            sentence(
                "image.video",
                "The video {path} cannot be opened, or holds no frames. Check that "
                "it plays, or save its frames as images.",
                path=str(path),
            )
        )

    def loaders() -> Iterator[Callable[[], Image]]:
        stream = cv2.VideoCapture(str(path))
        try:
            for i in range(n_frames):
                good, frame = stream.read()
                yield partial(_frame, frame if good else None, i)
        finally:
            stream.release()

    names = tuple(f"frame {i + 1}" for i in range(n_frames))
    return ImageSource(names, (path,), loaders)


def _frame(frame: npt.NDArray[Any] | None, i: int) -> Image:
    name = sentence("image.frame", "Frame {number} of the video", number=i + 1)
    if frame is None:
        raise FileError(
            sentence("image.frame-undecodable", "{name} cannot be decoded.", name=name)
        )
    return _grey(frame, name)


def _check_png(data: bytes, name: str) -> None:
    """Walk over the chunks of a PNG: the decoder would only print what is wrong."""
    position = len(PNG_SIGNATURE)
    kind = b""
    while kind != b"IEND":
        head = data[position : position + 8]
        if len(head) < 8:
            raise _cut_off(name)
        length, kind = struct.unpack(">I4s", head)
        body = data[position + 4 : position + 8 + length]
        checksum = data[position + 8 + length : position + 12 + length]
        if len(checksum) < 4:
            raise _cut_off(name)
        if zlib.crc32(body) != int.from_bytes(checksum, "big"):
            raise FileError(
                sentence(
                    "image.wrong-checksum",
                    "{name} is damaged (wrong checksum). Capture or copy it again.",
                    name=name,
                )
            )
        if kind == b"IHDR":
            width, height = struct.unpack(">II", body[4:12])
            if width * height > MAX_PIXELS:
                raise FileError(
                    sentence(
                        "image.too-many-pixels",
                        "{name} is {width} x {height} px; at most {most:,} px are "
                        "read. Choose images of the calibrated camera.",
                        name=name,
                        width=width,
                        height=height,
                        most=MAX_PIXELS,
                    )
                )
        position += 12 + length


def _cut_off(name: str) -> FileError:
    return FileError(
        sentence(
            "image.cut-off",
            "{name} is cut off. Capture or copy it again.",
            name=name,
        )
    )


def _natural_order(path: Path) -> list[tuple[int, str]]:
    parts = re.split(r"(\d+)", path.name)
    return [(int(part), "") if part.isdigit() else (-1, part) for part in parts]
