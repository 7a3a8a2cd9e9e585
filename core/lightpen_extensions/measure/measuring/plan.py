"""The measuring plan: a YAML file that lists features, alignment and characteristics.

name: Plate
features:
  - {name: top, kind: plane, touches: 6}
  - {name: hole, kind: circle, side: inside, nominal: {origin: [20, 0, 0]}}
alignment: {plane: top, line: front, point: hole}
characteristics:
  - {quantity: diameter, of: [hole], nominal: 16, tolerance: 0.05}
"""

from collections.abc import Collection, Sequence
from enum import StrEnum
from math import inf
from typing import Annotated, TypeAlias

import numpy as np
from msgspec import Meta, Struct, structs

from lightpen.arrays import BoolArray, FloatArray
from lightpen.errors import CalibrationError
from lightpen.messages import Message, message
from lightpen.model.artefacts import Artefact, ArtefactKind, Side
from lightpen.model.coverage import DecisionRule
from lightpen_extensions.measure.measuring.surfaces import SURFACES, FeatureKind

MAX_FREE = 50  # features of a part without a plan
FARTHEST = 1e6  # mm or degrees, of what a plan states
REDUNDANT = 2  # times as many points as determine a feature
UNKNOWN_TOUCHES = 8  # of a feature to be recognised
NEEDS_FRAME = ("x", "y", "z", "position")

Coordinate: TypeAlias = Annotated[float, Meta(ge=-FARTHEST, le=FARTHEST)]
Vector: TypeAlias = tuple[Coordinate, Coordinate, Coordinate]
Name: TypeAlias = Annotated[str, Meta(min_length=1, max_length=80)]
Positive: TypeAlias = Annotated[float, Meta(gt=0, le=FARTHEST)]


class CharacteristicKind(StrEnum):
    """Evaluated characteristics."""

    X = "x"
    Y = "y"
    Z = "z"
    DIAMETER = "diameter"
    RADIUS = "radius"
    LENGTH = "length"  # from one probed end to the other
    CONE_ANGLE = "cone angle"
    DISTANCE = "distance"
    ANGLE = "angle"
    STRAIGHTNESS = "straightness"
    FLATNESS = "flatness"
    ROUNDNESS = "roundness"
    CYLINDRICITY = "cylindricity"
    FORM = "form"
    POSITION = "position"
    PARALLELISM = "parallelism"
    PERPENDICULARITY = "perpendicularity"
    CONCENTRICITY = "concentricity"


IS_ANGLE = {CharacteristicKind.ANGLE, CharacteristicKind.CONE_ANGLE}
QUANTITIES = {  # the others are letters
    CharacteristicKind.DIAMETER: message("measuring.diameter"),
    CharacteristicKind.RADIUS: message("measuring.radius"),
    CharacteristicKind.LENGTH: message("measuring.length"),
    CharacteristicKind.CONE_ANGLE: message("measuring.cone-angle"),
    CharacteristicKind.DISTANCE: message("measuring.distance"),
    CharacteristicKind.ANGLE: message("measuring.angle"),
    CharacteristicKind.STRAIGHTNESS: message("measuring.straightness"),
    CharacteristicKind.FLATNESS: message("measuring.flatness"),
    CharacteristicKind.ROUNDNESS: message("measuring.roundness"),
    CharacteristicKind.CYLINDRICITY: message("measuring.cylindricity"),
    CharacteristicKind.FORM: message("measuring.form"),
    CharacteristicKind.POSITION: message("measuring.position"),
    CharacteristicKind.PARALLELISM: message("measuring.parallelism"),
    CharacteristicKind.PERPENDICULARITY: message("measuring.perpendicularity"),
    CharacteristicKind.CONCENTRICITY: message("measuring.concentricity"),
}
SIMULATED_PLATE = message("measuring.simulated-plate")


