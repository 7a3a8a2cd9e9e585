"""Measurement of a part: features, alignment and characteristics of a plan."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from math import inf

import numpy as np
from msgspec import structs

from lightpen.arrays import FloatArray, IntArray
from lightpen.errors import CalibrationError
from lightpen.model.artefacts import Side
from lightpen.model.coverage import Decision, conformity_probability, decide
from lightpen.model.limits import VerificationLimits
from lightpen.model.rigid import rotation_from_vector
from lightpen_extensions.measure.measuring.alignment import (
    Alignment,
    Quantity,
    align_321,
    derive,
    quantity_of,
)
from lightpen_extensions.measure.measuring.characteristics import (
    DEVIATIONS,
    FORMS,
    Measured,
    Value,
    evaluate,
)
from lightpen_extensions.measure.measuring.compensation import (
    Evidence,
    Normal,
    ProbedFeature,
    TouchedSurface,
    along_touches,
    surface_of,
)
from lightpen_extensions.measure.measuring.features import (
    AXIS,
    PLACE,
    Feature,
    fit_feature,
)
from lightpen_extensions.measure.measuring.next_touch import PartTouches
from lightpen_extensions.measure.measuring.plan import (
    CharacteristicKind,
    Nominal,
    Plan,
    PlannedCharacteristic,
    PlannedFeature,
)
from lightpen_extensions.measure.measuring.recognition import recognise, recognised
from lightpen_extensions.measure.measuring.surfaces import NAMES, SURFACES, FeatureKind

OTHER_KIND = 0.05  # of the extent of points: farther off they show another kind
FLAT_POINTS = 0.005  # of that extent: points as flat do not determine solids
SOLID = {FeatureKind.SPHERE, FeatureKind.CYLINDER, FeatureKind.CONE}
OUTLYING = 6.0  # of their noise, which is added to both
MAX_SPREAD = 0.1  # rad of an axis, or of a size: more is not determined
LYING = 0.2  # mm from a plane, of a point or line that was probed on it
FREE = 0.5  # singular value of residuals that a fit leaves free; the others are 0
TINY = 1e-12  # mm^2
MOST, FINER, N_FORMS = 3.0, 0.97, 400  # variances of form that are tried
ROUNDS = 3  # of alignments by points whose normals are stated in the frame they give


@dataclass(frozen=True, eq=False)
class CharacteristicResult:
    """A characteristic beside its tolerance."""

    planned: PlannedCharacteristic
    value: Value  # its U with that of a certified value
    lower: float  # limits, mm or degrees; infinite without a tolerance
    upper: float
    # None without a tolerance; open for a form that noise alone may put beyond the
    # limit of the station.
    decision: Decision | None
    probability: float | None  # probability of conformity (JCGM 106)

    @property
    def deviation(self) -> float | None:
        """Value less nominal, mm or degrees."""
        nominal = self.planned.nominal
        return None if nominal is None else self.value.value - nominal

    @property
    def margin(self) -> float:
        """The larger limit of the deviation, mm or degrees; infinite without one."""
        nominal = self.planned.nominal or 0.0
        return max(
            self.upper - nominal, nominal - self.lower if self.lower > -inf else 0
        )


@dataclass(frozen=True, eq=False)
class MeasuredPart:
    """A measured part."""

    plan: Plan
    touches: PartTouches
    features: Mapping[str, Measured]  # by name
    alignment: Alignment | None  # None if results are in the frame of the camera
    results: tuple[CharacteristicResult, ...]

    def uncertainty(self, name: str) -> FloatArray:
        """Return U (k = 2) of a feature's values in the frame of the part."""
        return self.features[name].in_part.uncertainty(self.touches.inputs)


