"""Features constructed from others, or recognised by their points."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen_extensions.measure.measuring.features import (
    AXIS,
    PLACE,
    Feature,
    fit_feature,
)
from lightpen_extensions.measure.measuring.plan import Construction
from lightpen_extensions.measure.measuring.surfaces import (
    AXIAL,
    FLAT,
    NAMES,
    SURFACES,
    FeatureKind,
)


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


def midpoint(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return the point halfway between two origins, (3,)."""
    return np.asarray((first[PLACE] + second[PLACE]) / 2)


def projection_on_plane(feature: FloatArray, plane: FloatArray) -> FloatArray:
    """Return the foot of an origin on a plane, (3,)."""
    normal = _unit(plane[AXIS])
    height = (feature[PLACE] - plane[PLACE]) @ normal
    return np.asarray(feature[PLACE] - height * normal)


def projection_on_line(feature: FloatArray, line: FloatArray) -> FloatArray:
    """Return the foot of an origin on a line or axis, (3,)."""
    along = _unit(line[AXIS])
    return np.asarray(line[PLACE] + ((feature[PLACE] - line[PLACE]) @ along) * along)


def intersection_of_line_and_plane(line: FloatArray, plane: FloatArray) -> FloatArray:
    """Return the intersection of a line and a plane, (3,)."""
    normal = plane[AXIS]
    share = ((plane[PLACE] - line[PLACE]) @ normal) / (line[AXIS] @ normal)
    return np.asarray(line[PLACE] + share * line[AXIS])


def intersection_of_planes(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return the line in which two planes meet: a point of it, and its direction."""
    normals = np.stack([_unit(first[AXIS]), _unit(second[AXIS])])
    along = _unit(np.cross(normals[0], normals[1]))
    middle = midpoint(first, second)
    heights = np.array(
        [normals[0] @ (first[PLACE] - middle), normals[1] @ (second[PLACE] - middle)]
    )
    point = middle + np.linalg.pinv(normals) @ heights
    return np.concatenate([point, along])


def intersection_of_three_planes(
    first: FloatArray, second: FloatArray, third: FloatArray
) -> FloatArray:
    """Return the corner of three planes, (3,)."""
    normals = np.stack([first[AXIS], second[AXIS], third[AXIS]])
    heights = [plane[AXIS] @ plane[PLACE] for plane in (first, second, third)]
    return np.asarray(np.linalg.solve(normals, np.array(heights)), dtype=np.float64)


def apex(cone: FloatArray) -> FloatArray:
    """Return the tip of a cone, (3,)."""
    radius, half_angle = cone[6:]
    return np.asarray(cone[PLACE] - radius / np.tan(half_angle) * _unit(cone[AXIS]))


class Constructor(NamedTuple):
    """Kind of a constructed feature, and how it follows from the values of others."""

    kind: FeatureKind
    made_from: Callable[..., FloatArray]
    order: tuple[int, ...]  # of the others among its arguments


def constructor(
    construct: Construction, kinds: Sequence[FeatureKind | None]
) -> Constructor | None:
    """Return how a feature is constructed from others of some kinds; None if not.

    A kind that is not known yet is taken for one that fits.
    """
    flat = [each is None or each in FLAT for each in kinds]
    axial = [each is None or each in AXIAL for each in kinds]
    point = FeatureKind.POINT
    match construct, len(kinds):
        case Construction.MIDPOINT, 2:
            return Constructor(point, midpoint, (0, 1))
        case Construction.PROJECTION, 2 if flat[1]:
            return Constructor(point, projection_on_plane, (0, 1))
        case Construction.PROJECTION, 2 if axial[1]:
            return Constructor(point, projection_on_line, (0, 1))
        case Construction.INTERSECTION, 2 if all(flat):
            return Constructor(FeatureKind.LINE, intersection_of_planes, (0, 1))
        case Construction.INTERSECTION, 2 if axial[0] and flat[1]:
            return Constructor(point, intersection_of_line_and_plane, (0, 1))
        case Construction.INTERSECTION, 2 if flat[0] and axial[1]:
            return Constructor(point, intersection_of_line_and_plane, (1, 0))
        case Construction.INTERSECTION, 3 if all(flat):
            return Constructor(point, intersection_of_three_planes, (0, 1, 2))
        case Construction.APEX, 1 if kinds[0] in {None, FeatureKind.CONE}:
            return Constructor(point, apex, (0,))
    return None


# Recognition of features: the simplest kind that the points lie on.
#
# Kinds are tried in the order point, line, circle, plane, sphere, cylinder, cone; each
# needs more points than determine it, except a single point. A kind is recognised if
# the points lie within a form error that parts usually have, or within their noise.


SIMPLEST_FIRST = (
    FeatureKind.LINE,
    FeatureKind.CIRCLE,
    FeatureKind.PLANE,
    FeatureKind.SPHERE,
    FeatureKind.CYLINDER,
    FeatureKind.CONE,
)
FORM = 0.05  # mm, off a feature that is of its kind
DEVIATIONS = 4.0  # of the noise, likewise
LARGEST = 20.0  # times the extent of the points: a larger radius is a plane's
FACING = 0.7  # cosine of approach and normal, from which a face was touched
SURE = 5  # points on a circle that are not on a plane by chance
FLATTEST, SHARPEST = np.radians([80.0, 1.0])  # half angles of a cone


def recognise(
    points: FloatArray, noise: float, approaches: FloatArray | None = None
) -> FeatureKind | None:
    """Return the kind of feature that points lie on; None if they do not show it.

    The ball centres (N, 3), mm, have a noise, mm, that they do not share. Approaches
    (N, 3) are unit vectors along which the ball came; NaN if unknown.
    """
    if len(points) == 1:
        return FeatureKind.POINT
    limit = max(FORM, DEVIATIONS * noise)
    for kind in SIMPLEST_FIRST:
        fit = _redundant_fit(kind, points)
        if fit is None:
            continue
        off = float(np.linalg.norm(fit.distances, axis=1).max())
        if off <= limit and _is_plausible(fit, points, limit, approaches):
            return kind
    return None


def recognised(name: str, kind: FeatureKind | None) -> FeatureKind:
    """Return a recognised kind, or raise `CalibrationError` if there is none."""
    if kind is None:
        kinds = ", ".join(str(NAMES[each]) for each in FeatureKind)
        raise CalibrationError("measuring.not-recognised", name=name, kinds=kinds)
    return kind


def _redundant_fit(kind: FeatureKind, points: FloatArray) -> Feature | None:
    surface = SURFACES[kind]
    if len(points) <= surface.min_points:
        return None
    try:
        return fit_feature(kind, points)
    except CalibrationError:
        return None


def _is_plausible(
    fit: Feature, points: FloatArray, limit: float, approaches: FloatArray | None
) -> bool:
    extent = float(np.ptp(points, axis=0).max())
    if fit.kind is FeatureKind.CIRCLE:
        known = np.zeros(0) if approaches is None else np.abs(approaches @ fit.axis)
        known = known[np.isfinite(known)]
        is_face = known.size and float(np.median(known)) > FACING
        if is_face or (not known.size and len(points) < SURE):
            return False
    if fit.kind is FeatureKind.CONE:
        half = fit.size("half_angle")
        return bool(SHARPEST < half < FLATTEST)
    if not len(fit.sizes):
        return True
    radius = fit.size("radius")
    is_bent = extent**2 / (8 * radius) > limit  # the sagitta shows
    return is_bent and radius < LARGEST * extent