class _Entry(Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """Base of the entries of a plan."""


class Nominal(_Entry, frozen=True):
    """A feature by design, in the part's frame, mm."""

    origin: Vector | None = None
    axis: Vector | None = None  # axis or normal; its length does not matter
    diameter: Positive | None = None  # of a cone at its origin
    length: Positive | None = None  # extent of a line, plane, cylinder or cone
    width: Positive | None = None
    # Of a cone, from side to side, degrees.
    angle: Annotated[float, Meta(gt=0, lt=180)] | None = None


class PlannedFeature(_Entry, frozen=True):
    """A feature to probe."""

    name: Name
    kind: FeatureKind | None = None  # None to recognise it from the touches
    # Number of points; None for the usual one.
    touches: Annotated[int, Meta(ge=1, le=10_000)] | None = None
    side: Side = Side.AUTO
    nominal: Nominal | None = None
    # Of a point or line, the normal of the surface that was touched: that of a plane
    # of the plan, or a vector out of the material, frame of the part. Without them a
    # plane that the points lie on.
    surface: str = ""
    normal: Vector | None = None

    @property
    def n_touches(self) -> int:
        """Number of points to probe."""
        if self.touches is not None:
            return self.touches
        if self.kind is None:
            return UNKNOWN_TOUCHES
        needed = SURFACES[self.kind].min_points
        return needed if needed == 1 else REDUNDANT * needed


class PlannedAlignment(_Entry, frozen=True):
    """The part's frame by 3-2-1."""

    plane: Name
    line: Name
    point: Name

    @property
    def features(self) -> tuple[str, ...]:
        """Features that it needs."""
        return self.plane, self.line, self.point


class PlannedCharacteristic(_Entry, frozen=True):
    """A characteristic with its tolerance."""

    quantity: CharacteristicKind
    of: tuple[Name, ...]
    name: str = ""
    datum: str = ""  # feature to which an orientation or location refers
    nominal: Coordinate | None = None  # mm or degrees; geometrical tolerances have none
    # Upper limit of a geometrical deviation; else plus and minus, or lower and upper
    # deviation from nominal. None to report the value alone.
    tolerance: float | tuple[float, float] | None = None
    # U (k = 2) of a nominal that is the certified value of an artefact, mm or degrees.
    # Without a tolerance the limits of the station judge the error.
    certified: Annotated[float, Meta(ge=0, le=FARTHEST)] | None = None

    @property
    def label(self) -> str:
        """Its name, or quantity and features."""
        return self.name or f"{self.quantity} {' - '.join(self.of)}"

    @property
    def words(self) -> Message:
        """Its label for display."""
        if self.name:
            return message("measuring.named", name=self.name)
        quantity = QUANTITIES.get(self.quantity, self.quantity.value)
        of = " - ".join(self.of)
        return message("measuring.characteristic", quantity=quantity, of=of)

    @property
    def unit(self) -> str:
        """Unit of its value."""
        is_angle = self.quantity in IS_ANGLE
        return "degree" if is_angle else "mm"

    @property
    def features(self) -> tuple[str, ...]:
        """Features that it needs."""
        return (*self.of, *filter(None, [self.datum]))

    @property
    def limits(self) -> tuple[float, float]:
        """Lower and upper limit, mm or degrees; infinite without a tolerance."""
        if self.tolerance is None:
            return -inf, inf
        ends = self.tolerance
        below, above = (-ends, ends) if isinstance(ends, float) else ends
        if self.nominal is None:
            return -inf, above
        return self.nominal + below, self.nominal + above


class Plan(_Entry, frozen=True):
    """A measuring plan."""

    name: Name
    features: Annotated[tuple[PlannedFeature, ...], Meta(min_length=1)]
    alignment: PlannedAlignment | None = None
    characteristics: tuple[PlannedCharacteristic, ...] = ()
    rule: DecisionRule | None = None  # None: that of the station

    @property
    def words(self) -> Message:
        """Its name for display."""
        is_simulated = self.name == SIMULATED_PLATE.template
        return (
            SIMULATED_PLATE
            if is_simulated
            else message("measuring.named", name=self.name)
        )

    def feature(self, name: str) -> PlannedFeature:
        """Return a feature to probe by its name."""
        return next(each for each in self.features if each.name == name)

    def limited_to(self, names: Collection[str]) -> "Plan":
        """Return the part of the plan that some of its features determine."""
        features = tuple(each for each in self.features if each.name in names)
        known = {each.name for each in features}
        frame = self.alignment
        if frame is not None and not known.issuperset(frame.features):
            frame = None
        characteristics = tuple(
            each
            for each in self.characteristics
            if known.issuperset(each.features)
            and (frame is self.alignment or each.quantity not in NEEDS_FRAME)
        )
        return structs.replace(
            self, features=features, alignment=frame, characteristics=characteristics
        )


def free_plan(name: str, touches: int = UNKNOWN_TOUCHES) -> Plan:
    """Return a plan of features that are recognised from their touches."""
    names = (f"F{i}" for i in range(1, MAX_FREE + 1))
    return Plan(name, tuple(PlannedFeature(each, touches=touches) for each in names))


# Reference artefacts: a certified size with its U, measured by a plan.
#
# A size is certified for 20 degrees Celsius and grows with the temperature of its
# artefact.


MIN_APART = 0.1  # of the certified length, between two ends
MAX_WIDE = 0.1  # of the distance of the ends, that points of one end may scatter
TOUCHES = {FeatureKind.CIRCLE: 12, FeatureKind.SPHERE: 25, FeatureKind.PLANE: 12}


SIZES = {
    ArtefactKind.RING: (FeatureKind.CIRCLE, CharacteristicKind.RADIUS),
    ArtefactKind.SPHERE: (FeatureKind.SPHERE, CharacteristicKind.DIAMETER),
    ArtefactKind.PLATE: (FeatureKind.PLANE, CharacteristicKind.FLATNESS),
    ArtefactKind.LENGTH: (FeatureKind.POINT, CharacteristicKind.LENGTH),
}
CERTIFIED = {quantity for _, quantity in SIZES.values()}


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
