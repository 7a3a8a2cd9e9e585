"""Damaged files through every reader: each is read or rejected in time.

Usage: python benchmarks/hostile_files.py [N_FILES [FIRST_SEED]]

Camera, pen, centre and pose files, images and videos of all formats are spoiled at
random and given to their readers. Whatever happens, they may only return or raise
`LightpenError`, within a second and without more memory than a good file takes.
"""

import json
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.calibrate_images import peak_memory
from benchmarks.mutations import mutated
from benchmarks.rows import Row

from lightpen.errors import FileError, LightpenError
from lightpen.formats.camera_files import read_camera
from lightpen.formats.decoding import read_image
from lightpen.formats.observation_files import read_centers, read_poses
from lightpen.formats.pen_files import read_pen, read_raw_pen, write_pen
from lightpen.formats.rig_files import write_camera
from lightpen.formats.video_process import (
    count_frames_in_process,
    frame_loaders_in_process,
)
from lightpen_extensions.simulator.swings import paper_camera, paper_pen

N_FILES = 20_000
SEED = 1
MOST_SECONDS = 1.0
MOST_MEMORY = 500.0  # MB

Reader = Callable[[Path], object]


@dataclass(frozen=True)
class Sample:
    """A good file and what reads it."""

    name: str
    data: bytes
    read: Reader


@dataclass(frozen=True)
class Ending:
    """What became of a spoiled file.

    Attributes
    ----------
    outcome : str
        "read", "refused", or what else was raised.
    seconds : float
        Of the processor.
    """

    sample: str
    seed: int
    outcome: str
    seconds: float

    @property
    def is_right(self) -> bool:
        """Whether it was read, or refused in words."""
        return self.outcome in ("read", "refused")


def samples(folder: Path) -> list[Sample]:
    """Return good files of every kind, written into a folder."""
    return [
        *_camera_samples(folder),
        *_pen_samples(folder),
        *_table_samples(),
        *_image_samples(),
        *_video_samples(folder),
    ]


def spoiled(good: list[Sample], folder: Path, seed: int) -> Ending:
    """Spoil one of the good files, by the seed, and read it."""
    rng = np.random.default_rng([SEED, seed])
    sample = good[int(rng.integers(len(good)))]
    path = folder / sample.name
    path.unlink(missing_ok=True)  # a disk takes long to empty a file for another
    path.write_bytes(mutated(sample.data, rng))
    start = time.process_time()
    try:
        sample.read(path)
    except LightpenError as error:
        outcome = "refused" if str(error) else "refused without words"
    except BaseException as error:
        outcome = repr(error)
    else:
        outcome = "read"
    return Ending(sample.name, seed, outcome, time.process_time() - start)


def _camera_samples(folder: Path) -> Iterator[Sample]:
    rng = np.random.default_rng(0)
    root = rng.normal(size=(9, 9))
    camera = replace(paper_camera(), covariance=root @ root.T)
    path = folder / "camera.yaml"
    write_camera(camera, path)
    opencv = path.read_bytes()
    yield Sample("opencv.yaml", opencv, read_camera)
    ros = opencv.replace(b"%YAML:1.0\n---\n", b"distortion_model: plumb_bob\n")
    ros = ros.replace(b" !!opencv-matrix", b"").replace(b"   dt: d\n", b"")
    yield Sample("ros.yaml", ros, read_camera)
    matrix, distortion = camera.matrix, camera.distortion
    storage = cv2.FileStorage(".xml", cv2.FILE_STORAGE_WRITE | cv2.FILE_STORAGE_MEMORY)
    storage.write("image_width", camera.width)
    storage.write("image_height", camera.height)
    storage.write("camera_matrix", matrix)
    storage.write("distortion_coefficients", distortion)
    yield Sample("opencv.xml", storage.releaseAndGetString().encode(), read_camera)
    kalibr = (
        "cam0:\n  camera_model: pinhole\n  distortion_model: radtan\n"
        f"  distortion_coeffs: {distortion[:4].tolist()}\n"
        f"  intrinsics: {[camera.fx, camera.fy, camera.cx, camera.cy]}\n"
        f"  resolution: [{camera.width}, {camera.height}]\n"
    )
    yield Sample("kalibr.yaml", kalibr.encode(), read_camera)
    matlab = {
        "ImageSize": [camera.height, camera.width],
        "FocalLength": [camera.fx, camera.fy],
        "PrincipalPoint": [camera.cx, camera.cy],
        "RadialDistortion": [-0.08, 0.1],
        "TangentialDistortion": [0.0, 0.0],
    }
    yield Sample("matlab.json", json.dumps(matlab).encode(), read_camera)


def _pen_samples(folder: Path) -> Iterator[Sample]:
    for suffix in ("csv", "json"):
        path = folder / f"pen.{suffix}"
        write_pen(replace(paper_pen(), name="", nominal_tip=None), path)
        yield Sample(f"leds.{suffix}", path.read_bytes(), read_pen)
        yield Sample(f"raw.{suffix}", path.read_bytes(), read_raw_pen)
        yield Sample(
            f"bare.{suffix}",
            path.read_bytes().replace(b"_mm", b""),
            partial(read_pen, units="mm"),
        )


