"""Reference artefacts: a certified size with its U, measured by a plan.

A size is certified for 20 degrees Celsius and grows with the temperature of its
artefact.
"""

from collections.abc import Sequence
from enum import StrEnum
from typing import Annotated

import numpy as np
from msgspec import Meta, Struct

from lightpen.arrays import BoolArray, FloatArray
from lightpen.errors import CalibrationError
from lightpen.measuring.plan import (
    CharacteristicKind,
    Nominal,
    Plan,
    PlannedCharacteristic,
    PlannedFeature,
    Side,
)
from lightpen.measuring.surfaces import FeatureKind
from lightpen.messages import Message, message

REFERENCE = 20.0  # degrees Celsius, for which a size is certified
KNOWN_EXPANSION = 0.1  # U (k = 2) of an expansion coefficient, relative
MIN_APART = 0.1  # of the certified length, between two ends
MAX_WIDE = 0.1  # of the distance of the ends, that points of one end may scatter
TOUCHES = {FeatureKind.CIRCLE: 12, FeatureKind.SPHERE: 25, FeatureKind.PLANE: 12}

Size = Annotated[float, Meta(ge=0)]


class ArtefactKind(StrEnum):
    """Kinds of artefacts, each with its certified size."""

    RING = "ring"  # radius
    LENGTH = "length"  # of a bar, or between two cones
    SPHERE = "sphere"  # diameter
    PLATE = "plate"  # flatness


KIND_WORDS: dict[ArtefactKind, Message] = {
    ArtefactKind.RING: message("artefact.ring"),
    ArtefactKind.LENGTH: message("artefact.length"),
    ArtefactKind.SPHERE: message("artefact.sphere"),
    ArtefactKind.PLATE: message("artefact.plate"),
}
SIZES = {
    ArtefactKind.RING: (FeatureKind.CIRCLE, CharacteristicKind.RADIUS),
    ArtefactKind.SPHERE: (FeatureKind.SPHERE, CharacteristicKind.DIAMETER),
    ArtefactKind.PLATE: (FeatureKind.PLANE, CharacteristicKind.FLATNESS),
    ArtefactKind.LENGTH: (FeatureKind.POINT, CharacteristicKind.LENGTH),
}
QUANTITIES = {quantity for _, quantity in SIZES.values()}


class Artefact(Struct, frozen=True):
    """An artefact with its certificate."""

    kind: ArtefactKind
    certified: Size  # mm, at 20 degrees Celsius
    uncertainty: Size = 0.0  # U (k = 2) of the certificate, mm
    side: Side = Side.CENTRE  # that the ball touches; its centre in cones and grooves
    temperature: float = REFERENCE  # degrees Celsius
    temperature_uncertainty: Size = 1.0  # U (k = 2), K
    expansion: Size = 0.0  # ppm/K; 0 for none

    def size(self) -> tuple[float, float]:
        """Return the size at the temperature, and its U (k = 2), mm."""
        per_kelvin = 1e-6 * self.expansion * self.certified
        warmer = self.temperature - REFERENCE
        by_heat = per_kelvin * np.hypot(
            self.temperature_uncertainty, warmer * KNOWN_EXPANSION
        )
        known = float(np.hypot(self.uncertainty, by_heat))
        return self.certified + per_kelvin * warmer, known


def artefact_plan(
    name: str, artefacts: Sequence[Artefact], touches: dict[FeatureKind, int] = TOUCHES
) -> Plan:
    """Return the plan that measures artefacts, or one of them at several places.

    ``touches`` are the points of a feature by its kind, where not the usual number.
    """
    features, characteristics = [], []
    for number, artefact in enumerate(artefacts, start=1):
        kind, quantity = SIZES[artefact.kind]
        size, known = artefact.size()
        own = [
            PlannedFeature(
                f"{artefact.kind} {number}{end}",
                kind,
                touches.get(kind),
                artefact.side,
                nominal=nominal,
            )
            for end, nominal in _nominals(artefact, size)
        ]
        features += own
        of = tuple(each.name for each in own)
        of_size = PlannedCharacteristic(quantity, of, nominal=size, certified=known)
        characteristics.append(of_size)
        if kind in {FeatureKind.CIRCLE, FeatureKind.SPHERE}:
            round_ = CharacteristicKind.ROUNDNESS
            characteristics.append(
                PlannedCharacteristic(round_, of, nominal=0.0, certified=0.0)
            )
    return Plan(name, tuple(features), characteristics=tuple(characteristics))


def _nominals(artefact: Artefact, size: float) -> list[tuple[str, Nominal | None]]:
    """Return the end of a name and the nominal of each feature of an artefact."""
    match artefact.kind:
        case ArtefactKind.LENGTH:
            ends = (-size / 2, 0.0, 0.0), (size / 2, 0.0, 0.0)
            return [(f" end {i}", Nominal(at)) for i, at in enumerate(ends, start=1)]
        case ArtefactKind.PLATE:
            return [("", None)]
        case ArtefactKind.RING:
            size = 2 * size
    return [("", Nominal((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), size))]


def are_of_second_end(run: str, points: FloatArray, certified: float) -> BoolArray:
    """Return which points (N, 3) of a length are of its second end.

    They are parted by the widest gap along the line that they lie on. Raises
    `CalibrationError` if they are not of two ends.
    """
    if len(points) < 2:
        raise CalibrationError("length.too-few", run=run, n_touches=len(points))
    along = np.linalg.svd(points - points.mean(axis=0))[2][0]
    places = points @ along
    ordered = np.sort(places)
    widest = int(np.argmax(np.diff(ordered)))
    gap = float(ordered[widest + 1] - ordered[widest])
    if gap < MIN_APART * certified:
        raise CalibrationError("length.one-end", run=run, extent=float(np.ptp(places)))
    second = places > ordered[widest]
    widths = np.zeros(len(points))
    for end in (~second, second):
        widths[end] = np.linalg.norm(points[end] - points[end].mean(axis=0), axis=1)
    if widths.max() > MAX_WIDE * gap:
        raise CalibrationError(
            "length.no-end",
            run=run,
            number=int(np.argmax(widths)) + 1,
            distance=float(widths.max()),
        )
    return np.asarray(second)
