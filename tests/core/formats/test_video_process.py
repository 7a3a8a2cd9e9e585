"""Videos are decoded in a process of their own, with a limit to its memory."""

import os
import struct
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import cv2
import numpy as np
import pytest

from lightpen.errors import FileError
from lightpen.formats.video_process import count_frames, frame_loaders

MEASURED = """
import resource, sys
from pathlib import Path
from lightpen.errors import FileError
from lightpen.formats.video_process import count_frames, frame_loaders
if __name__ == "__main__":
    path = Path(sys.argv[1])
    try:
        for load in frame_loaders(path, count_frames(path)[0]):
            load()
    except FileError as error:
        print(error)
    print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss // 1000)
"""


def exponential_golomb(number: int) -> str:
    return "0" * ((number + 1).bit_length() - 1) + f"{number + 1:b}"


def unit_of_h264(kind: int, bits: str) -> bytes:
    """Return a unit of a stream with its start code; see ITU-T H.264, 7.3.1."""
    bits += "1" + "0" * (-(len(bits) + 1) % 8)
    unit = bytearray()
    for start in range(0, len(bits), 8):
        byte = int(bits[start : start + 8], 2)
        if unit[-2:] == b"\0\0" and byte <= 3:
            unit.append(3)
        unit.append(byte)
    return b"\0\0\0\1" + bytes([kind]) + bytes(unit)


def frame_of_h264(side: int) -> bytes:
    """Return a key frame of so many px in a square, of which most is missing."""
    blocks = exponential_golomb(side // 16 - 1)
    zero = exponential_golomb(0)
    sizes = f"{66:08b}" + "11000000" + f"{62:08b}"
    sizes += 4 * zero + exponential_golomb(1) + "0" + 2 * blocks + "1100"
    picture = 2 * zero + "00" + 3 * zero + "000" + 3 * zero + "000"
    block = zero + exponential_golomb(7) + zero + "0000" + zero + "0000" + "00" + zero
    noise = np.random.default_rng(0).integers(0, 2, 4000)
    return (
        unit_of_h264(0x67, sizes)
        + unit_of_h264(0x68, picture)
        + unit_of_h264(0x65, block + "".join(map(str, noise)))
    )


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="the limit is one of Linux")
@pytest.mark.parametrize("n_small", [0, 40], ids=["at once", "later"])
def test_frames_larger_than_those_of_cameras_do_not_fill_the_memory(
    n_small: int, tmp_path: Path
) -> None:
    path = tmp_path / "swing.mp4"
    path.write_bytes(n_small * frame_of_h264(64) + 4 * frame_of_h264(16_000))
    program = tmp_path / "measured.py"
    program.write_text(MEASURED, encoding="utf-8")

    done = subprocess.run(
        [sys.executable, program, path], capture_output=True, text=True, check=True
    )

    assert int(done.stdout.split()[-1]) < 450  # 1250 without


def test_a_decoder_that_is_gone_is_reported(tmp_path: Path) -> None:
    path = tmp_path / "swing.avi"
    code = cv2.VideoWriter.fourcc(*"MJPG")
    writer = cv2.VideoWriter(str(path), cv2.CAP_FFMPEG, code, 20.0, (640, 480))
    noise = np.random.default_rng(0).integers(0, 255, (480, 640, 3), dtype=np.uint8)
    for _ in range(20):
        writer.write(noise)
    writer.release()
    before = children()
    loaders = frame_loaders(path, count_frames(path)[0])
    first = next(loaders)()
    (decoder,) = children() - before
    os.kill(decoder, 9)
    rest = list(loaders)

    assert first.shape == (480, 640)
    assert len(rest) == 19
    with pytest.raises(FileError, match=r"swing\.avi cannot be decoded within 300 MB"):
        rest[-1]()


def children() -> set[int]:
    """Return the processes that Python started and that were not waited for."""
    from multiprocessing import active_children

    return {process.pid for process in active_children() if process.pid is not None}


def test_what_a_decoder_says_of_a_damaged_video_is_not_on_the_console(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    rng = np.random.default_rng(0)
    path = tmp_path / "swing.mp4"
    codec = cv2.VideoWriter.fourcc(*"mp4v")
    writer = cv2.VideoWriter(str(path), codec, 20.0, (320, 240), isColor=False)
    for _ in range(10):
        writer.write(rng.integers(256, size=(240, 320), dtype=np.uint8))
    writer.release()
    data = bytearray(path.read_bytes())
    data[len(data) // 3 : len(data) // 3 + 1000] = bytes(1000)
    path.write_bytes(data)
    for load in frame_loaders(path, count_frames(path)[0]):
        with suppress(FileError):
            load()
    path.write_bytes(b"no video")
    with pytest.raises(FileError):
        count_frames(path)

    assert capfd.readouterr().err == ""


def test_the_turn_that_a_header_asks_for_is_counted(tmp_path: Path) -> None:
    path = tmp_path / "turned.mp4"
    video = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"mp4v"), 20, (64, 48))
    video.write(np.zeros((48, 64, 3), np.uint8))
    video.release()
    data = path.read_bytes()
    matrix = data.index(b"tkhd") + 44
    turned = struct.pack(">9i", 0, 65536, 0, -65536, 0, 0, 0, 0, 2**30)
    path.write_bytes(data[:matrix] + turned + data[matrix + 36 :])

    assert count_frames(path) == (1, 90)
