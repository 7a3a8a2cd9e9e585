"""The input files of a calibration, with their hashes."""

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from hashlib import sha256 as sha256_of
from itertools import chain
from pathlib import Path

from lightpen.arrays import FloatArray
from lightpen.formats.files import A_FILE, MEGABYTE, read_bytes, sha256
from lightpen.model.origin import Origin

LIMIT = 16 * MEGABYTE  # of a file that is kept in the record


@dataclass(frozen=True)
class InputFile:
    """An input file of a calibration."""

    path: Path
    sha256: str
    content: bytes | None = None  # in the record, to recompute from that alone


@dataclass(frozen=True)
class RigInputs:
    """The rig file and the camera files of several cameras."""

    rig: InputFile
    cameras: tuple[InputFile, ...]


@dataclass(frozen=True, eq=False)
class Inputs:
    """The inputs of a calibration."""

    camera: InputFile
    pen: InputFile
    observations: tuple[InputFile, ...]  # images, video, or file of LED centres
    nominal_tip: FloatArray | None
    rig: RigInputs | None = None
    origin: Origin | None = None
    units: str | None = None  # units of a pen file that states none
    led_diameter: float | None = None  # of the discs, mm, if the pen file has none


def hashed(path: Path) -> InputFile:
    """Return a file with its hash."""
    return InputFile(path, sha256(path))


def with_content(path: Path) -> InputFile:
    """Return a file with its hash and its content."""
    content = read_bytes(path, A_FILE, LIMIT)
    return InputFile(path, sha256_of(content).hexdigest(), content)


def all_hashed(paths: Sequence[Path]) -> tuple[InputFile, ...]:
    """Return files with their hashes, computed in parallel."""
    n_threads = os.cpu_count() or 1
    n_each = -(-len(paths) // n_threads) or 1  # taking one by one, threads wait in turn
    shares = [paths[i : i + n_each] for i in range(0, len(paths), n_each)]
    with ThreadPoolExecutor(n_threads) as executor:
        found = executor.map(lambda some: list(map(hashed, some)), shares)
        return tuple(chain.from_iterable(found))
