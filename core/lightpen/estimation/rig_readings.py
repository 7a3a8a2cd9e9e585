"""Whether the file of a rig was written as it is read: directions, order, units, names.

Where the images put the cameras is known without the file. A file that has them quite
elsewhere is refused, and told apart by the usual mistake that brings it there if it is
undone. One that is off by less is not: the fit of all images says by how much.
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
from lightpen.estimation.placing import Placed
from lightpen.estimation.single_images import PosedImages
from lightpen.model.pen import Pen
from lightpen.model.rig import Rig
from lightpen.model.rigid import vector_from_rotation
from lightpen.sentences import COMMA, Sentence, sentence

USUAL_ANGLE = np.radians(5.0)  # by which a camera may have been bumped
USUAL_SHARE = 0.1  # of its distance from the reference
LEAST_DISTANCE = 100.0  # mm, of which that share is taken at least
EXPLAINED = 0.4  # of these, that a mistake leaves when it is undone
FAR_OFF = 3.0  # times these: no rig to start from
CLEARLY = 0.8  # of the noise with the camera files as they are
UNITS = (
    (sentence("unit.metres", "metres"), 1000.0),
    (sentence("unit.inches", "inches"), 25.4),
    (sentence("unit.centimetres", "centimetres"), 10.0),
    (sentence("unit.micrometres", "micrometres"), 0.001),
)


class _Places(NamedTuple):
    """Rotations (C, 3, 3) and translations (C, 3) of cam_from_rig, mm."""

    rotations: FloatArray
    translations: FloatArray


@dataclass(frozen=True)
class _RigMistake:
    """A usual mistake: how it is undone, and what is said of it."""

    undo: Callable[[_Places], _Places]
    said: Sentence


class _Distance(NamedTuple):
    """How far a camera lies from where the images put it."""

    camera: int
    angle: float  # rad
    length: float  # mm
    size: float  # in what is usual


def require_usual_rig(
    rig: Rig,
    placed: Placed,
    pen: Pen,
    pixels: FloatArray,
    parts: Sequence[PosedImages],
) -> None:
    """Refuse the file of a rig that has the cameras quite elsewhere than the images.

    Parameters
    ----------
    pixels : (N, C, L, 2) array
        What the cameras saw, px.
    parts : sequence of PosedImages
        Of each camera.

    Raises
    ------
    CalibrationError
        Says what the file looks like, and what is needed.
    """
    stated = _Places(rig.rotations, rig.translations)
    found = _Places(placed.rig.rotations, placed.rig.translations)
    as_read = _distance(stated, found)
    if as_read.size <= 1:
        return
    where = sentence(
        "rig.elsewhere",
        "The rig file has camera {camera} {angle:.1f} degrees and {distance:.0f} mm "
        "away from where the images put it.",
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
            sentence(
                "rig.either-mistaken",
                "{where} {one} Or: {other}",
                where=where,
                one=_exchange(rig, *pair),
                other=mistake.said,
            )
        )
    if are_exchanged or is_mistaken:
        cause = _exchange(rig, *pair) if are_exchanged else mistake.said
        raise CalibrationError(
            sentence("rig.mistaken", "{where} {cause}", where=where, cause=cause)
        )
    if as_read.size > FAR_OFF:
        raise CalibrationError(
            sentence(
                "rig.of-others",
                "{where} Check that it is the file of these cameras as they stand now, "
                "or calibrate the rig again.",
                where=where,
            )
        )


def _distance(stated: _Places, found: _Places) -> _Distance:
    """Return that of the camera that lies farthest."""
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
    """Return how many times the noise is larger with two camera files exchanged."""
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


def _exchange(rig: Rig, one: int, other: int) -> Sentence:
    return sentence(
        "rig.exchanged",
        "It agrees with them if the images of {one} and {other} are exchanged: give "
        "the images in the order of the rig file, {names}.",
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
    _RigMistake(
        _inverted,
        sentence(
            "rig.inverted",
            "It agrees with them if it holds rig_from_cam; cam_from_rig is needed. Of "
            "each camera transpose the rotation R, and put -R^T t in place of the "
            "translation t.",
        ),
    ),
    _RigMistake(
        _transposed,
        sentence(
            "rig.transposed",
            "It agrees with them if its rotations are transposed. Write each row by "
            "row, as it is multiplied to a column vector.",
        ),
    ),
    _RigMistake(
        _from_position,
        sentence(
            "rig.position",
            "It agrees with them if it holds the places of the cameras in the rig "
            "instead of the translations of cam_from_rig. Put -R c in place of c.",
        ),
    ),
)


def _in_unit(unit: Sentence) -> Sentence:
    return sentence(
        "rig.unit",
        "It agrees with them if its lengths are in {unit}. Millimetres are needed.",
        unit=unit,
    )


def _in_unit_too(mistake: _RigMistake, unit: Sentence) -> Sentence:
    return sentence(
        "rig.direction-and-unit",
        "{direction} Its lengths seem to be in {unit}; millimetres are needed.",
        direction=mistake.said,
        unit=unit,
    )


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
