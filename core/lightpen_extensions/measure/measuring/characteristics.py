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

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.model.artefacts import Side
from lightpen.model.coverage import COVERAGE, symmetric_root
from lightpen_extensions.measure.measuring.alignment import Quantity, derive
from lightpen_extensions.measure.measuring.compensation import TouchedSurface
from lightpen_extensions.measure.measuring.features import AXIS, PLACE, Feature
from lightpen_extensions.measure.measuring.next_touch import PartTouches
from lightpen_extensions.measure.measuring.plan import CharacteristicKind as Of
from lightpen_extensions.measure.measuring.plan import Nominal, PlannedCharacteristic
from lightpen_extensions.measure.measuring.surfaces import (
    AXIAL,
    CENTRED,
    FLAT,
    RADIAL,
    FeatureKind,
)

N_DRAWS = 4000
PARALLEL = 5.0  # degrees, between axes that are meant to be parallel
COORDINATES = {Of.X: 0, Of.Y: 1, Of.Z: 2}
FORMS = {
    Of.STRAIGHTNESS: {FeatureKind.LINE},
    Of.FLATNESS: {FeatureKind.PLANE},
    Of.ROUNDNESS: {FeatureKind.CIRCLE, FeatureKind.SPHERE},
    Of.CYLINDRICITY: {FeatureKind.CYLINDER},
    Of.FORM: set(FeatureKind) - {FeatureKind.POINT},
}
NEEDS_DATUM = {Of.PARALLELISM, Of.PERPENDICULARITY, Of.CONCENTRICITY}
DEVIATIONS = {*FORMS, *NEEDS_DATUM, Of.POSITION}
OF_TWO = {Of.DISTANCE, Of.ANGLE, Of.LENGTH}
# The kinds of its features, and of its datum; others are defined for all.
KINDS: dict[Of, set[FeatureKind]] = {
    **FORMS,
    Of.DIAMETER: RADIAL,
    Of.RADIUS: RADIAL,
    Of.CONE_ANGLE: {FeatureKind.CONE},
    Of.LENGTH: {FeatureKind.POINT},
    Of.ANGLE: set(FeatureKind) - {FeatureKind.POINT, FeatureKind.SPHERE},
    Of.PARALLELISM: FLAT | AXIAL,
    Of.PERPENDICULARITY: FLAT | AXIAL,
    Of.CONCENTRICITY: CENTRED | AXIAL,
}
ENDS = {Side.INSIDE: 1.0, Side.OUTSIDE: -1.0, Side.CENTRE: 0.0}


def _unit(vector: FloatArray) -> FloatArray:
    return np.asarray(vector / np.linalg.norm(vector))


def distance(first: FloatArray, second: FloatArray) -> float:
    """Return the distance of two origins, mm."""
    return float(np.linalg.norm(second[PLACE] - first[PLACE]))


def distance_to_plane(feature: FloatArray, plane: FloatArray) -> float:
    """Return the signed distance of an origin from a plane, mm."""
    return float((feature[PLACE] - plane[PLACE]) @ _unit(plane[AXIS]))


def distance_to_line(feature: FloatArray, line: FloatArray) -> float:
    """Return the distance of an origin from a line or axis, mm."""
    way = feature[PLACE] - line[PLACE]
    return float(np.linalg.norm(np.cross(_unit(line[AXIS]), way)))


def distance_of_lines(first: FloatArray, second: FloatArray) -> float:
    """Return the shortest distance of two lines that are not parallel, mm."""
    normal = _unit(np.cross(first[AXIS], second[AXIS]))
    return abs(float((second[PLACE] - first[PLACE]) @ normal))


def angle(first: FloatArray, second: FloatArray) -> float:
    """Return the angle between two axes or normals as they point, 0 to pi, rad."""
    a, b = first[AXIS], second[AXIS]
    return float(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b))


def is_defined(
    quantity: Of, kinds: Sequence[FeatureKind | None], datum: FeatureKind | None = None
) -> bool:
    """Return whether a characteristic is defined for kinds; None is not known yet."""
    if len(kinds) != (2 if quantity in OF_TWO else 1):
        return False
    allowed = KINDS.get(quantity, set(FeatureKind))
    used = [*kinds, datum] if quantity in NEEDS_DATUM else kinds
    return all(each is None or each in allowed for each in used)


