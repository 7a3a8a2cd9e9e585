"""Count and decode the frames of a video in this process."""

from collections.abc import Callable, Iterator
from functools import partial
from io import BytesIO
from pathlib import Path

import cv2

from lightpen.arrays import Image
from lightpen.errors import FileError
from lightpen.formats.decoding import grey_image
from lightpen.formats.files import quoted
from lightpen.formats.image_headers import check_pixels, read_image_header
from lightpen.messages import Message, message, printable

MAX_VIDEO_FRAMES = 30_000
MAX_VIDEO_PIXELS = 20_000_000  # of a frame; a decoder keeps several
MOTION_JPEG = "MJPG"
UNCOMPRESSED = "\0\0\0\0"  # FFmpeg reports so whatever layout its header names
# Anything else FFmpeg may take for raw pixels, of a layout that it has not.
CODECS = frozenset(
    {
        *(MOTION_JPEG, "FFV1", "HFYU", "FFVH", "H264", "AVC1", "HEVC", "HEV1", "HVC1"),
        *("MP4V", "FMP4", "XVID", "DIVX", "DX50", "MPG1", "MPG2", "PIM1", "PIM2"),
        *("VP80", "VP90", "VP08", "VP09", "AV01"),
    }
)


def count_frames_in_process(path: Path) -> tuple[int, int]:
    """Return the number of frames of a video, not trusting its header, and its turn.

    The turn is what a player makes of the frames by the header, degrees.

    They are counted as they come, not decoded; too long or too large a video is
    refused.
    """
    stream = _opened_video(path, cv2.CAP_PROP_FORMAT, -1)
    try:
        check_pixels(
            int(stream.get(cv2.CAP_PROP_FRAME_WIDTH)),
            int(stream.get(cv2.CAP_PROP_FRAME_HEIGHT)),
            printable(path.name),
            MAX_VIDEO_PIXELS,
        )
        codec = _codec(stream)
        degrees = int(stream.get(cv2.CAP_PROP_ORIENTATION_META)) % 360
        if stream.isOpened() and codec == UNCOMPRESSED:
            raise FileError("video.uncompressed", path=path)
        if stream.isOpened() and codec not in CODECS:
            raise FileError("video.codec", path=path, codec=quoted(codec))
        n_frames = 0
        while n_frames <= MAX_VIDEO_FRAMES and stream.grab():
            n_frames += 1
            if codec == MOTION_JPEG and _has_ffmpeg():  # each has its own size
                _check_jpeg(stream.retrieve()[1].tobytes(), _name(n_frames))
    finally:
        stream.release()
    if n_frames == 0 and not _has_ffmpeg():
        raise FileError("video.motion-jpeg-only", path=path)
    if n_frames == 0:
        raise FileError("image.video", path=path)
    if n_frames > MAX_VIDEO_FRAMES:
        raise FileError("video.too-many-frames", path=path, most=MAX_VIDEO_FRAMES)
    return n_frames, degrees


def frame_loaders_in_process(
    path: Path, n_frames: int
) -> Iterator[Callable[[], Image]]:
    """Yield a loader for each frame; it returns a grey image or raises `FileError`."""
    stream = _opened_video(path)
    try:
        for i in range(n_frames):
            name = _name(i + 1)
            good, frame = stream.read()
            yield partial(_frame, grey_image(frame, name) if good else None, name)
    finally:
        stream.release()


def _opened_video(path: Path, *parameters: int) -> cv2.VideoCapture:
    try:
        name = str(path)
        name.encode()
    except UnicodeEncodeError as error:  # OpenCV would crash
        raise FileError("video.path", path=path) from error
    # Other backends than these two take a name for a pattern, or for a description of a
    # pipeline.
    if not _has_ffmpeg():
        return cv2.VideoCapture(name, cv2.CAP_OPENCV_MJPEG)
    # One thread: each takes the memory of some frames.
    stream = cv2.VideoCapture(
        name, cv2.CAP_FFMPEG, [cv2.CAP_PROP_N_THREADS, 1, *parameters]
    )
    # Frames as stored, see `lightpen.formats.orientation`.
    stream.set(cv2.CAP_PROP_ORIENTATION_AUTO, 0)
    return stream


def _has_ffmpeg() -> bool:
    """Return whether OpenCV has FFmpeg, which the Windows installer leaves out."""
    return bool(cv2.videoio_registry.hasBackend(cv2.CAP_FFMPEG))


def _codec(stream: cv2.VideoCapture) -> str:
    code = int(stream.get(cv2.CAP_PROP_FOURCC)) & 0xFFFFFFFF
    return code.to_bytes(4, "little").decode("latin-1").upper()


def _check_jpeg(data: bytes, name: Message) -> None:
    header = read_image_header(BytesIO(data), name)
    check_pixels(header.width, header.height, name, MAX_VIDEO_PIXELS)


def _name(number: int) -> Message:
    return message("image.frame", number=number)


def _frame(frame: Image | None, name: Message) -> Image:
    if frame is None:
        raise FileError("image.frame-undecodable", name=name)
    return frame