def measure_part(
    plan: Plan, touches: PartTouches, limits: VerificationLimits | None = None
) -> MeasuredPart:
    """Measure a part by a plan.

    The limits judge the errors of certified values, and have the decision rule unless
    the plan states one. Raises `CalibrationError` if a feature has too few touches or
    none, its side or normal is unknown, or a characteristic is not defined for its
    features.
    """
    limits = limits or VerificationLimits()
    limits = replace(limits, rule=plan.rule or limits.rule)
    were_recognised = {each.name for each in plan.features if each.kind is None}
    plan = _with_kinds(plan, touches)
    probed = {each.name: _of_centres(each, touches) for each in plan.features}
    surfaces = _surfaces(plan, probed, touches, were_recognised)
    artefacts = {
        n for e in plan.characteristics if e.certified is not None for n in e.of
    }
    of_part = [each for name, each in probed.items() if name not in artefacts]
    with_form = _with_form(touches, of_part, surfaces)
    alignment = _aligned(plan, surfaces)
    features = {}
    for name, surface in surfaces.items():
        own = surface.quantity
        in_part = own if alignment is None else alignment.in_part(own)
        each = probed[name]
        nominal = each.planned.nominal
        features[name] = Measured(surface, in_part, each.fit, each.points, nominal)
    results = tuple(
        _result(
            planned,
            features,
            touches if planned.quantity in FORMS else with_form,
            limits,
        )
        for planned in plan.characteristics
    )
    return MeasuredPart(plan, with_form, features, alignment, results)


def _of_centres(planned: PlannedFeature, touches: PartTouches) -> ProbedFeature:
    """Return a feature of its ball centres."""
    at = touches.of(planned.name)
    fit = _fitted(planned, touches)
    quantity = quantity_of(fit, 3 * at, touches.n_inputs)
    if fit.kind in {FeatureKind.LINE, FeatureKind.CYLINDER}:
        quantity = along_touches(quantity, touches.points_cam[at])
    return ProbedFeature(planned, fit, at, quantity, touches.points(at))


def _with_form(
    touches: PartTouches,
    probed: Iterable[ProbedFeature],
    surfaces: Mapping[str, TouchedSurface],
) -> PartTouches:
    """Return touches as uncertain as the form of the part makes its features by them.

    Few points miss the feature of a whole surface by its form. The variance of form,
    along normals, is the most likely one by what all residuals show beyond the
    covariance of the points; where that is large they count little.
    """
    squares, variances, covariance = [], [], touches.covariance.copy()
    ways = np.zeros((len(touches.points_cam), 3, 3))  # normals, each with itself
    for each in probed:
        if each.kind is FeatureKind.POINT:
            continue
        if each.kind is FeatureKind.LINE:  # the hand chooses where across it
            way = surfaces[each.planned.name].quantity.values - each.quantity.values
            length = float(np.linalg.norm(way[PLACE]))
            unit = way[PLACE] / max(length, TINY)
            ways[each.at] = np.outer(unit, unit) if length > TINY else np.eye(3)
            continue
        normals = each.normals(touches)
        ways[each.at] = normals[:, :, None] * normals[:, None]
        columns, first = touches.columns(each.at), each.fit.distances.shape[1]
        follow = each.fit.distances_by_points[::first]
        axes, sizes, _ = np.linalg.svd(follow, full_matrices=False)
        free = axes[:, sizes > FREE]
        rows = free.T @ follow
        spread = rows @ touches.covariance[np.ix_(columns, columns)] @ rows.T
        own, turn = np.linalg.eigh(spread)
        squares.append((turn.T @ free.T @ each.fit.distances[:, 0]) ** 2)
        variances.append(own.clip(min=TINY))
    if not squares:
        return touches
    square, variance = np.concatenate(squares), np.concatenate(variances)
    forms = MOST * square.mean() * FINER ** np.arange(N_FORMS) + TINY
    weights = 1 / (variance[:, None] + forms)
    total = weights.sum(axis=0)
    freedom = total**2 / np.sum(weights**2, axis=0)
    # Less is expected, as few squares leave a variance uncertain.
    is_more = square @ weights**2 > total * freedom / (freedom + 2)
    if is_more.any():
        form = forms[np.argmax(is_more)]  # the largest of them
        for i, way in enumerate(ways):
            at = slice(3 * i, 3 * i + 3)
            covariance[at, at] += form * way
    return replace(touches, covariance=covariance)


