"""The measuring plan: a YAML file that lists features, alignment and characteristics.

name: Plate
features:
  - {name: top, kind: plane, touches: 6}
  - {name: hole, kind: circle, side: inside, nominal: {origin: [20, 0, 0]}}
alignment: {plane: top, line: front, point: hole}
characteristics:
  - {quantity: diameter, of: [hole], nominal: 16, tolerance: 0.05}
"""

from collections.abc import Iterator
from enum import StrEnum
from math import inf
from pathlib import Path
from typing import Annotated, TypeAlias

import msgspec
from msgspec import Meta, Struct

from lightpen.errors import FileError
from lightpen.formats.documents import parse_document
from lightpen.formats.files import printable, read_text, write_whole
from lightpen.measuring.surfaces import SURFACES, FeatureKind
from lightpen.measuring.zones import Criterion
from lightpen.messages import message
from lightpen.model.decision_rules import DecisionRule

PLAN = message("measuring.plan")
MAX_SIZE = 1_000_000  # bytes
MAX_FEATURES = 1000
NEVER = "least squares"

Vector: TypeAlias = tuple[float, float, float]
Name: TypeAlias = Annotated[str, Meta(min_length=1, max_length=80)]


class Side(StrEnum):
    """On which side of a surface the ball was."""

    AUTO = "auto"  # decided from the touches
    INSIDE = "inside"  # of a bore, or within a slot
    OUTSIDE = "outside"  # of a boss or a ball


class Construction(StrEnum):
    """Features that follow from others."""

    MIDPOINT = "midpoint"
    PROJECTION = "projection"  # of a point on a plane or an axis
    INTERSECTION = "intersection"  # of axis and plane, or of two or three planes
    APEX = "apex"  # of a cone


class CharacteristicKind(StrEnum):
    """What is evaluated."""

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


class _Entry(Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """Base of the entries of a plan."""


class Nominal(_Entry, frozen=True):
    """A feature by design, in the part's frame, mm.

    Attributes
    ----------
    axis : triple of float or None
        Axis or normal; its length does not matter.
    """

    origin: Vector | None = None
    axis: Vector | None = None


class PlannedFeature(_Entry, frozen=True):
    """A feature to probe.

    Attributes
    ----------
    touches : int or None
        Number of points; None for as many as there are.
    air : triple of float or None
        Ball centre in air beside the surface, camera frame, mm: decides the side.
    """

    name: Name
    kind: FeatureKind
    touches: Annotated[int, Meta(ge=1, le=10_000)] | None = None
    side: Side = Side.AUTO
    criterion: str = NEVER
    nominal: Nominal | None = None
    air: Vector | None = None


class PlannedConstruction(_Entry, frozen=True):
    """A feature that follows from others."""

    name: Name
    construct: Construction
    of: tuple[Name, ...]


class PlannedAlignment(_Entry, frozen=True):
    """The part's frame: by 3-2-1 (plane, line, point), or by points with nominals."""

    plane: str = ""
    line: str = ""
    point: str = ""
    points: tuple[Name, ...] = ()


class PlannedCharacteristic(_Entry, frozen=True):
    """A characteristic with its tolerance.

    Attributes
    ----------
    datum : str
        Feature to which an orientation or location refers.
    nominal : float or None
        mm or degrees; geometrical tolerances have none.
    tolerance : float, pair of float or None
        Upper limit of a geometrical deviation; else plus and minus, or lower and upper
        deviation from nominal. None to report the value alone.
    """

    quantity: CharacteristicKind
    of: tuple[Name, ...]
    name: str = ""
    datum: str = ""
    nominal: float | None = None
    tolerance: float | tuple[float, float] | None = None

    @property
    def label(self) -> str:
        """Its name, or quantity and features."""
        return self.name or f"{self.quantity} {' - '.join(self.of)}"

    @property
    def limits(self) -> tuple[float, float]:
        """Lower and upper limit, mm or degrees; infinite without a tolerance."""
        if self.tolerance is None:
            return -inf, inf
        if self.nominal is None:
            return -inf, self.tolerance if isinstance(
                self.tolerance, float
            ) else self.tolerance[1]
        below, above = (
            (-self.tolerance, self.tolerance)
            if isinstance(self.tolerance, float)
            else self.tolerance
        )
        return self.nominal + below, self.nominal + above


class Plan(_Entry, frozen=True):
    """A measuring plan.

    Attributes
    ----------
    rule : DecisionRule
        How values are compared with their limits.
    """

    name: Name
    features: Annotated[tuple[PlannedFeature, ...], Meta(min_length=1)]
    constructions: tuple[PlannedConstruction, ...] = ()
    alignment: PlannedAlignment | None = None
    characteristics: tuple[PlannedCharacteristic, ...] = ()
    rule: DecisionRule = DecisionRule.GUARD_BAND

    def feature(self, name: str) -> PlannedFeature:
        """Return a feature to probe by its name."""
        return next(each for each in self.features if each.name == name)


def read_plan(path: Path) -> Plan:
    """Read a plan.

    Raises
    ------
    FileError
        It cannot be read, has unknown entries or contradicts itself.
    """
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
    """Write a plan as YAML.

    Raises
    ------
    FileError
        It cannot be written.
    """
    import yaml

    entries = msgspec.to_builtins(plan)
    text = yaml.safe_dump(entries, sort_keys=False, allow_unicode=True)
    write_whole(path, text.encode())


def _problems(plan: Plan) -> Iterator[str]:
    """Yield what contradicts itself, in English as the rest of the format."""
    names = [each.name for each in plan.features]
    names += [each.name for each in plan.constructions]
    for name in names:
        if names.count(name) > 1:
            yield f"{name!r} is defined twice"
    if len(names) > MAX_FEATURES:
        yield f"more than {MAX_FEATURES} features"
    for each in plan.features:
        needed = SURFACES[each.kind].min_points
        if each.touches is not None and each.touches < needed:
            yield f"a {each.kind.value} needs {needed} touches - at {each.name!r}"
        if each.criterion not in {NEVER, *(known.value for known in Criterion)}:
            yield f"unknown criterion {each.criterion!r} - at {each.name!r}"
    known = {each.name for each in plan.features}
    for construction in plan.constructions:
        yield from _unknown(construction.name, construction.of, known)
        known.add(construction.name)
    if plan.alignment is not None:
        yield from _alignment_problems(plan, plan.alignment, known)
    for characteristic in plan.characteristics:
        used = (*characteristic.of, *filter(None, [characteristic.datum]))
        yield from _unknown(characteristic.label, used, known)


def _alignment_problems(
    plan: Plan, alignment: PlannedAlignment, known: set[str]
) -> Iterator[str]:
    used = [alignment.plane, alignment.line, alignment.point]
    if alignment.points:
        if any(used):
            yield "the alignment has either plane, line and point, or points"
        yield from _unknown("alignment", alignment.points, known)
        nominal = {each.name for each in plan.features if _has_origin(each)}
        for name in alignment.points:
            if name not in nominal:
                yield f"the alignment needs a nominal origin of {name!r}"
    elif not all(used):
        yield "the alignment needs plane, line and point, or points"
    else:
        yield from _unknown("alignment", used, known)


def _has_origin(feature: PlannedFeature) -> bool:
    return feature.nominal is not None and feature.nominal.origin is not None


def _unknown(
    where: str, used: tuple[str, ...] | list[str], known: set[str]
) -> Iterator[str]:
    for name in used:
        if name not in known:
            yield f"unknown feature {name!r} - at {where!r}"