def _table_samples() -> Iterator[Sample]:
    rng = np.random.default_rng(1)
    centers = "frame,led,x_px,y_px\n" + "".join(
        f"{frame},{led},{rng.uniform(0, 2448):.4f},{rng.uniform(0, 2048):.4f}\n"
        for frame in range(20)
        for led in range(1, 11)
    )
    yield Sample("centers.csv", centers.encode(), partial(read_centers, n_leds=10))
    semicolons = centers.replace(",", ";").replace(".", ",")
    yield Sample("comma.csv", semicolons.encode(), partial(read_centers, n_leds=10))
    pose = "1,0,0,0,1,0,0,0,1"
    rows = [f"{pose},{rng.normal():.4f},2,{1000 + i}" for i in range(15)]
    yield Sample("poses.csv", "\n".join(rows).encode(), read_poses)


def _image_samples() -> Iterator[Sample]:
    rng = np.random.default_rng(2)
    grey = rng.integers(0, 255, (48, 64), dtype=np.uint8)
    deep = rng.integers(0, 65535, (48, 64), dtype=np.uint16)
    colour = rng.integers(0, 255, (48, 64, 3), dtype=np.uint8)
    clear = rng.integers(0, 65535, (48, 64, 4), dtype=np.uint16)
    images: list[tuple[str, Any, list[int]]] = [
        ("grey.png", grey, []),
        ("deep.png", deep, []),
        ("colour.png", colour, []),
        ("clear.png", clear, []),
        ("grey.jpg", grey, []),
        ("colour.jpg", colour, [cv2.IMWRITE_JPEG_PROGRESSIVE, 1]),
        ("grey.bmp", grey, []),
        ("colour.bmp", colour, []),
        ("grey.tif", grey, [cv2.IMWRITE_TIFF_COMPRESSION, 1]),
        ("deep.tif", deep, [cv2.IMWRITE_TIFF_COMPRESSION, 5]),
        ("clear.tif", clear, [cv2.IMWRITE_TIFF_COMPRESSION, 8]),
        ("deep.pgm", deep, []),
        ("text.pgm", grey, [cv2.IMWRITE_PXM_BINARY, 0]),
        ("colour.webp", colour, [cv2.IMWRITE_WEBP_QUALITY, 101]),
        ("lossy.webp", colour, [cv2.IMWRITE_WEBP_QUALITY, 50]),
    ]
    for name, image, options in images:
        data = cv2.imencode(Path(name).suffix, image, options)[1].tobytes()
        yield Sample(name, data, read_image)


def _video_samples(folder: Path) -> Iterator[Sample]:
    frame = np.random.default_rng(3).integers(0, 255, (48, 64, 3), dtype=np.uint8)
    for name, code in (
        ("jpeg.avi", "MJPG"),
        ("exact.avi", "FFV1"),
        ("mpeg.mp4", "mp4v"),
    ):
        path = folder / f"good-{name}"
        writer = cv2.VideoWriter(
            str(path), cv2.CAP_FFMPEG, cv2.VideoWriter.fourcc(*code), 20.0, (64, 48)
        )
        for shift in range(6):
            writer.write(np.roll(frame, shift, axis=1))
        writer.release()
        yield Sample(name, path.read_bytes(), _read_video)


def _read_video(path: Path) -> None:
    for load in frame_loaders_in_process(path, count_frames_in_process(path)[0]):
        try:
            load()
        except FileError:
            continue


def hostile_file_rows() -> list[Row]:
    """Return what became of `N_FILES` spoiled files, read in a process of its own."""
    command = [sys.executable, __file__, str(N_FILES)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:  # it may have crashed, too
        return [Row(f"{N_FILES} spoiled files", done.stdout[-200:], "read", met=False)]
    counters = json.loads(done.stdout.splitlines()[-1])
    n_right = counters["read"] + counters["refused"]
    return [
        Row(
            "damaged files of every kind: loaded, or rejected with a message",
            f"{n_right} of {N_FILES}",
            "all",
            met=n_right == N_FILES,
        ),
        Row(
            "- the longest",
            f"{counters['seconds']:.2f} s",
            f"{MOST_SECONDS:.0f} s",
            met=counters["seconds"] <= MOST_SECONDS,
        ),
        Row(
            "- memory at most",
            f"{counters['memory']:.0f} MB",
            f"{MOST_MEMORY:.0f} MB",
            met=counters["memory"] <= MOST_MEMORY,
        ),
    ]


def main() -> int:
    """Spoil files and print what became of them; return the exit status."""
    n_files = int(sys.argv[1]) if len(sys.argv) > 1 else N_FILES
    first = int(sys.argv[2]) if len(sys.argv) > 2 else 0
    cv2.setNumThreads(1)
    outcomes: Counter[str] = Counter({"read": 0, "refused": 0})
    longest = 0.0
    with tempfile.TemporaryDirectory(prefix="lightpen-hostile-") as folder:
        good = samples(Path(folder))
        for seed in range(first, first + n_files):
            ending = spoiled(good, Path(folder), seed)
            outcomes[ending.outcome if ending.is_right else "neither"] += 1
            longest = max(longest, ending.seconds)
            if not ending.is_right or ending.seconds > MOST_SECONDS:
                print(ending, flush=True)
    peak = peak_memory() if sys.platform == "linux" else 0.0
    print(json.dumps({**outcomes, "seconds": longest, "memory": peak}))
    return 1 if outcomes["neither"] else 0


if __name__ == "__main__":
    sys.exit(main())
