"""Measurement of a part: features, alignment and characteristics of a plan."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from msgspec import structs

from lightpen.arrays import FloatArray, IntArray
from lightpen.errors import CalibrationError
from lightpen.measuring import constructions
from lightpen.measuring.alignment import (
    MIN_POINTS,
    Alignment,
    align_321,
    align_points,
    tie,
)
from lightpen.measuring.characteristics import (
    AXIAL,
    CENTRED,
    FLAT,
    Measured,
    Value,
    evaluate,
)
from lightpen.measuring.compensation import Evidence, TouchedSurface, surface_of
from lightpen.measuring.features import AXIS, Feature, fit_feature
from lightpen.measuring.plan import (
    NEVER,
    Construction,
    Nominal,
    Plan,
    PlannedCharacteristic,
    PlannedConstruction,
    PlannedFeature,
    Side,
)
from lightpen.measuring.quantities import Quantity, derive
from lightpen.measuring.recognition import recognise, recognised
from lightpen.measuring.surfaces import NAMES, SURFACES, FeatureKind
from lightpen.measuring.touches import PartTouches, at_position
from lightpen.measuring.zones import Criterion, fit_zone
from lightpen.model.decision_rules import Decision, conformity_probability, decide

OTHER_KIND = 0.05  # of the extent of points: farther off they show another kind
FLAT_POINTS = 0.005  # of that extent: points as flat do not determine solids
SOLID = {FeatureKind.SPHERE, FeatureKind.CYLINDER, FeatureKind.CONE}
OUTLYING = 6.0  # of their noise, which is added to both
MAX_SPREAD = 0.1  # rad of an axis, or of a size: more is not determined


@dataclass(frozen=True, eq=False)
class CharacteristicResult:
    """A characteristic beside its tolerance."""

    planned: PlannedCharacteristic
    value: Value
    # U (k = 2) if the touches shared nothing; None for geometrical deviations.
    independent_uncertainty: float | None
    decision: Decision | None  # None without a tolerance
    probability: float | None  # probability of conformity (JCGM 106)
    quantity: Quantity | None = None  # None for geometrical deviations

    @property
    def deviation(self) -> float | None:
        """Value less nominal, mm or degrees."""
        nominal = self.planned.nominal
        return None if nominal is None else self.value.value - nominal


@dataclass(frozen=True, eq=False)
class MeasuredPart:
    """A measured part."""

    plan: Plan
    touches: PartTouches
    features: Mapping[str, Measured]  # all features and constructed features by name
    alignment: Alignment | None  # None if results are in the frame of the camera
    results: tuple[CharacteristicResult, ...]
    # Motion of each later position to the first one, by datum points.
    ties: Mapping[int, Alignment] = field(default_factory=dict)

    def uncertainty(self, name: str) -> FloatArray:
        """Return U (k = 2) of a feature's values in the frame of the part."""
        return self.features[name].in_part.uncertainty(self.touches.inputs)


def measure_part(plan: Plan, touches: PartTouches) -> MeasuredPart:
    """Measure a part by a plan.

    Raises `CalibrationError` if a feature has too few touches or none, its side is
    unknown, or a characteristic is not defined for its features.
    """
    plan = _with_kinds(plan, touches)
    fits, surfaces, points, ties = _probed(plan, touches)
    for construction in plan.constructions:
        surfaces[construction.name] = _constructed(construction, surfaces)
    alignment = _aligned(plan, surfaces)
    features = {
        name: _measured(
            plan, name, surface, fits.get(name), points.get(name), alignment
        )
        for name, surface in surfaces.items()
    }
    results = tuple(
        _result(plan, planned, features, touches) for planned in plan.characteristics
    )
    return MeasuredPart(plan, touches, features, alignment, results, ties)


