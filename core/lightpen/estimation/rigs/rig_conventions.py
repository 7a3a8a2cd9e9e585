"""Detection of other conventions in a rig file: directions, order, units, names.

The extrinsics are known by the images alone. A file that contradicts them grossly is
refused, with the usual mistake that explains it. Smaller deviations are left to the
adjustment.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import combinations
from typing import NamedTuple

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.detection.pose import fit_poses
from lightpen.errors import CalibrationError
from lightpen.estimation.contact.single_images import PosedImages
from lightpen.estimation.rigs.rig_poses import InitialExtrinsics
from lightpen.messages import COMMA, Message, message
from lightpen.model.pen import Pen
from lightpen.model.rigid import Rig, vector_from_rotation

USUAL_ANGLE = np.radians(5.0)  # by which a camera may have been bumped
USUAL_SHARE = 0.1  # of its distance from the reference
LEAST_DISTANCE = 100.0  # mm, lower bound of the distance for that share
EXPLAINED = 0.4  # of these, left once a mistake is corrected
FAR_OFF = 3.0  # times these: no rig to start from
CLEARLY = 0.8  # of the noise with the camera files as they are
UNITS = (
    (message("unit.metres"), 1000.0),
    (message("unit.inches"), 25.4),
    (message("unit.centimetres"), 10.0),
    (message("unit.micrometres"), 0.001),
)


class _Places(NamedTuple):
    """Rotations (C, 3, 3) and translations (C, 3) of cam_from_rig, mm."""

    rotations: FloatArray
    translations: FloatArray


@dataclass(frozen=True)
class _RigMistake:
    """A usual mistake: how it is undone, and its message."""

    undo: Callable[[_Places], _Places]
    description: Message


class _Distance(NamedTuple):
    """Deviation of stated extrinsics from those by the images."""

    camera: int
    angle: float  # rad
    length: float  # mm
    size: float  # the larger of both relative to the usual deviation


def require_usual_rig(
    rig: Rig,
    placed: InitialExtrinsics,
    pen: Pen,
    pixels: FloatArray,
    parts: Sequence[PosedImages],
) -> None:
    """Raise `CalibrationError` if cameras are quite elsewhere than in the rig's file.

    It says what the file looks like, and what is needed. ``pixels`` (N, C, L, 2) is
    what the cameras saw, px.
    """
    stated = _Places(rig.rotations, rig.translations)
    found = _Places(placed.rig.rotations, placed.rig.translations)
    as_read = _distance(stated, found)
    if as_read.size <= 1:
        return
    where = message(
        "rig.elsewhere",
        camera=rig.names[as_read.camera],
        angle=float(np.degrees(as_read.angle)),
        distance=as_read.length,
    )
    pair = min(
        combinations(range(rig.n_cameras), 2),
        key=lambda each: _distance(stated, _exchanged(found, *each)).size,
    )
    are_exchanged = _distance(stated, _exchanged(found, *pair)).size <= EXPLAINED
    mistake = min(_MISTAKES, key=lambda each: _distance(each.undo(stated), found).size)
    is_mistaken = _distance(mistake.undo(stated), found).size <= EXPLAINED
    if are_exchanged and is_mistaken:  # two cameras: an inverse looks like it
        ratio = _noise_exchanged(rig, pen, pixels, parts, *pair)
        are_exchanged, is_mistaken = ratio < 1 / CLEARLY, ratio > CLEARLY
    if are_exchanged and is_mistaken:
        raise CalibrationError(
            "rig.either-mistaken",
            where=where,
            one=_exchange(rig, *pair),
            other=mistake.description,
        )
    if are_exchanged or is_mistaken:
        cause = _exchange(rig, *pair) if are_exchanged else mistake.description
        raise CalibrationError("rig.mistaken", where=where, cause=cause)
    if as_read.size > FAR_OFF:
        raise CalibrationError("rig.of-others", where=where)


def _distance(stated: _Places, found: _Places) -> _Distance:
    """Return the deviation of the camera that is farthest from its stated place."""
    turns = stated.rotations @ np.swapaxes(found.rotations, 1, 2)
    angles = np.linalg.norm(vector_from_rotation(turns), axis=1)
    lengths = np.linalg.norm(stated.translations - found.translations, axis=1)
    apart = np.linalg.norm(found.translations, axis=1)
    shares = lengths / np.maximum(apart, LEAST_DISTANCE)
    sizes = np.maximum(angles / USUAL_ANGLE, shares / USUAL_SHARE)
    c = int(np.argmax(sizes))
    return _Distance(c, float(angles[c]), float(lengths[c]), float(sizes[c]))


def _exchanged(places: _Places, one: int, other: int) -> _Places:
    """Return places as they are once the images of two cameras change sides."""
    order = np.arange(len(places.rotations))
    order[[one, other]] = other, one
    R, t = places.rotations[order], places.translations[order]
    rotations = R @ R[0].T  # with the first one as the reference
    return _Places(rotations, t - rotations @ t[0])


def _noise_exchanged(
    rig: Rig,
    pen: Pen,
    pixels: FloatArray,
    parts: Sequence[PosedImages],
    one: int,
    other: int,
) -> float:
    """Return the noise ratio with the two camera files swapped."""
    total = {False: 0.0, True: 0.0}
    for images, file in ((one, other), (other, one)):
        part = parts[images]
        poses = part.poses.of(part.kept)
        seen = pixels[part.chosen, images]
        for exchanged, camera in ((False, images), (True, file)):
            fitted = fit_poses(
                rig.cameras[camera], pen, seen, poses.rotations, poses.translations
            )
            total[exchanged] += fitted.sigma
    return total[True] / total[False]


def _exchange(rig: Rig, one: int, other: int) -> Message:
    return message(
        "rig.exchanged",
        one=rig.names[one],
        other=rig.names[other],
        names=str(COMMA).join(rig.names),
    )


def _as_read(places: _Places) -> _Places:
    return places


def _transposed(places: _Places) -> _Places:
    return places._replace(rotations=np.swapaxes(places.rotations, 1, 2))


def _from_position(places: _Places) -> _Places:
    return places._replace(
        translations=-np.einsum("cij,cj->ci", places.rotations, places.translations)
    )


def _inverted(places: _Places) -> _Places:
    return _from_position(_transposed(places))


def _scaled(
    undo: Callable[[_Places], _Places], factor: float, places: _Places
) -> _Places:
    undone = undo(places)
    return undone._replace(translations=factor * undone.translations)


_DIRECTIONS = (
    _RigMistake(_inverted, message("rig.inverted")),
    _RigMistake(_transposed, message("rig.transposed")),
    _RigMistake(_from_position, message("rig.position")),
)


def _in_unit(unit: Message) -> Message:
    return message("rig.unit", unit=unit)


def _in_unit_too(mistake: _RigMistake, unit: Message) -> Message:
    return message("rig.direction-and-unit", direction=mistake.description, unit=unit)


_MISTAKES = (
    *_DIRECTIONS,
    *(
        _RigMistake(partial(_scaled, _as_read, factor), _in_unit(unit))
        for unit, factor in UNITS
    ),
    *(
        _RigMistake(partial(_scaled, each.undo, factor), _in_unit_too(each, unit))
        for each in _DIRECTIONS
        for unit, factor in UNITS
    ),
)
