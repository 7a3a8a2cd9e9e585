"""The frame of a part: by 3-2-1, or by nominal points.

An alignment is the rigid motion ``part_from_cam``; as a quantity it has the values of a
rotation vector and a translation, with their derivative by all inputs, so that results
in the frame of the part hold what the alignment leaves uncertain.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.model.rigid import (
    nearest_rotation,
    rotation_from_vector,
    vector_from_rotation,
)
from lightpen_extensions.measure.measuring.features import AXIS, PLACE
from lightpen_extensions.measure.measuring.quantities import (
    Quantity,
    derive,
    stacked_quantities,
)

MIN_POINTS = 3
THIN = 1e-3  # of the extent: points on a line determine no frame


@dataclass(frozen=True, eq=False)
class Alignment:
    """A part's frame."""

    motion: Quantity  # rotation vector and translation of part_from_cam, rad and mm
    residuals: FloatArray  # (N,), of datum points from nominals; empty for 3-2-1

    @property
    def rotation(self) -> FloatArray:
        """Rotation part_from_cam, (3, 3)."""
        return rotation_from_vector(self.motion.values[:3])

    @property
    def translation(self) -> FloatArray:
        """Translation part_from_cam, (3,), mm."""
        return self.motion.values[3:]

    def in_part(self, feature: Quantity) -> Quantity:
        """Return the values of a feature in the frame of the part."""
        return derive(_in_part, self.motion, feature)


def _in_part(motion: FloatArray, feature: FloatArray) -> FloatArray:
    R, t = rotation_from_vector(motion[:3]), motion[3:]
    place = R @ feature[PLACE] + t
    return np.concatenate([place, R @ feature[AXIS], feature[6:]])


def _as_motion(R: FloatArray, t: FloatArray) -> FloatArray:
    return np.concatenate([vector_from_rotation(R), t])


def align_321(primary: Quantity, secondary: Quantity, origin: Quantity) -> Alignment:
    """Align by a plane (z), a line or axis (x, projected), and a point (origin).

    The origin is the point projected on the primary plane. The normal of the plane and
    the direction of the line count as they are, with their sign.
    """

    def motion(plane: FloatArray, line: FloatArray, point: FloatArray) -> FloatArray:
        z = plane[AXIS] / np.linalg.norm(plane[AXIS])
        x = line[AXIS] - (line[AXIS] @ z) * z
        x = x / np.linalg.norm(x)
        R = np.stack([x, np.cross(z, x), z])
        height = (point[PLACE] - plane[PLACE]) @ z
        return _as_motion(R, -R @ (point[PLACE] - height * z))

    z, x = primary.values[AXIS], secondary.values[AXIS]
    if np.linalg.norm(np.cross(z, x)) < THIN * np.linalg.norm(z) * np.linalg.norm(x):
        raise CalibrationError("measuring.datums-parallel")
    return Alignment(derive(motion, primary, secondary, origin), np.zeros(0))


def align_points(points: Sequence[Quantity], nominals: FloatArray) -> Alignment:
    """Align by the origins of features with places (N, 3), mm, in the part.

    W. Kabsch, Acta Cryst. A32 (1976) 922-923.
    """
    n = len(points)
    actual = np.array([point.values[PLACE] for point in points])
    if n < MIN_POINTS or n != len(nominals):
        raise CalibrationError("measuring.few-datums", n_points=n, needed=MIN_POINTS)
    if min(_thinness(actual), _thinness(nominals)) < THIN:
        raise CalibrationError("measuring.datums-on-line")

    def motion(places: FloatArray) -> FloatArray:
        here = places.reshape(n, 3)
        middle, there = here.mean(axis=0), nominals.mean(axis=0)
        R = nearest_rotation((nominals - there).T @ (here - middle))
        return _as_motion(R, there - R @ middle)

    places = stacked_quantities(
        [Quantity(point.values[PLACE], point.by_inputs[PLACE]) for point in points]
    )
    found = derive(motion, places)
    R, t = rotation_from_vector(found.values[:3]), found.values[3:]
    return Alignment(found, np.linalg.norm(actual @ R.T + t - nominals, axis=1))


def _thinness(points: FloatArray) -> float:
    extents = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return float(extents[1] / max(extents[0], np.finfo(float).tiny))
