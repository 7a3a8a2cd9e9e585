"""The measuring plan: a YAML file that lists features, alignment and characteristics.

name: Plate
features:
  - {name: top, kind: plane, touches: 6}
  - {name: hole, kind: circle, side: inside, nominal: {origin: [20, 0, 0]}}
alignment: {plane: top, line: front, point: hole}
characteristics:
  - {quantity: diameter, of: [hole], nominal: 16, tolerance: 0.05}
"""

from collections.abc import Collection, Iterator
from enum import StrEnum
from math import inf
from pathlib import Path
from typing import Annotated, TypeAlias

import msgspec
import numpy as np
from msgspec import Meta, Struct, structs

from lightpen.errors import FileError
from lightpen.formats.documents import parse_document
from lightpen.formats.files import read_text, write_whole
from lightpen.measuring.surfaces import RADIAL, SURFACES, FeatureKind
from lightpen.measuring.zones import Criterion
from lightpen.messages import Message, message, printable
from lightpen.model.decision_rules import DecisionRule

PLAN = message("measuring.plan")
MAX_SIZE = 1_000_000  # bytes
MAX_FEATURES = 1000
MAX_FREE = 50  # features of a part without a plan
NEVER = "least squares"
FARTHEST = 1e6  # mm or degrees, of what a plan states
REDUNDANT = 2  # times as many points as determine a feature
UNKNOWN_TOUCHES = 8  # of a feature to be recognised
KNOWN_FORMS = "a plane, or a circle, sphere or cylinder with its nominal diameter"
NEEDS_FRAME = ("x", "y", "z", "position")

Coordinate: TypeAlias = Annotated[float, Meta(ge=-FARTHEST, le=FARTHEST)]
Vector: TypeAlias = tuple[Coordinate, Coordinate, Coordinate]
Name: TypeAlias = Annotated[str, Meta(min_length=1, max_length=80)]
Positive: TypeAlias = Annotated[float, Meta(gt=0, le=FARTHEST)]


class Side(StrEnum):
    """On which side of a surface the ball was."""

    AUTO = "auto"  # decided from the touches
    INSIDE = "inside"  # of a bore, or within a slot
    OUTSIDE = "outside"  # of a boss or a ball


class Construction(StrEnum):
    """Features constructed from others."""

    MIDPOINT = "midpoint"
    PROJECTION = "projection"  # of a point on a plane or an axis
    INTERSECTION = "intersection"  # of axis and plane, or of two or three planes
    APEX = "apex"  # of a cone


class CharacteristicKind(StrEnum):
    """Evaluated characteristics."""

    X = "x"
    Y = "y"
    Z = "z"
    DIAMETER = "diameter"
    RADIUS = "radius"
    WIDTH = "width"
    LENGTH = "length"
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
    CharacteristicKind.WIDTH: message("measuring.width"),
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
    # Of circle, sphere, cylinder and cone (at its origin); of a slot its width.
    diameter: Positive | None = None
    # Extent of a line, plane, cylinder or cone; overall length of a slot.
    length: Positive | None = None
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
    criterion: str = NEVER
    nominal: Nominal | None = None
    air: Vector | None = None  # ball centre beside the surface, camera frame, mm
    # U (k = 2) of the nominal diameter, mm, of a feature of known form, whose touches
    # refine the tip; None to measure the feature.
    known: Annotated[float, Meta(ge=0)] | None = None
    scan: bool = False  # whether the pen slides along the surface after its first touch

    @property
    def n_touches(self) -> int:
        """Number of points to probe."""
        if self.touches is not None:
            return self.touches
        if self.kind is None:
            return UNKNOWN_TOUCHES
        needed = SURFACES[self.kind].min_points
        return needed if needed == 1 else REDUNDANT * needed


class PlannedConstruction(_Entry, frozen=True):
    """A feature constructed from others."""

    name: Name
    construct: Construction
    of: tuple[Name, ...]


class PlannedAlignment(_Entry, frozen=True):
    """The part's frame: by 3-2-1 (plane, line, point), or by points with nominals."""

    plane: str = ""
    line: str = ""
    point: str = ""
    points: tuple[Name, ...] = ()

    @property
    def features(self) -> tuple[str, ...]:
        """Features that it needs."""
        return self.points or (self.plane, self.line, self.point)


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
    constructions: tuple[PlannedConstruction, ...] = ()
    alignment: PlannedAlignment | None = None
    characteristics: tuple[PlannedCharacteristic, ...] = ()
    rule: DecisionRule = DecisionRule.GUARD_BAND  # for values and their limits

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
        constructions = []
        for each in self.constructions:
            if known.issuperset(each.of):
                constructions.append(each)
                known.add(each.name)
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
            self,
            features=features,
            constructions=tuple(constructions),
            alignment=frame,
            characteristics=characteristics,
        )