def _surfaces(
    plan: Plan,
    probed: Mapping[str, ProbedFeature],
    touches: PartTouches,
    were_recognised: set[str],
) -> dict[str, TouchedSurface]:
    """Return the surfaces of all features.

    Points and lines come last: their normals are those of planes, or vectors in the
    frame of the part, whose directions the ball does not change.
    """
    compensates = touches.ball_radius > 0
    thin = {n: each for n, each in probed.items() if compensates and each.needs_normal}
    found = {
        n: surface_of(each, touches) for n, each in probed.items() if n not in thin
    }
    planes = {n: each for n, each in found.items() if each.kind is FeatureKind.PLANE}
    normals = {n: _normal_of_plane(each, planes, touches) for n, each in thin.items()}
    for name, each in thin.items():  # as long as the frame of the part is not known
        found[name] = TouchedSurface(
            each.kind, each.quantity, Side.CENTRE, Evidence.NONE
        )
    for _ in range(ROUNDS if thin else 0):
        frame = None if plan.alignment is None else _aligned(plan, found)
        for name, each in thin.items():
            normal = normals[name] or _normal_of_plan(each, frame)
            if normal is not None or name not in were_recognised:
                found[name] = surface_of(each, touches, normal)
    return {each.name: found[each.name] for each in plan.features}


def _normal_of_plane(
    probed: ProbedFeature, planes: Mapping[str, TouchedSurface], touches: PartTouches
) -> Normal | None:
    """Return the normal of the plane that the plan names, or that the feature is on."""
    named, points = probed.planned.surface, probed.points.values.reshape(-1, 3)
    limit = max(LYING, OUTLYING * touches.noise(probed.at))
    for name, plane in planes.items():
        place, normal = plane.quantity.values[PLACE], plane.quantity.values[AXIS]
        heights = (points - place) @ normal - touches.ball_radius
        is_on = not probed.planned.normal and bool((np.abs(heights) <= limit).all())
        if name == named or (not named and is_on):
            return Normal(derive(lambda p: p[AXIS], plane.quantity), Evidence.PLANE)
    return None


def _normal_of_plan(probed: ProbedFeature, frame: Alignment | None) -> Normal | None:
    """Return the normal that the plan states in the frame of the part, or camera."""
    stated = probed.planned.normal
    if stated is None:
        return None
    vector = np.array(stated) / np.linalg.norm(stated)
    if frame is None:
        fixed = Quantity(vector, np.zeros((3, probed.quantity.by_inputs.shape[1])))
        return Normal(fixed, Evidence.PLAN)
    turned = derive(lambda m: rotation_from_vector(m[:3]).T @ vector, frame.motion)
    return Normal(turned, Evidence.PLAN)


def _with_kinds(plan: Plan, touches: PartTouches) -> Plan:
    """Return a plan with the kinds that its touches show where it states none."""
    return structs.replace(
        plan,
        features=tuple(
            each
            if each.kind is not None
            else structs.replace(
                each,
                kind=recognised(each.name, feature_kind_of(each.name, touches)),
                touches=None,
            )
            for each in plan.features
        ),
    )


