"""Constructed features: distance, angle, midpoint, projection, intersection.

Each takes the values of features, origin (3) and axis (3) first, and is a function for
`quantities.derive`.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from lightpen.arrays import FloatArray
from lightpen_extensions.measure.measuring.features import AXIS, PLACE
from lightpen_extensions.measure.measuring.plan import Construction
from lightpen_extensions.measure.measuring.surfaces import AXIAL, FLAT, FeatureKind


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
