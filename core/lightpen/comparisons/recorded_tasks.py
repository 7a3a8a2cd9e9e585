"""Verifications read back from their JSON, for use in other computations."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, TypeVar

import numpy as np
from msgspec import Meta, Struct

from lightpen.arrays import FloatArray
from lightpen.comparisons.repeatability import RepeatedPoint
from lightpen.errors import FileError
from lightpen.formats.files import LARGEST_RECORD, read_bytes
from lightpen.formats.own_json import (
    DamagedError,
    Vector,
    ZonedTime,
    has_checksum,
    parse_own_json,
)
from lightpen.messages import Message, message

FIXED_POINT = message("file.fixed-point")
LENGTH = message("file.length")
DRIFT = message("file.drift")

FIXED_POINT_KIND = "fixed point"  # of the task that verifies it
MIN_TOUCHES = 3  # of a fixed point

T = TypeVar("T")


@dataclass(frozen=True)
class Scale:
    """Factor for the coordinates of the pen file; U (k = 2) with it and before."""

    factor: float
    uncertainty: float
    uncertainty_before: float


class _Scatter(Struct):
    points_cam_mm: Annotated[list[Vector], Meta(min_length=MIN_TOUCHES)]


class _FixedPoint(Struct):
    created: ZonedTime
    calibrated: _Scatter
    expected_std_mm: Vector


class _Scale(Struct):
    factor: float
    expanded_uncertainty: float
    expanded_uncertainty_before: float


class _Length(Struct):
    scale: _Scale


class _Drift(Struct):
    standard_uncertainty_share_mm: Vector


def read_fixed_point(path: Path) -> RepeatedPoint:
    """Read a fixed point that was verified."""
    return _touched(_read(path, _FixedPoint, FIXED_POINT))


def fixed_point_in(record: str) -> RepeatedPoint | None:
    """Return the fixed point of a checked record in JSON; None for another task."""
    try:
        return _touched(
            parse_own_json(record.encode("utf-8", "surrogateescape"), _FixedPoint)
        )
    except DamagedError:
        return None


def _touched(found: _FixedPoint) -> RepeatedPoint:
    return RepeatedPoint(
        np.array(found.calibrated.points_cam_mm, dtype=np.float64),
        np.array(found.expected_std_mm, dtype=np.float64),
        found.created,
    )


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