def _probed(
    plan: Plan, touches: PartTouches
) -> tuple[
    dict[str, Feature],
    dict[str, TouchedSurface],
    dict[str, Quantity],
    dict[int, Alignment],
]:
    """Return fits, surfaces and points of the features, all in the first position.

    Features with a centre that were probed in an earlier position and in a later one
    are the datum points that tie the two together.
    """
    ties: dict[int, Alignment] = {}
    fits: dict[str, Feature] = {}
    surfaces: dict[str, TouchedSurface] = {}
    points: dict[str, Quantity] = {}
    for position in touches.positions:
        own, places = {}, {}
        for each in plan.features:
            name = at_position(each.name, position)
            at = touches.of(name)
            if not len(at) and (position > 1 or len(touches.first_of(each.name))):
                continue
            planned = structs.replace(each, name=name)
            fit = _fitted(planned, touches)
            own[each.name] = surface_of(planned, fit, touches)
            places[each.name] = touches.points(at)
            fits.setdefault(each.name, fit)
        if position > 1:
            shared = [n for n in own if n in surfaces and own[n].kind in CENTRED]
            if len(shared) < MIN_POINTS:
                raise CalibrationError(
                    "measuring.not-tied",
                    position=position,
                    n_shared=len(shared),
                    needed=MIN_POINTS,
                )
            ties[position] = motion = tie(
                [surfaces[name].quantity for name in shared],
                [own[name].quantity for name in shared],
                touches.inputs,
            )
            own = {
                name: replace(each, quantity=motion.in_part(each.quantity))
                for name, each in own.items()
            }
            places = {name: motion.moved(each) for name, each in places.items()}
        for name, surface in own.items():
            surfaces.setdefault(name, surface)
            points.setdefault(name, places[name])
    ordered = {each.name: surfaces[each.name] for each in plan.features}
    return fits, ordered, points, ties


def _with_kinds(plan: Plan, touches: PartTouches) -> Plan:
    """Return a plan with the kinds that its touches show where it states none."""
    return structs.replace(
        plan,
        features=tuple(
            each
            if each.kind is not None
            else structs.replace(
                each,
                kind=recognised(each.name, kind_of(each.name, touches)),
                touches=None,
            )
            for each in plan.features
        ),
    )


def taught_plan(part: MeasuredPart) -> Plan:
    """Return the plan of a part with its features, as measured, for nominals."""

    def nominal_of(name: str, before: Nominal | None) -> Nominal:
        values, kind = part.features[name].in_part.values, part.features[name].kind
        sizes = dict(zip(SURFACES[kind].sizes, values[6:].tolist(), strict=True))
        radius = sizes.get("radius")
        found = Nominal(
            origin=tuple(values[:3].tolist()),
            axis=tuple(values[3:6].tolist()),
            diameter=None if radius is None else 2 * radius,
            length=sizes["length"] + 2 * sizes["radius"] if "length" in sizes else None,
            angle=float(np.rad2deg(2 * sizes["half_angle"]))
            if "half_angle" in sizes
            else None,
        )
        return before or found

    return structs.replace(
        part.plan,
        features=tuple(
            structs.replace(
                each,
                nominal=nominal_of(each.name, each.nominal),
                touches=len(part.touches.first_of(each.name)),
            )
            for each in part.plan.features
        ),
    )


def kind_of(name: str, touches: PartTouches) -> FeatureKind | None:
    """Return the kind that the touches of a feature show, if they do."""
    at = touches.first_of(name)
    if not len(at):
        return None
    return recognise(
        touches.points_cam[at], touches.noise(at), touches.approaches_cam[at]
    )


def _fitted(planned: PlannedFeature, touches: PartTouches) -> Feature:
    at = touches.of(planned.name)
    if not len(at) or len(at) < (planned.touches or 0):
        raise CalibrationError(
            "measuring.missing-touches",
            name=planned.name,
            n_touches=len(at),
            needed=planned.touches or 1,
        )
    try:
        return _determined(planned, touches, at)
    except CalibrationError as error:
        raise CalibrationError(
            "measuring.of-feature", name=planned.name, said=error.message
        ) from error


def _determined(planned: PlannedFeature, touches: PartTouches, at: IntArray) -> Feature:
    """Return the fit to touches that lie on a feature of its kind and determine it."""
    kind, points = planned.kind, touches.points_cam[at]
    assert kind is not None
    feature = fit_feature(kind, points)
    off = float(np.linalg.norm(feature.distances, axis=1).max())
    extent = float(np.ptp(points, axis=0).max())
    noise = OUTLYING * touches.noise(at)
    limit = OTHER_KIND * extent + noise
    is_other = off > limit and kind is not FeatureKind.POINT
    if is_other and planned.known is None:
        raise CalibrationError("measuring.other-kind", kind=NAMES[kind], off=off)
    if kind in SOLID:
        height = fit_feature(FeatureKind.PLANE, points).form_error
        if height < FLAT_POINTS * extent + noise:
            raise CalibrationError("measuring.undetermined", kind=NAMES[kind])
    _require_determined(feature, touches, at)
    if planned.criterion == NEVER:
        return feature
    # The points that touch the zone define it; its U is taken from least squares.
    origin, axes, sizes, _ = fit_zone(kind, points, Criterion(planned.criterion))
    return replace(feature, origin=origin, axes=axes, sizes=sizes)