@dataclass(frozen=True, eq=False)
class Measured:
    """A feature with all data for the evaluation of characteristics."""

    surface: TouchedSurface  # compensated by the ball radius, camera frame
    in_part: Quantity  # the same in the frame of the part
    feature: Feature  # fit to the ball centres
    points: Quantity  # ball centres, (3 n,), camera frame
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
    planned: PlannedCharacteristic, of: Mapping[str, Measured], touches: PartTouches
) -> Value:
    """Return the value of a characteristic.

    Raises `CalibrationError` if the characteristic is not defined for features of these
    kinds.
    """
    found = [of[name] for name in planned.of]
    datum = of[planned.datum] if planned.datum else None
    kinds = [each.kind for each in found]
    if not is_defined(planned.quantity, kinds, None if datum is None else datum.kind):
        raise _refused(planned)
    if planned.quantity in DEVIATIONS:
        return _deviation(planned, found[0], datum, touches.inputs)
    quantity = _smooth(planned.quantity, found, touches.ball)
    uncertainty = quantity.uncertainty(touches.inputs)[0]
    return Value(float(quantity.values[0]), float(uncertainty))


def _refused(planned: PlannedCharacteristic) -> CalibrationError:
    return CalibrationError("measuring.no-characteristic", name=planned.label)


def _smooth(quantity: Of, found: list[Measured], ball: Quantity) -> Quantity:
    if quantity in COORDINATES:
        axis = COORDINATES[quantity]
        return derive(lambda values: values[axis], found[0].in_part)
    if quantity in _SIZES:
        return derive(_SIZES[quantity], found[0].surface.quantity)
    one, two = found
    if quantity is Of.ANGLE:
        return _angle(one.surface.quantity, two.surface.quantity)
    if quantity is Of.DISTANCE:
        return _distance(one, two)
    out = sum(ENDS[each.surface.side] for each in found)
    return derive(
        lambda a, b, radius: distance(a, b) + out * radius[0],
        *(one.surface.quantity, two.surface.quantity, ball),
    )


_SIZES: dict[Of, Callable[[FloatArray], float]] = {
    Of.DIAMETER: lambda values: 2 * float(values[6]),
    Of.RADIUS: lambda values: float(values[6]),
    Of.CONE_ANGLE: lambda values: 2 * float(np.rad2deg(values[7])),
}


def _angle(first: Quantity, second: Quantity) -> Quantity:
    """Return the angle between two directions without their signs, 0 to 90 degrees."""
    is_obtuse = first.values[AXIS] @ second.values[AXIS] < 0

    def acute(a: FloatArray, b: FloatArray) -> float:
        found = float(np.rad2deg(angle(a, b)))
        return 180 - found if is_obtuse else found

    return derive(acute, first, second)


def _distance(one: Measured, two: Measured) -> Quantity:
    """Return the distance of two features as their kinds define it, mm."""
    if one.kind in FLAT and two.kind not in FLAT:
        one, two = two, one
    first, second = one.surface.quantity, two.surface.quantity
    if two.kind in FLAT:
        height = distance_to_plane(first.values, second.values)
        sign = 1.0 if height >= 0 else -1.0
        return derive(lambda a, b: sign * distance_to_plane(a, b), first, second)
    if one.kind in AXIAL and two.kind in AXIAL:
        if _angle(first, second).values[0] > PARALLEL:
            return derive(distance_of_lines, first, second)
        return derive(distance_to_line, first, second)
    if one.kind in AXIAL:
        one, two, first, second = two, one, second, first
    if two.kind in AXIAL:
        return derive(distance_to_line, first, second)
    return derive(distance, first, second)


def _deviation(
    planned: PlannedCharacteristic,
    one: Measured,
    datum: Measured | None,
    inputs: FloatArray,
) -> Value:
    quantity = planned.quantity
    if quantity in FORMS:
        return _form(one, inputs)
    if quantity is Of.POSITION:
        return _position(planned, one, inputs)
    if datum is None:
        raise _refused(planned)
    if quantity is Of.CONCENTRICITY:
        return _concentricity(one, datum, inputs)
    return _orientation(planned, one, datum, inputs)


