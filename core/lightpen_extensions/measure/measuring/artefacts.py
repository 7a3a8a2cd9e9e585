"""Reference artefacts: a certified size with its U, measured by a plan.

A size is certified for 20 degrees Celsius and grows with the temperature of its
artefact.
"""

from collections.abc import Sequence

import numpy as np

from lightpen.arrays import BoolArray, FloatArray
from lightpen.errors import CalibrationError
from lightpen.model.artefacts import Artefact, ArtefactKind
from lightpen_extensions.measure.measuring.plan import (
    CharacteristicKind,
    Nominal,
    Plan,
    PlannedCharacteristic,
    PlannedFeature,
)
from lightpen_extensions.measure.measuring.surfaces import FeatureKind

MIN_APART = 0.1  # of the certified length, between two ends
MAX_WIDE = 0.1  # of the distance of the ends, that points of one end may scatter
TOUCHES = {FeatureKind.CIRCLE: 12, FeatureKind.SPHERE: 25, FeatureKind.PLANE: 12}


SIZES = {
    ArtefactKind.RING: (FeatureKind.CIRCLE, CharacteristicKind.RADIUS),
    ArtefactKind.SPHERE: (FeatureKind.SPHERE, CharacteristicKind.DIAMETER),
    ArtefactKind.PLATE: (FeatureKind.PLANE, CharacteristicKind.FLATNESS),
    ArtefactKind.LENGTH: (FeatureKind.POINT, CharacteristicKind.LENGTH),
}
QUANTITIES = {quantity for _, quantity in SIZES.values()}


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
