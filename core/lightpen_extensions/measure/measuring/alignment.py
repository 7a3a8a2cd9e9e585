"""The frame of a part, by 3-2-1.

An alignment is the rigid motion ``part_from_cam``; as a quantity it has the values of a
rotation vector and a translation, with their derivative by all inputs, so that results
in the frame of the part hold what the alignment leaves uncertain.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from lightpen.arrays import FloatArray, IntArray
from lightpen.errors import CalibrationError
from lightpen.model.coverage import COVERAGE_FACTOR
from lightpen.model.rigid import rotation_from_vector, vector_from_rotation
from lightpen_extensions.measure.measuring.features import AXIS, PLACE, Feature

# Measured quantities that share their inputs: values with a common derivative.
#
# Everything measured in a session follows from one vector of inputs: the coordinates of
# all points and, if needed, the ball radius. A quantity keeps its derivative by all of
# them, so errors common to two quantities cancel in their difference.


STEP = float(np.finfo(float).eps ** (1 / 3))  # of central differences


@dataclass(frozen=True, eq=False)
class Quantity:
    """Values with their derivative by the inputs of the session."""

    values: FloatArray  # (M,)
    by_inputs: FloatArray  # (M, P)

    def covariance(self, inputs: FloatArray) -> FloatArray:
        """Return the covariance (M, M), given the covariance of the inputs (P, P)."""
        return np.asarray(self.by_inputs @ inputs @ self.by_inputs.T)

    def uncertainty(self, inputs: FloatArray) -> FloatArray:
        """Return U (k = 2) of each value, (M,)."""
        return np.asarray(COVERAGE_FACTOR * np.sqrt(np.diag(self.covariance(inputs))))


def quantity_of(
    feature: Feature, at: Sequence[int] | IntArray, n_inputs: int
) -> Quantity:
    """Return a feature's origin, axis and sizes as a quantity.

    The coordinates of its N points stand at ``at`` (N,) in the P inputs, three by
    three.
    """
    by_inputs = np.zeros((len(feature.values), n_inputs))
    columns = (np.asarray(at)[:, None] + np.arange(3)).ravel()
    by_inputs[:, columns] = feature.by_points
    return Quantity(feature.values, by_inputs)


def derive(
    function: Callable[..., FloatArray | float], *quantities: Quantity
) -> Quantity:
    """Return a function of quantities, with its derivative by central differences.

    The function takes the values of each quantity, and returns M values or one.
    """
    arguments = [quantity.values for quantity in quantities]
    values = np.atleast_1d(np.asarray(function(*arguments), dtype=float))
    by_inputs = np.zeros((len(values), quantities[0].by_inputs.shape[1]))
    for i, quantity in enumerate(quantities):
        for j, value in enumerate(quantity.values.tolist()):
            step = STEP * max(abs(value), 1.0)
            ends = []
            for sign in (1, -1):
                moved = arguments.copy()
                moved[i] = quantity.values.copy()
                moved[i][j] = value + sign * step
                ends.append(np.atleast_1d(function(*moved)))
            slope = (ends[0] - ends[1]) / (2 * step)
            by_inputs += np.outer(slope, quantity.by_inputs[j])
    return Quantity(values, by_inputs)


THIN = 1e-3  # sine of the angle between line and normal that determine no frame


@dataclass(frozen=True, eq=False)
class Alignment:
    """A part's frame."""

    motion: Quantity  # rotation vector and translation of part_from_cam, rad and mm

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
    return Alignment(derive(motion, primary, secondary, origin))
