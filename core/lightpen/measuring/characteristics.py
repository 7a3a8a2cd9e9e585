"""Characteristics of a part: sizes, distances, angles and geometrical deviations.

A size, distance or angle is a smooth function of the inputs; its U follows from its
derivative. A geometrical deviation is the width of a zone: the range of heights, or
twice the length of an offset. By the triangle inequality its error is at most the range
of the errors of the heights, or twice the length of the error of the offset. Their
quantile, over draws from the joint covariance, is its U.

References
----------
.. [1] ISO 1101:2017, "Tolerances of form, orientation, location and run-out".
.. [2] ISO 5459:2011, "Datums and datum systems".
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.measuring import constructions
from lightpen.measuring.compensation import TouchedSurface
from lightpen.measuring.features import AXIS, PLACE, Feature
from lightpen.measuring.plan import CharacteristicKind as Of
from lightpen.measuring.plan import Nominal, PlannedCharacteristic
from lightpen.measuring.quantities import Quantity, derive
from lightpen.measuring.surfaces import RADIAL, FeatureKind
from lightpen.measuring.zones import Criterion, fit_zone
from lightpen.model.expanded_uncertainty import COVERAGE

N_DRAWS = 4000
PARALLEL = 5.0  # degrees, between axes that are meant to be parallel
COORDINATES = {Of.X: 0, Of.Y: 1, Of.Z: 2}
AXIAL = {FeatureKind.LINE, FeatureKind.CYLINDER, FeatureKind.CONE}
FLAT = {FeatureKind.PLANE}
CENTRED = {FeatureKind.POINT, FeatureKind.CIRCLE, FeatureKind.SLOT, FeatureKind.SPHERE}
FORMS = {
    Of.STRAIGHTNESS: {FeatureKind.LINE},
    Of.FLATNESS: {FeatureKind.PLANE},
    Of.ROUNDNESS: {FeatureKind.CIRCLE, FeatureKind.SPHERE},
    Of.CYLINDRICITY: {FeatureKind.CYLINDER},
    Of.FORM: set(FeatureKind) - {FeatureKind.POINT, FeatureKind.SLOT},
}
SIZES = {
    Of.DIAMETER: RADIAL,
    Of.RADIUS: RADIAL,
    Of.WIDTH: {FeatureKind.SLOT},
    Of.LENGTH: {FeatureKind.SLOT},
    Of.CONE_ANGLE: {FeatureKind.CONE},
}
DEVIATIONS = {
    *FORMS,
    Of.POSITION,
    Of.PARALLELISM,
    Of.PERPENDICULARITY,
    Of.CONCENTRICITY,
}


@dataclass(frozen=True, eq=False)
class Measured:
    """A feature with all data for the evaluation of characteristics."""

    surface: TouchedSurface  # compensated by the ball radius, camera frame
    in_part: Quantity  # the same in the frame of the part
    feature: Feature | None = None  # fit to the ball centres; None if constructed
    points: Quantity | None = None  # ball centres, (3 n,), camera frame
    nominal: Nominal | None = None  # by design

    @property
    def kind(self) -> FeatureKind:
        """The kind of the feature."""
        return self.surface.kind


@dataclass(frozen=True)
class Value:
    """A characteristic: value and U (k = 2), mm or degrees."""

    value: float
    uncertainty: float


def evaluate(
    planned: PlannedCharacteristic, of: Mapping[str, Measured], inputs: FloatArray
) -> tuple[Value, Quantity | None]:
    """Return a characteristic, and its quantity if it is a smooth one.

    ``inputs`` is the covariance (P, P) of all inputs of the part. Raises
    `CalibrationError` if the characteristic is not defined for features of these kinds.
    """
    found = [of[name] for name in planned.of]
    if planned.quantity in DEVIATIONS:
        datum = of[planned.datum] if planned.datum else None
        return _deviation(planned, found, datum, inputs), None
    quantity = _smooth(planned, found)
    value, uncertainty = quantity.values[0], quantity.uncertainty(inputs)[0]
    return Value(float(value), float(uncertainty)), quantity


def _refused(planned: PlannedCharacteristic) -> CalibrationError:
    return CalibrationError("measuring.no-characteristic", name=planned.label)


def _smooth(planned: PlannedCharacteristic, found: list[Measured]) -> Quantity:
    quantity = planned.quantity
    match found:
        case [one] if quantity in COORDINATES:
            axis = COORDINATES[quantity]
            return derive(lambda values: values[axis], one.in_part)
        case [one] if one.kind in SIZES.get(quantity, ()):
            return derive(_SIZES[quantity], one.surface.quantity)
        case [one, two] if quantity is Of.DISTANCE:
            return _distance(planned, one, two)
        case [one, two] if quantity is Of.ANGLE:
            if {one.kind, two.kind} & {FeatureKind.POINT, FeatureKind.SPHERE}:
                raise _refused(planned)
            return _angle(one.surface.quantity, two.surface.quantity)
    raise _refused(planned)


_SIZES: dict[Of, Callable[[FloatArray], float]] = {
    Of.DIAMETER: lambda values: 2 * float(values[6]),
    Of.RADIUS: lambda values: float(values[6]),
    Of.WIDTH: lambda values: 2 * float(values[6]),
    Of.LENGTH: lambda values: float(values[7] + 2 * values[6]),
    Of.CONE_ANGLE: lambda values: 2 * float(np.rad2deg(values[7])),
}


def _angle(first: Quantity, second: Quantity) -> Quantity:
    """Return the angle between two directions without their signs, 0 to 90 degrees."""
    is_obtuse = first.values[AXIS] @ second.values[AXIS] < 0

    def angle(a: FloatArray, b: FloatArray) -> float:
        found = float(np.rad2deg(constructions.angle(a, b)))
        return 180 - found if is_obtuse else found

    return derive(angle, first, second)


def _distance(planned: PlannedCharacteristic, one: Measured, two: Measured) -> Quantity:
    """Return the distance of two features as their kinds define it, mm."""
    if one.kind in FLAT and two.kind not in FLAT:
        one, two = two, one
    first, second = one.surface.quantity, two.surface.quantity
    if two.kind in FLAT:
        height = constructions.distance_to_plane(first.values, second.values)
        sign = 1.0 if height >= 0 else -1.0
        return derive(
            lambda a, b: sign * constructions.distance_to_plane(a, b), first, second
        )
    if one.kind in AXIAL and two.kind in AXIAL:
        if _angle(first, second).values[0] > PARALLEL:
            return derive(constructions.distance_of_lines, first, second)
        return derive(constructions.distance_to_line, first, second)
    if one.kind in AXIAL:
        one, two, first, second = two, one, second, first
    if two.kind in AXIAL:
        return derive(constructions.distance_to_line, first, second)
    if one.kind in CENTRED and two.kind in CENTRED:
        return derive(constructions.distance, first, second)
    raise _refused(planned)


def _deviation(
    planned: PlannedCharacteristic,
    found: list[Measured],
    datum: Measured | None,
    inputs: FloatArray,
) -> Value:
    if len(found) != 1:
        raise _refused(planned)
    one, quantity = found[0], planned.quantity
    if quantity in FORMS:
        return _form(planned, one, inputs)
    if quantity is Of.POSITION:
        return _position(planned, one, inputs)
    if datum is None:
        raise CalibrationError("measuring.no-datum", name=planned.label)
    if quantity is Of.CONCENTRICITY:
        return _concentricity(planned, one, datum, inputs)
    return _orientation(planned, one, datum, inputs)


def _form(planned: PlannedCharacteristic, one: Measured, inputs: FloatArray) -> Value:
    """Return the form error by the minimum zone, with U by its residuals."""
    if one.kind not in FORMS[planned.quantity] or one.feature is None:
        raise _refused(planned)
    assert one.points is not None
    points = one.points.values.reshape(-1, 3)
    *_, width = fit_zone(one.kind, points, Criterion.MINIMUM_ZONE)
    n_points, n_distances = one.feature.distances.shape
    errors = one.feature.distances_by_points @ one.points.by_inputs
    drawn = _draws(errors, inputs).reshape(N_DRAWS, n_points, n_distances)
    if one.kind is FeatureKind.LINE:
        widths = 2 * np.linalg.norm(drawn, axis=2).max(axis=1)
    else:
        widths = np.ptp(drawn[:, :, 0], axis=1)
    return Value(width, float(np.quantile(widths, COVERAGE)))


def _draws(errors: FloatArray, inputs: FloatArray) -> FloatArray:
    """Return draws (N_DRAWS, M) of errors (M, P) of the inputs."""
    covariance = errors @ inputs @ errors.T
    values, vectors = np.linalg.eigh(covariance)
    root = vectors * np.sqrt(np.clip(values, 0, None))
    rng = np.random.default_rng(0)
    return np.asarray(rng.standard_normal((N_DRAWS, len(values))) @ root.T)


def _range(heights: Quantity, inputs: FloatArray) -> Value:
    """Return the range of heights, with its U."""
    errors = np.ptp(_draws(heights.by_inputs, inputs), axis=1)
    return Value(float(np.ptp(heights.values)), float(np.quantile(errors, COVERAGE)))


def _length(offset: Quantity, factor: float, inputs: FloatArray) -> Value:
    """Return the length of an offset times a factor, with its U."""
    errors = factor * np.linalg.norm(_draws(offset.by_inputs, inputs), axis=1)
    value = factor * float(np.linalg.norm(offset.values))
    return Value(value, float(np.quantile(errors, COVERAGE)))


def _orientation(
    planned: PlannedCharacteristic, one: Measured, datum: Measured, inputs: FloatArray
) -> Value:
    """Return parallelism or perpendicularity to a datum."""
    if one.points is None or datum.kind not in FLAT | AXIAL:
        raise _refused(planned)
    # A plane that is parallel to an axis contains it, so that roles change with kinds.
    along = (planned.quantity is Of.PARALLELISM) == (datum.kind in FLAT)
    if one.kind in FLAT:

        def heights(
            own: FloatArray, other: FloatArray, points: FloatArray
        ) -> FloatArray:
            normal, reference = own[AXIS], other[AXIS]
            if not along:
                reference = normal - (normal @ reference) * reference
                reference = reference / np.linalg.norm(reference)
            return np.asarray(points.reshape(-1, 3) @ reference)

        return _range(
            derive(heights, one.surface.quantity, datum.surface.quantity, one.points),
            inputs,
        )
    if one.kind not in AXIAL:
        raise _refused(planned)
    length = _extent(one)

    def tilt(own: FloatArray, other: FloatArray) -> FloatArray:
        axis, reference = length * own[AXIS], other[AXIS]
        part = (axis @ reference) * reference
        return part if along else axis - part

    offset = derive(tilt, one.surface.quantity, datum.surface.quantity)
    return _length(offset, 1.0, inputs)


def _extent(one: Measured) -> float:
    """Return the extent of the touches of a feature along its axis, mm."""
    assert one.points is not None
    along = one.points.values.reshape(-1, 3) @ one.surface.quantity.values[AXIS]
    return float(np.ptp(along))


def _position(
    planned: PlannedCharacteristic, one: Measured, inputs: FloatArray
) -> Value:
    """Return the diameter of the zone about the nominal place that holds the feature.

    Twice the distance of a plane's touches from the nominal plane, of an axis' ends
    from the nominal axis, of other centres from the nominal centre; of circle and slot
    in their plane.
    """
    nominal = one.nominal
    if nominal is None or nominal.origin is None:
        raise CalibrationError("measuring.no-nominal", name=planned.label)
    place = np.array(nominal.origin)
    if one.kind in {FeatureKind.POINT, FeatureKind.SPHERE}:
        return _length(
            derive(lambda values: values[PLACE] - place, one.in_part), 2.0, inputs
        )
    stated = (
        one.in_part.values[AXIS] if nominal.axis is None else np.array(nominal.axis)
    )
    axis = stated / np.linalg.norm(stated)
    if one.kind in FLAT:
        return _length(
            derive(lambda values: (values[PLACE] - place) @ axis, one.in_part),
            2.0,
            inputs,
        )

    def across(values: FloatArray, shift: float) -> FloatArray:
        way = values[PLACE] + shift * values[AXIS] - place
        return np.asarray(way - (way @ axis) * axis)

    return _at_ends(one, across, (one.in_part,), inputs)


def _at_ends(
    one: Measured,
    offset: Callable[..., FloatArray],
    quantities: tuple[Quantity, ...],
    inputs: FloatArray,
) -> Value:
    """Return twice the larger offset at both ends of an axis, or at a centre."""
    half = _extent(one) / 2 if one.kind in AXIAL else 0.0
    ends = [
        _length(derive(partial(offset, shift=shift), *quantities), 2.0, inputs)
        for shift in {half, -half}
    ]
    return max(ends, key=lambda end: end.value)


def _concentricity(
    planned: PlannedCharacteristic, one: Measured, datum: Measured, inputs: FloatArray
) -> Value:
    """Return the diameter of the zone about a datum axis or centre."""
    if one.kind not in CENTRED | AXIAL or datum.kind not in CENTRED | AXIAL:
        raise _refused(planned)
    is_about_axis = datum.kind in AXIAL | {FeatureKind.CIRCLE, FeatureKind.SLOT}

    def offset(own: FloatArray, other: FloatArray, shift: float) -> FloatArray:
        way = own[PLACE] + shift * own[AXIS] - other[PLACE]
        if is_about_axis:
            way = way - (way @ other[AXIS]) * other[AXIS]
        return np.asarray(way)

    quantities = one.surface.quantity, datum.surface.quantity
    return _at_ends(one, offset, quantities, inputs)
