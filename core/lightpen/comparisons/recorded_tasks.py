"""Verifications read back from their JSON, for use in other computations."""

from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np
from msgspec import Struct

from lightpen.arrays import FloatArray
from lightpen.errors import FileError
from lightpen.formats.files import LARGEST_RECORD, read_bytes
from lightpen.formats.own_json import DamagedError, Vector, has_checksum, parse_own_json
from lightpen.messages import Message, message

LENGTH = message("file.length")
DRIFT = message("file.drift")

T = TypeVar("T")


@dataclass(frozen=True)
class Scale:
    """Factor for the coordinates of the pen file; U (k = 2) with it and before."""

    factor: float
    uncertainty: float
    uncertainty_before: float


class _Scale(Struct):
    factor: float
    expanded_uncertainty: float
    expanded_uncertainty_before: float


class _Length(Struct):
    scale: _Scale


class _Drift(Struct):
    standard_uncertainty_share_mm: Vector


def read_scale(path: Path) -> Scale:
    """Read the scale that a verified length gives the pen."""
    scale = _read(path, _Length, LENGTH).scale
    return Scale(
        scale.factor, scale.expanded_uncertainty, scale.expanded_uncertainty_before
    )


def read_drift(path: Path) -> FloatArray:
    """Return the standard uncertainty by a drift for points probed meanwhile."""
    found = _read(path, _Drift, DRIFT)
    return np.array(found.standard_uncertainty_share_mm, dtype=np.float64)


def _read(path: Path, shape: type[T], what: Message) -> T:
    data = read_bytes(path, what, LARGEST_RECORD)
    try:
        has_checksum(data)
        return parse_own_json(data, shape)
    except DamagedError as error:
        raise FileError("verification.other-file", path=path, what=what) from error
