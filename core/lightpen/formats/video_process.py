"""Decode videos in a separate process, on Linux with limited memory.

What a frame of a video takes is known only to its decoder: a stream of H.264 in 3 kB
may say anywhere that its frames are 16000 x 16000 px from here on, and a gigabyte is
requested before anyone can look. A decoder that crashes takes no other process with it.
"""

import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import cv2

from lightpen.arrays import Image
from lightpen.errors import FileError
from lightpen.formats.decoding import grey_image, keep_freed_memory
from lightpen.formats.files import quoted
from lightpen.formats.image_headers import check_pixels, read_image_header
from lightpen.messages import Message, message, printable

if TYPE_CHECKING:
    from multiprocessing.connection import Connection


MAX_VIDEO_FRAMES = 30_000
MAX_VIDEO_PIXELS = 20_000_000  # of a frame; a decoder keeps several
MOTION_JPEG = "MJPG"
UNCOMPRESSED = "\0\0\0\0"  # FFmpeg reports so of most layouts
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
        if stream.isOpened() and codec not in CODECS:
            if codec == UNCOMPRESSED or _is_raw(stream):
                raise FileError("video.uncompressed", path=path)
            raise FileError("video.codec", path=path, codec=quoted(codec))
        n_frames = 0
        while n_frames <= MAX_VIDEO_FRAMES and stream.grab():
            n_frames += 1
            if codec == MOTION_JPEG and _has_ffmpeg():  # each has its own size
                _check_jpeg(stream.retrieve()[1].tobytes(), _name(n_frames))
    finally:
        stream.release()
    decoding = _opened_video(path)  # OpenCV 4.14 has no orientation of frames as stored
    degrees = int(decoding.get(cv2.CAP_PROP_ORIENTATION_META)) % 360
    decoding.release()
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
    # Frames as stored, see `lightpen.formats.images`.
    stream.set(cv2.CAP_PROP_ORIENTATION_AUTO, 0)
    return stream


def _has_ffmpeg() -> bool:
    """Return whether OpenCV has FFmpeg, which the Windows installer leaves out."""
    return bool(cv2.videoio_registry.hasBackend(cv2.CAP_FFMPEG))


def _is_raw(stream: cv2.VideoCapture) -> bool:
    """Return whether the first frames have a byte or more a pixel and one size."""
    sizes = {stream.retrieve()[1].size for _ in range(3) if stream.grab()}
    width = stream.get(cv2.CAP_PROP_FRAME_WIDTH)
    n_pixels = width * stream.get(cv2.CAP_PROP_FRAME_HEIGHT)
    return len(sizes) == 1 and min(sizes) >= n_pixels


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


def limit_memory(more: int) -> None:
    """Limit this process to its present memory plus ``more`` bytes, on Linux.

    Raises `OSError` if the system refuses.
    """
    if sys.platform != "linux":
        return
    import resource

    status = Path("/proc/self/status").read_text("ascii")
    (data,) = (line for line in status.splitlines() if line.startswith("VmData:"))
    most = int(data.split()[1]) * 1024 + more
    _, hard = resource.getrlimit(resource.RLIMIT_DATA)
    if hard == resource.RLIM_INFINITY or most < hard:
        resource.setrlimit(resource.RLIMIT_DATA, (most, hard))


STDERR = 2  # file descriptor, for output of libraries
MAX_DECODER_MEMORY = 300_000_000  # bytes, beyond what Python and OpenCV take


def count_frames(path: Path) -> tuple[int, int]:
    """Return the number of frames of a video, and its turn, degrees; see `videos`.

    Raises `FileError` as there, or if decoding it takes too much memory.
    """
    with _decoder(_send_count, path) as receive:
        counted: tuple[int, int] = receive()
    return counted


def frame_loaders(path: Path, n_frames: int) -> Iterator[Callable[[], Image]]:
    """Yield a loader for each frame; it returns a grey image or raises `FileError`."""
    with _decoder(_send_frames, path, n_frames) as receive:
        for _ in range(n_frames):
            try:
                yield partial(_loaded, receive())
            except FileError as error:
                yield partial(_loaded, error)


@contextmanager
def _decoder(
    send: Callable[..., None], path: Path, *arguments: int
) -> Iterator[Callable[[], Any]]:
    """Start a decoding process; yield a function that receives from it."""
    from multiprocessing import get_context  # 10 ms of a start

    context = get_context("spawn")  # a fork would copy threads that hold locks
    ours, its = context.Pipe(duplex=False)
    process = context.Process(
        target=_serve, args=(its, send, path, *arguments), daemon=True
    )
    process.start()
    its.close()

    def receive() -> Any:
        try:
            what = ours.recv()
        except (EOFError, OSError) as error:  # it crashed
            raise _too_much(path) from error
        if isinstance(what, FileError):
            raise what
        return what

    try:
        yield receive
    finally:
        process.kill()
        process.join()
        process.close()
        ours.close()


def _serve(
    to: "Connection", send: Callable[..., None], path: Path, *arguments: int
) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent gets it and ends this
    with suppress(OSError):  # a program with a window may have no console
        _silence_decoders()
    keep_freed_memory()
    with suppress(OSError):  # a sound video needs no limit
        limit_memory(MAX_DECODER_MEMORY)
    try:
        send(to, path, *arguments)
    except FileError as error:
        to.send(error)
    except (cv2.error, MemoryError):
        to.send(_too_much(path))
    except OSError:  # the other end is closed
        return


def _silence_decoders() -> None:
    """Silence the messages of FFmpeg on the console."""
    sys.stderr = os.fdopen(os.dup(STDERR), "w")
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, STDERR)
    os.close(nowhere)


def _send_count(to: "Connection", path: Path) -> None:
    to.send(count_frames_in_process(path))


def _send_frames(to: "Connection", path: Path, n_frames: int) -> None:
    for load in frame_loaders_in_process(path, n_frames):
        try:
            to.send(load())
        except FileError as error:
            to.send(error)


def _loaded(frame: Image | FileError) -> Image:
    if isinstance(frame, FileError):
        raise frame
    return frame


def _too_much(path: Path) -> FileError:
    return FileError("video.too-much-memory", path=path, most=MAX_DECODER_MEMORY / 1e6)