def taught_plan(part: MeasuredPart) -> Plan:
    """Return the plan of a part with its features, as measured, for nominals."""

    def nominal_of(name: str) -> Nominal:
        values, kind = part.features[name].in_part.values, part.features[name].kind
        sizes = dict(zip(SURFACES[kind].sizes, values[6:].tolist(), strict=True))
        radius, half = sizes.get("radius"), sizes.get("half_angle")
        return Nominal(
            origin=tuple(values[:3].tolist()),
            axis=tuple(values[3:6].tolist()),
            diameter=None if radius is None else 2 * radius,
            angle=None if half is None else float(np.rad2deg(2 * half)),
        )

    return structs.replace(
        part.plan,
        features=tuple(
            structs.replace(
                each,
                nominal=each.nominal or nominal_of(each.name),
                side=part.features[each.name].surface.side
                if each.kind is not FeatureKind.PLANE
                and part.features[each.name].surface.evidence is Evidence.NONE
                else each.side,
                touches=len(part.touches.of(each.name)),
            )
            for each in part.plan.features
        ),
    )


def feature_kind_of(name: str, touches: PartTouches) -> FeatureKind | None:
    """Return the kind that the touches of a feature show, if they do."""
    at = touches.of(name)
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
    if off > limit and kind is not FeatureKind.POINT:
        raise CalibrationError("measuring.other-kind", kind=NAMES[kind], off=off)
    if kind in SOLID:
        height = fit_feature(FeatureKind.PLANE, points).form_error
        if height < FLAT_POINTS * extent + noise:
            raise CalibrationError("measuring.undetermined", kind=NAMES[kind])
    _require_determined(feature, touches, at)
    return feature


def _require_determined(feature: Feature, touches: PartTouches, at: IntArray) -> None:
    """Refuse touches that determine a feature by their noise alone."""
    columns = touches.columns(at)
    spread = feature.by_points @ touches.covariance[np.ix_(columns, columns)]
    variances = np.einsum("ij,ij->i", spread, feature.by_points)
    tilt = float(np.sqrt(variances[AXIS].sum()))
    sizes = np.sqrt(variances[6:]) > MAX_SPREAD * np.abs(feature.sizes)
    if tilt > MAX_SPREAD or sizes.any():
        raise CalibrationError("measuring.undetermined", kind=NAMES[feature.kind])


def _aligned(plan: Plan, surfaces: Mapping[str, TouchedSurface]) -> Alignment | None:
    planned = plan.alignment
    if planned is None:
        return None
    return align_321(
        surfaces[planned.plane].quantity,
        surfaces[planned.line].quantity,
        surfaces[planned.point].quantity,
    )


def _result(
    planned: PlannedCharacteristic,
    features: Mapping[str, Measured],
    touches: PartTouches,
    limits: VerificationLimits,
) -> CharacteristicResult:
    value = evaluate(planned, features, touches)
    lower, upper = planned.limits
    if planned.certified is not None:
        both = float(np.hypot(value.uncertainty, planned.certified))
        value = replace(value, uncertainty=both)
        if planned.tolerance is None:
            lower, upper = _limits_of_error(planned, limits)
    decision, probability = None, None
    if upper < inf:
        of_value = value.value, value.uncertainty
        decision = decide(
            *(limits.rule, *of_value),
            lower=lower,
            upper=upper,
            max_risk=limits.risk / 100,
        )
        probability = conformity_probability(*of_value, lower=lower, upper=upper)
        is_form = planned.tolerance is None and planned.quantity in DEVIATIONS
        if is_form and value.value - value.uncertainty <= upper < value.value:
            decision = Decision.OPEN
    return CharacteristicResult(planned, value, lower, upper, decision, probability)


def _limits_of_error(
    planned: PlannedCharacteristic, limits: VerificationLimits
) -> tuple[float, float]:
    """Return the limits of a certified value by the limits of the station."""
    nominal = planned.nominal or 0.0
    match planned.quantity:
        case CharacteristicKind.RADIUS:
            limit = limits.radius
        case CharacteristicKind.DIAMETER:
            limit = 2 * limits.radius
        case CharacteristicKind.LENGTH | CharacteristicKind.DISTANCE:
            limit = limits.length_error(nominal)
        case _ if planned.quantity in DEVIATIONS:
            return -inf, nominal + limits.form
        case _:
            return -inf, inf
    return nominal - limit, nominal + limit