def _require_determined(feature: Feature, touches: PartTouches, at: IntArray) -> None:
    """Refuse touches that determine a feature by their noise alone."""
    columns = touches.columns(at)
    spread = feature.by_points @ touches.covariance[np.ix_(columns, columns)]
    variances = np.einsum("ij,ij->i", spread, feature.by_points)
    tilt = float(np.sqrt(variances[AXIS].sum()))
    sizes = np.sqrt(variances[6:]) > MAX_SPREAD * np.abs(feature.sizes)
    if tilt > MAX_SPREAD or sizes.any():
        raise CalibrationError("measuring.undetermined", kind=NAMES[feature.kind])


def _measured(
    plan: Plan,
    name: str,
    surface: TouchedSurface,
    fit: Feature | None,
    points: Quantity | None,
    alignment: Alignment | None,
) -> Measured:
    in_part = (
        surface.quantity if alignment is None else alignment.in_part(surface.quantity)
    )
    if fit is None:
        return Measured(surface, in_part)
    return Measured(surface, in_part, fit, points, plan.feature(name).nominal)


def _constructed(
    planned: PlannedConstruction, surfaces: Mapping[str, TouchedSurface]
) -> TouchedSurface:
    of = [surfaces[name] for name in planned.of]
    quantities = [each.quantity for each in of]
    flat = [each.kind in FLAT for each in of]
    axial = [each.kind in AXIAL for each in of]
    match planned.construct, len(of):
        case Construction.MIDPOINT, 2:
            found = derive(constructions.midpoint, *quantities)
        case Construction.PROJECTION, 2 if flat[1]:
            found = derive(constructions.projection_on_plane, *quantities)
        case Construction.PROJECTION, 2 if axial[1]:
            found = derive(constructions.projection_on_line, *quantities)
        case Construction.INTERSECTION, 2 if axial[0] and flat[1]:
            found = derive(constructions.intersection_of_line_and_plane, *quantities)
        case Construction.INTERSECTION, 2 if flat[0] and axial[1]:
            found = derive(
                constructions.intersection_of_line_and_plane, *quantities[::-1]
            )
        case Construction.INTERSECTION, 2 if all(flat):
            line = derive(constructions.intersection_of_planes, *quantities)
            return TouchedSurface(FeatureKind.LINE, line, Side.OUTSIDE, Evidence.NONE)
        case Construction.INTERSECTION, 3 if all(flat):
            found = derive(constructions.intersection_of_three_planes, *quantities)
        case Construction.APEX, 1 if of[0].kind is FeatureKind.CONE:
            found = derive(constructions.apex, *quantities)
        case _:
            raise CalibrationError("measuring.no-construction", name=planned.name)
    point = derive(lambda place: np.concatenate([place, [0.0, 0.0, 1.0]]), found)
    return TouchedSurface(FeatureKind.POINT, point, Side.OUTSIDE, Evidence.NONE)


def _aligned(plan: Plan, surfaces: Mapping[str, TouchedSurface]) -> Alignment | None:
    planned = plan.alignment
    if planned is None:
        return None
    if planned.points:
        nominals = [plan.feature(name).nominal for name in planned.points]
        places = np.array([each.origin for each in nominals if each is not None])
        return align_points([surfaces[n].quantity for n in planned.points], places)
    return align_321(
        surfaces[planned.plane].quantity,
        surfaces[planned.line].quantity,
        surfaces[planned.point].quantity,
    )


def _result(
    plan: Plan,
    planned: PlannedCharacteristic,
    features: Mapping[str, Measured],
    touches: PartTouches,
) -> CharacteristicResult:
    inputs = touches.inputs
    value, quantity = evaluate(planned, features, inputs)
    independent = None
    if quantity is not None:
        alone = quantity.uncertainty(touches.independent_inputs)
        independent = float(alone[0])
    if planned.tolerance is None:
        return CharacteristicResult(planned, value, independent, None, None, quantity)
    lower, upper = planned.limits
    return CharacteristicResult(
        planned,
        value,
        independent,
        decide(plan.rule, value.value, value.uncertainty, lower=lower, upper=upper),
        conformity_probability(
            value.value, value.uncertainty, lower=lower, upper=upper
        ),
        quantity,
    )