def free_plan(name: str, touches: int = UNKNOWN_TOUCHES) -> Plan:
    """Return a plan of features that are recognised from their touches."""
    names = (f"F{i}" for i in range(1, MAX_FREE + 1))
    return Plan(name, tuple(PlannedFeature(each, touches=touches) for each in names))


def read_plan(path: Path) -> Plan:
    """Read a plan; raise `FileError` for unknown or contradictory entries."""
    return parse_plan(read_text(path, PLAN, MAX_SIZE), printable(path.name))


def parse_plan(text: str, name: str) -> Plan:
    """Return the plan that a YAML text holds; see `read_plan`."""
    tree = parse_document(text, name)
    try:
        plan = msgspec.convert(tree, Plan, strict=False)
    except msgspec.ValidationError as error:
        raise FileError("measuring.bad-plan", name=name, found=str(error)) from error
    for problem in _problems(plan):
        raise FileError("measuring.bad-plan", name=name, found=problem)
    return plan


def write_plan(plan: Plan, path: Path) -> None:
    """Write a plan as YAML."""
    import yaml

    entries = msgspec.to_builtins(plan)
    text = yaml.safe_dump(entries, sort_keys=False, allow_unicode=True)
    write_whole(path, text.encode())


def _problems(plan: Plan) -> Iterator[str]:
    """Yield the contradictions of a plan, in English as the rest of the format."""
    names = [each.name for each in plan.features]
    names += [each.name for each in plan.constructions]
    for name in names:
        if names.count(name) > 1:
            yield f"{name!r} is defined twice"
    if len(names) > MAX_FEATURES:
        yield f"more than {MAX_FEATURES} features"
    for each in plan.features:
        needed = 1 if each.kind is None else SURFACES[each.kind].min_points
        if each.kind is not None and (each.touches or needed) < needed:
            yield f"a {each.kind.value} needs {needed} touches - at {each.name!r}"
        if "@" in each.name:
            yield f"'@' in the name {each.name!r}"
        if each.nominal is not None and each.nominal.axis == (0, 0, 0):
            yield f"an axis of length 0 - at {each.name!r}"
        if each.known is not None and not _has_known_form(each):
            yield f"a known form needs {KNOWN_FORMS} - at {each.name!r}"
        if each.criterion not in {NEVER, *(known.value for known in Criterion)}:
            yield f"unknown criterion {each.criterion!r} - at {each.name!r}"
    known = {each.name for each in plan.features}
    for construction in plan.constructions:
        yield from _unknown(construction.name, construction.of, known)
        known.add(construction.name)
    if plan.alignment is not None:
        yield from _alignment_problems(plan, plan.alignment, known)
    for characteristic in plan.characteristics:
        yield from _unknown(characteristic.label, characteristic.features, known)
        # WORKAROUND for msgspec 0.22: bounds of a number in a union with a tuple fail.
        stated = characteristic.tolerance
        ends = np.atleast_1d(0.0 if stated is None else stated)
        if not (np.abs(ends) <= FARTHEST).all() or ends[0] > ends[-1]:
            yield f"the tolerance {stated} - at {characteristic.label!r}"


def _alignment_problems(
    plan: Plan, alignment: PlannedAlignment, known: set[str]
) -> Iterator[str]:
    used = [alignment.plane, alignment.line, alignment.point]
    if alignment.points:
        if any(used):
            yield "the alignment has either plane, line and point, or points"
        yield from _unknown("alignment", alignment.points, known)
        nominal = {
            each.name
            for each in plan.features
            if each.nominal is not None and each.nominal.origin is not None
        }
        for name in alignment.points:
            if name not in nominal:
                yield f"the alignment needs a nominal origin of {name!r}"
    elif not all(used):
        yield "the alignment needs plane, line and point, or points"
    else:
        yield from _unknown("alignment", used, known)


def _has_known_form(feature: PlannedFeature) -> bool:
    if feature.kind is FeatureKind.PLANE:
        return True
    has_size = feature.nominal is not None and feature.nominal.diameter is not None
    return feature.kind in RADIAL and has_size


def _unknown(
    where: str, used: tuple[str, ...] | list[str], known: set[str]
) -> Iterator[str]:
    for name in used:
        if name not in known:
            yield f"unknown feature {name!r} - at {where!r}"
