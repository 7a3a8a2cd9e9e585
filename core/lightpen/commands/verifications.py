"""Verifications read back from their JSON, where another command builds on them."""

from pathlib import Path
from typing import TypeVar

import numpy as np
from msgspec import Struct

from lightpen.arrays import FloatArray
from lightpen.errors import FileError
from lightpen.formats.files import MEGABYTE, read_bytes
from lightpen.formats.own_json import DamagedError, Vector, has_checksum, parse_json
from lightpen.sentences import sentence
from lightpen.verification.length import Scale

VERIFICATION = sentence("file.verification", "verification")
LIMIT = 64 * MEGABYTE

T = TypeVar("T")


class _Scatter(Struct):
    points_cam_mm: list[Vector]


class _FixedPoint(Struct):
    calibrated: _Scatter


class _Scale(Struct):
    factor: float
    expanded_uncertainty: float
    expanded_uncertainty_before: float


class _Length(Struct):
    scale: _Scale


class _Drift(Struct):
    standard_uncertainty_share_mm: Vector


def read_fixed_point(path: Path) -> FloatArray:
    """Read the points of a fixed point that was verified, (N, 3), mm."""
    found = _read(path, _FixedPoint, "fixed-point")
    return np.array(found.calibrated.points_cam_mm, dtype=np.float64)


def read_scale(path: Path) -> Scale:
    """Read the scale that a verified length gives the pen."""
    scale = _read(path, _Length, "length").scale
    return Scale(
        scale.factor, scale.expanded_uncertainty, scale.expanded_uncertainty_before
    )


def read_drift(path: Path) -> FloatArray:
    """Read the standard uncertainty that a drift is for what was touched meanwhile."""
    found = _read(path, _Drift, "drift")
    return np.array(found.standard_uncertainty_share_mm, dtype=np.float64)


def _read(path: Path, shape: type[T], kind: str) -> T:
    data = read_bytes(path, VERIFICATION, LIMIT)
    try:
        has_checksum(data)
        return parse_json(data, shape)
    except DamagedError as error:
        raise FileError(
            sentence(
                "cli.no-verification",
                "{path} is not what verify {kind} wrote, or was changed since. Give "
                "what its option --json wrote.",
                path=str(path),
                kind=kind,
            )
        ) from error
