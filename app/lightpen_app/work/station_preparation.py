"""What a station chose, as its settings keep it."""

from dataclasses import replace
from typing import Any

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.cameras.sources import source_named
from lightpen.model.assumptions import USUAL, Assumptions, with_focal_length
from lightpen.model.limits import SwingLimits
from lightpen.record.names import Names
from lightpen.swing.preparation import Preparation, SecondCamera, SourceChoice
from lightpen_app.work.settings import Station

# Those of a station's assumptions that it keeps by their names.
ASSUMED = (
    *("scale", "form_error", "center_bias"),
    *("temperature", "warmth", "expansion"),
)


def preparation_of(name: str, station: Station, before: Preparation) -> Preparation:
    """Return what was chosen last at a station of a name, its files still to be read.

    What makes no sense is as usual.
    """
    names = Names(
        name,
        *(station.operator, station.pen, station.tip, station.cone),
        station.ball_diameter or None,
    )
    return replace(
        before,
        names=names,
        nominal_tip=_parse_point(station.nominal_tip),
        source=_source(station),
        second=_second(station),
        camera_file=None,
        pen_file=None,
        mask=_parse_circles(station.mask),
        limits=_limits(station),
        assumptions=_assumptions(station),
    )


def station_of(preparation: Preparation, unread: Station) -> Station:
    """Return what a station keeps of a preparation.

    Parameters
    ----------
    preparation : Preparation
    unread : Station
        With the files that are still being read: they stay remembered.
    """
    names, source = preparation.names, preparation.source
    camera_file, pen_file = preparation.camera_file, preparation.pen_file
    kept = Station(
        operator=names.operator,
        pen=names.pen,
        tip=names.tip,
        cone=names.cone,
        ball_diameter=names.ball_diameter or 0.0,
        nominal_tip=_point_text(preparation.nominal_tip),
        source=source.kind,
        source_place=source.place,
        source_producer=source.producer,
        camera_file=unread.camera_file
        if camera_file is None
        else str(camera_file.path),
        pen_file=unread.pen_file if pen_file is None else str(pen_file.path),
        pen_units=unread.pen_units if pen_file is None else pen_file.units or "",
        mask=_circles_text(preparation.mask),
        max_uncertainty=preparation.limits.max_uncertainty,
        min_images=preparation.limits.min_images,
        max_images=preparation.limits.max_images,
        **_assumed_entries(preparation.assumptions),
    )
    return _with_second(kept, preparation.second, unread)


def _limits(station: Station) -> SwingLimits:
    """Return the limits of a station, the usual ones if its own make no sense."""
    try:
        return SwingLimits(
            station.max_uncertainty, station.min_images, station.max_images
        )
    except ValueError:
        return SwingLimits()


def _assumptions(station: Station) -> Assumptions:
    """Return what a station assumes, what is usual if that makes no sense."""
    own = {name: getattr(station, name) for name in ASSUMED}
    try:
        others = replace(USUAL, temperature_c=station.temperature_c, **own)
        return with_focal_length(others, station.focal_length)
    except ValueError:
        return USUAL


def _assumed_entries(assumptions: Assumptions) -> dict[str, Any]:
    entries = {name: getattr(assumptions, name) for name in ASSUMED}
    return entries | {
        "focal_length": assumptions.focal_length,
        "temperature_c": assumptions.temperature_c,
    }


def _source(station: Station) -> SourceChoice:
    if source_named(station.source) is None:  # of a later version
        return SourceChoice()
    return SourceChoice(station.source, station.source_place, station.source_producer)


def _second(station: Station) -> SecondCamera | None:
    if source_named(station.second_source) is None:  # none, or of a later version
        return None
    source = SourceChoice(
        station.second_source, station.second_place, station.second_producer
    )
    return SecondCamera(source, mask=_parse_circles(station.second_mask))


def _with_second(
    station: Station, second: SecondCamera | None, unread: Station
) -> Station:
    if second is None:
        return station
    file = second.rig_file
    return replace(
        station,
        second_source=second.source.kind,
        second_place=second.source.place,
        second_producer=second.source.producer,
        second_mask=_circles_text(second.mask),
        rig_file=unread.rig_file if file is None else str(file.path),
    )


def _point_text(point: FloatArray | None) -> str:
    return "" if point is None else " ".join(map(repr, point.tolist()))


def _parse_point(text: str) -> FloatArray | None:
    point = _parse_numbers(text)
    return point if point.shape == (3,) else None


def _circles_text(mask: FloatArray) -> str:
    return "; ".join(" ".join(map(repr, circle)) for circle in mask.tolist())


def _parse_circles(text: str) -> FloatArray:
    circles = [_parse_numbers(part) for part in text.split(";")]
    return np.array([c for c in circles if c.shape == (3,)]).reshape(-1, 3)


def _parse_numbers(text: str) -> FloatArray:
    try:
        numbers = np.array([float(word) for word in text.split()])
    except ValueError:
        return np.zeros(0)
    return numbers if np.isfinite(numbers).all() else np.zeros(0)