def _form(one: Measured, inputs: FloatArray) -> Value:
    """Return the form error about least squares, with U by its residuals."""
    n_points, n_distances = one.feature.distances.shape
    errors = one.feature.distances_by_points @ one.points.by_inputs
    drawn = _draws(errors, inputs).reshape(N_DRAWS, n_points, n_distances)
    if one.kind is FeatureKind.LINE:
        widths = 2 * np.linalg.norm(drawn, axis=2).max(axis=1)
    else:
        widths = np.ptp(drawn[:, :, 0], axis=1)
    return Value(one.feature.form_error, float(np.quantile(widths, COVERAGE)))


def _draws(errors: FloatArray, inputs: FloatArray) -> FloatArray:
    """Return draws (N_DRAWS, M) of errors (M, P) of the inputs."""
    draws = np.random.default_rng(0).standard_normal((N_DRAWS, len(errors)))
    return np.asarray(draws @ symmetric_root(errors @ inputs @ errors.T))


def _range(heights: Quantity, inputs: FloatArray) -> Value:
    """Return the range of heights, with its U."""
    errors = np.ptp(_draws(heights.by_inputs, inputs), axis=1)
    return Value(float(np.ptp(heights.values)), float(np.quantile(errors, COVERAGE)))


def _length(offset: Quantity, factor: float, inputs: FloatArray) -> Value:
    """Return the largest length of offsets, (3 n,), times a factor, with its U."""
    errors = _draws(offset.by_inputs, inputs).reshape(N_DRAWS, -1, 3)
    longest = np.linalg.norm(errors, axis=2).max(axis=1)
    value = np.linalg.norm(offset.values.reshape(-1, 3), axis=1).max()
    return Value(factor * float(value), factor * float(np.quantile(longest, COVERAGE)))


def _orientation(
    planned: PlannedCharacteristic, one: Measured, datum: Measured, inputs: FloatArray
) -> Value:
    """Return parallelism or perpendicularity to a datum."""
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
    length = _extent(one)

    def tilt(own: FloatArray, other: FloatArray) -> FloatArray:
        axis, reference = length * own[AXIS], other[AXIS]
        part = (axis @ reference) * reference
        return part if along else axis - part

    offset = derive(tilt, one.surface.quantity, datum.surface.quantity)
    return _length(offset, 1.0, inputs)


def _extent(one: Measured) -> float:
    """Return the extent of the touches of a feature along its axis, mm."""
    along = one.points.values.reshape(-1, 3) @ one.surface.quantity.values[AXIS]
    return float(np.ptp(along))


def _position(
    planned: PlannedCharacteristic, one: Measured, inputs: FloatArray
) -> Value:
    """Return the diameter of the zone about the nominal place that holds the feature.

    Twice the distance of a plane's touches from the nominal plane, of an axis' ends
    from the nominal axis, of other centres from the nominal centre; of a circle in its
    plane.
    """
    nominal = one.nominal
    if nominal is None or nominal.origin is None:
        raise _refused(planned)
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
            derive(lambda values: (values[PLACE] - place) @ axis * axis, one.in_part),
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

    def offsets(*values: FloatArray) -> FloatArray:
        return np.concatenate([offset(*values, shift=each) for each in (half, -half)])

    return _length(derive(offsets, *quantities), 2.0, inputs)


def _concentricity(one: Measured, datum: Measured, inputs: FloatArray) -> Value:
    """Return the diameter of the zone about a datum axis or centre."""
    is_about_axis = datum.kind in AXIAL | {FeatureKind.CIRCLE}

    def offset(own: FloatArray, other: FloatArray, shift: float) -> FloatArray:
        way = own[PLACE] + shift * own[AXIS] - other[PLACE]
        if is_about_axis:
            way = way - (way @ other[AXIS]) * other[AXIS]
        return np.asarray(way)

    quantities = one.surface.quantity, datum.surface.quantity
    return _at_ends(one, offset, quantities, inputs)
