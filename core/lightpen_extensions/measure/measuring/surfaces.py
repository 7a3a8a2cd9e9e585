"""The kinds of features, as distance functions in their own frames.

A feature has a frame (origin and axes) and sizes. A point at ``q`` in that frame has
one to three distances from the feature, each zero on it. Moving the frame by ``t`` and
rotating it by ``w`` (both in the frame) changes ``q`` by ``-t - w x q``. The gradient
``g`` of a distance by ``q`` gives its derivatives by the frame: ``-g`` and ``-q x g``.
Motions that leave a feature unchanged, as along a cylinder axis, are not free.
"""

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from functools import partial
from typing import NamedTuple

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.messages import message

TINY = 1e-300  # mm; a point on an axis has no direction from it


class FeatureKind(Enum):
    """Kinds of features, named as in a measuring plan."""

    POINT = "point"
    LINE = "line"
    PLANE = "plane"
    CIRCLE = "circle"
    SPHERE = "sphere"
    CYLINDER = "cylinder"
    CONE = "cone"


class Distances(NamedTuple):
    """Residuals of N points from a feature, K each."""

    values: FloatArray  # (N, K), mm
    by_point: FloatArray  # (N, K, 3), gradient by the point, frame of the feature
    by_sizes: FloatArray  # (N, K, S), derivative by the sizes of the feature


@dataclass(frozen=True)
class FeatureModel:
    """Properties of a kind of feature."""

    # Distances of points (N, 3) in the feature's frame, given its sizes (S,).
    distances: Callable[[FloatArray, FloatArray], Distances]
    free: tuple[int, ...]  # translations (0 to 2) and rotations (3 to 5) that change it
    sizes: tuple[str, ...] = ()  # names; lengths in mm, angles in rad

    def derivatives(
        self, q: FloatArray, sizes: FloatArray
    ) -> tuple[Distances, FloatArray]:
        """Return distances, with derivatives (N, K, U) by free motions and sizes."""
        found = self.distances(q, sizes)
        (x, y, z), (u, v, w) = q.T[:, :, None], found.by_point.transpose(2, 0, 1)
        columns = [-u, -v, -w, z * v - y * w, x * w - z * u, y * u - x * v]
        J = np.empty((*found.values.shape, self.n_unknowns))
        for column, i in enumerate(self.free):
            J[..., column] = columns[i]
        J[..., len(self.free) :] = found.by_sizes
        return found, J

    @property
    def n_unknowns(self) -> int:
        """The number of free motions and sizes."""
        return len(self.free) + len(self.sizes)

    @property
    def min_points(self) -> int:
        """The number of points that determine it."""
        n_distances = self.distances(
            np.eye(3)[:1], np.ones(len(self.sizes))
        ).values.size
        return -(-self.n_unknowns // n_distances)


def _coordinates(zero: slice, q: FloatArray, _: FloatArray) -> Distances:
    """Return those coordinates of points that are 0 on a point, line or plane."""
    values, by_point = q[:, zero], np.eye(3)[zero]
    n, k = values.shape
    by_point = np.broadcast_to(by_point, (n, k, 3))
    return Distances(values, by_point, np.zeros((n, k, 0)))


def _radial(across: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the lengths (N,) of vectors (N, D), and their directions."""
    lengths = np.sqrt(np.einsum("nd,nd->n", across, across))
    return lengths, across / np.maximum(lengths, TINY)[:, None]


def _round(n_axes: int, q: FloatArray, sizes: FloatArray) -> Distances:
    """Return distances from a sphere, of 3 axes, or from a cylinder about z, of 2."""
    lengths, outwards = _radial(q[:, :n_axes])
    gradient = np.zeros_like(q)
    gradient[:, :n_axes] = outwards
    return Distances(
        (lengths - sizes[0])[:, None], gradient[:, None], np.full((len(q), 1, 1), -1.0)
    )


PLANE, CYLINDER = partial(_coordinates, slice(2, 3)), partial(_round, 2)


def _cone(q: FloatArray, sizes: FloatArray) -> Distances:
    radius, half_angle = sizes
    cos, sin = np.cos(half_angle), np.sin(half_angle)
    lengths, outwards = _radial(q[:, :2])
    gradient = np.column_stack([cos * outwards, np.full(len(q), -sin)])
    by_angle = -(lengths - radius) * sin - q[:, 2] * cos
    return Distances(
        ((lengths - radius) * cos - q[:, 2] * sin)[:, None],
        gradient[:, None],
        np.stack([np.full(len(q), -cos), by_angle], axis=1)[:, None],
    )


def _circle(q: FloatArray, sizes: FloatArray) -> Distances:
    """Return distances from a circle: from the cylinder through it and its plane."""
    round_, height = CYLINDER(q, sizes), PLANE(q, sizes)
    of_sizes = np.concatenate([round_.by_sizes, np.zeros((len(q), 1, 1))], axis=1)
    return Distances(
        np.column_stack([round_.values, height.values]),
        np.concatenate([round_.by_point, height.by_point], axis=1),
        of_sizes,
    )


SURFACES = {
    FeatureKind.POINT: FeatureModel(partial(_coordinates, slice(0, 3)), (0, 1, 2)),
    FeatureKind.LINE: FeatureModel(partial(_coordinates, slice(0, 2)), (0, 1, 3, 4)),
    FeatureKind.PLANE: FeatureModel(PLANE, (2, 3, 4)),
    FeatureKind.CIRCLE: FeatureModel(_circle, (0, 1, 2, 3, 4), ("radius",)),
    FeatureKind.SPHERE: FeatureModel(partial(_round, 3), (0, 1, 2), ("radius",)),
    FeatureKind.CYLINDER: FeatureModel(CYLINDER, (0, 1, 3, 4), ("radius",)),
    FeatureKind.CONE: FeatureModel(_cone, (0, 1, 3, 4), ("radius", "half_angle")),
}

FLAT = {FeatureKind.PLANE}
AXIAL = {FeatureKind.LINE, FeatureKind.CYLINDER, FeatureKind.CONE}
CENTRED = {FeatureKind.POINT, FeatureKind.CIRCLE, FeatureKind.SPHERE}
RADIAL = {FeatureKind.CIRCLE, FeatureKind.SPHERE, FeatureKind.CYLINDER}  # of one size
ROUND = RADIAL | {FeatureKind.CONE}
NAMES = {
    FeatureKind.POINT: message("measuring.point"),
    FeatureKind.LINE: message("measuring.line"),
    FeatureKind.PLANE: message("measuring.plane"),
    FeatureKind.CIRCLE: message("measuring.circle"),
    FeatureKind.SPHERE: message("measuring.sphere"),
    FeatureKind.CYLINDER: message("measuring.cylinder"),
    FeatureKind.CONE: message("measuring.cone"),
}
