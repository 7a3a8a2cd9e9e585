"""Decode the images of a folder in as many threads as cores; print the time, s."""

import os
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import cv2
import numpy as np


def decode(path: Path) -> None:
    """Read and decode one image, and forget it."""
    data = np.frombuffer(path.read_bytes(), np.uint8)
    cv2.imdecode(data, cv2.IMREAD_UNCHANGED)


def decode_all(folder: Path) -> float:
    """Decode all images of a folder; return the time, s."""
    files = sorted(folder.iterdir())
    start = time.perf_counter()
    with ThreadPoolExecutor(os.cpu_count()) as executor:
        for _ in executor.map(decode, files):
            pass
    return time.perf_counter() - start


if __name__ == "__main__":
    print(decode_all(Path(sys.argv[1])))
