"""Stored settings of a station."""

from dataclasses import dataclass, field, replace
from typing import Any, TypeAlias

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.cameras.sources import source_named
from lightpen.model.assumptions import USUAL, Assumptions
from lightpen.model.limits import SwingLimits
from lightpen.model.method import Method
from lightpen.record.swings.names import Names
from lightpen.swing.image_sources import NO_SOURCE, SecondCamera, SourceChoice
from lightpen.swing.preparation import Preparation

Triple: TypeAlias = tuple[float, float, float]


@dataclass(frozen=True)
class StoredCamera:
    """Stored source of a camera's images, and its mask."""

    source: SourceChoice = NO_SOURCE
    mask: tuple[Triple, ...] = ()  # circles of stray light: centre x, y and radius, px


@dataclass(frozen=True)
class CameraFiles:
    """Settings of a camera, independent of the station."""

    file: str = ""  # path of the intrinsics file; for a pair, of the rig file
    sha256: str = ""  # hash of the intrinsics file
    mask: tuple[Triple, ...] = ()  # circles of stray light: centre x, y and radius, px


@dataclass(frozen=True)
class FilePaths:
    """Paths of the files in use, empty for none; units if the pen file states none."""

    camera: str = ""
    pen: str = ""
    pen_units: str = ""
    rig: str = ""


@dataclass(frozen=True)
class Station:
    """Last choices at a station."""

    names: Names = field(default_factory=Names)
    # Nominal tip centre, mm, pen frame; None: the LED file's.
    nominal_tip: Triple | None = None
    camera: StoredCamera = field(default_factory=StoredCamera)
    second: StoredCamera | None = None  # None for a single camera
    files: FilePaths = field(default_factory=FilePaths)
    limits: SwingLimits = field(default_factory=SwingLimits)
    assumptions: Assumptions = USUAL
    method: Method = "joint"  # of the reported tip
    # Choices for extensions by their keys, each as it stores them.
    extensions: dict[str, dict[str, Any]] = field(default_factory=dict)
    heading: float | None = None  # the operator's right as the camera sees it, rad
    temperature_day: str = ""  # see `Preparation`


def preparation_of(name: str, station: Station, before: Preparation) -> Preparation:
    """Return the last selection at a station; its files are read later.

    A source of a later version is passed over.
    """
    camera, second, tip = station.camera, station.second, station.nominal_tip
    return replace(
        before,
        names=replace(station.names, station=name),
        nominal_tip=None if tip is None else np.array(tip),
        source=camera.source if _is_known(camera) else NO_SOURCE,
        second=SecondCamera(second.source, mask=_mask(second))
        if second is not None and _is_known(second)
        else None,
        camera_file=None,
        pen_file=None,
        mask=_mask(camera),
        limits=station.limits,
        assumptions=station.assumptions,
        method=station.method,
        heading=station.heading,
        temperature_day=station.temperature_day,
    )


def station_of(
    preparation: Preparation, extensions: dict[str, dict[str, Any]], unread: FilePaths
) -> Station:
    """Return the stored form of a station, with the paths of files still being read."""
    second, tip = preparation.second, preparation.nominal_tip
    camera_file, pen_file = preparation.camera_file, preparation.pen_file
    rig_file = preparation.rig_file
    return Station(
        names=preparation.names,
        nominal_tip=None if tip is None else tuple(tip.tolist()),
        camera=StoredCamera(preparation.source, _circles(preparation.mask)),
        second=None
        if second is None
        else StoredCamera(second.source, _circles(second.mask)),
        files=FilePaths(
            unread.camera if camera_file is None else str(camera_file.path),
            unread.pen if pen_file is None else str(pen_file.path),
            unread.pen_units if pen_file is None else pen_file.units or "",
            unread.rig if rig_file is None else str(rig_file.path),
        ),
        limits=preparation.limits,
        assumptions=preparation.assumptions,
        method=preparation.method,
        extensions=extensions,
        heading=preparation.heading,
        temperature_day=preparation.temperature_day,
    )


def _is_known(camera: StoredCamera) -> bool:
    return source_named(camera.source.kind) is not None


def _mask(camera: StoredCamera) -> FloatArray:
    return np.array(camera.mask).reshape(-1, 3)


def _circles(mask: FloatArray) -> tuple[Triple, ...]:
    return tuple((x, y, radius) for x, y, radius in mask.tolist())
