"""Axis of a stylus from a rotation of the pen about it with the tip in the cone.

While the pen turns about its stylus, the direction of the stylus in the camera is
constant. So every pose i gives

    R_i axis_pen = axis_cam

with two unknown directions. The sum of the squared differences is least for the pair of
singular vectors of the mean rotation that belongs to its largest singular value [1]_.
The hand tilts the pen as it turns it; by how much, the differences show, and how that
carries over to the axis their derivatives by both directions.

References
----------
.. [1] G. H. Golub, C. F. Van Loan, "Matrix Computations", 4th ed., 2013, section 2.4.
"""

from dataclasses import dataclass

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.model.expanded_uncertainty import COVERAGE_FACTOR
from lightpen.model.posture import UPRIGHT_AXIS

MIN_POSES = 10
MIN_TURN = np.radians(40.0)  # with less, the tilt of the hand hides the axis
TURN_NOISE = np.radians(1.0)  # bias of a measured turn
MAX_UNCERTAINTY = np.radians(2.0)  # puts the surface of a 10 mm ball 0.003 mm off
MOST_ALIKE = 0.98  # lag-1 autocorrelation that can be distinguished from a drift
TINY = 1e-30


@dataclass(frozen=True, eq=False)
class SpinFit:
    """The axis that a pen was spun about."""

    axis_pen: FloatArray  # (3,), unit vector from the ball into the pen, pen frame
    axis_cam: FloatArray  # (3,), the same in the camera frame
    expanded_uncertainty: float  # U (k = 2) of its direction, rad
    turn: float  # angle that the pen was turned through, rad
    wobble: float  # by which the axis was tilted on the way, rms, rad


def fit_spin(rotations: FloatArray, upwards: FloatArray = UPRIGHT_AXIS) -> SpinFit:
    """Fit the axis of a stylus to poses that spin about it.

    Raises `CalibrationError` if there are too few poses, they turn too little, or the
    axis was not held still enough to be determined.

    Parameters
    ----------
    rotations : (N, 3, 3) array
        Of cam_from_pen, in the order of capture.
    upwards : (3,) array
        Roughly from the ball into the pen, pen frame.
    """
    n = len(rotations)
    if n < MIN_POSES:
        raise CalibrationError("spin.few-poses", n=n, needed=MIN_POSES)
    left, _, right = np.linalg.svd(rotations.mean(axis=0))
    sign = 1.0 if right[0] @ upwards >= 0 else -1.0
    axis_pen, axis_cam = sign * right[0], sign * left[:, 0]
    across_pen, across_cam = right[1:].T, left[:, 1:]
    turns = across_cam.T @ rotations @ across_pen  # 2 x 2 each
    angles = np.arctan2(
        turns[:, 1, 0] - turns[:, 0, 1], turns[:, 0, 0] + turns[:, 1, 1]
    )
    turn = float(np.ptp(np.unwrap(angles)))
    if turn < MIN_TURN - TURN_NOISE:
        raise CalibrationError(
            "spin.little-turn",
            turn=float(np.degrees(turn)),
            needed=float(np.degrees(MIN_TURN)),
        )
    tilts = rotations @ axis_pen @ across_cam
    uncertainty = COVERAGE_FACTOR * _axis_deviation(turns, tilts)
    if uncertainty > MAX_UNCERTAINTY:
        raise CalibrationError(
            "spin.wobbling",
            uncertainty=float(np.degrees(uncertainty)),
            needed=float(np.degrees(MAX_UNCERTAINTY)),
        )
    wobble = float(np.sqrt(np.mean(np.sum(tilts**2, axis=1))))
    return SpinFit(axis_pen, axis_cam, uncertainty, turn, wobble)


def _axis_deviation(turns: FloatArray, tilts: FloatArray) -> float:
    """Return the standard deviation of the axis along its worst direction, rad.

    ``turns`` (N, 2, 2) are derivatives of the tilts (N, 2), rad, of the axis in the
    camera by the axis in the pen; by that in the camera they are those of minus the
    identity.
    """
    n = len(tilts)
    design = np.concatenate(
        [turns, np.broadcast_to(-np.eye(2), turns.shape)], axis=2
    ).reshape(-1, 4)
    variance = float(np.sum(tilts**2)) / (2 * n - 4)
    # A hand tilts slowly: successive poses count less than independent ones.
    shifted = float(np.sum(tilts[1:] * tilts[:-1])) / max(float(np.sum(tilts**2)), TINY)
    correlation = min(max(shifted, 0.0), MOST_ALIKE)
    covariance = variance * np.linalg.pinv(design.T @ design)[:2, :2]
    covariance *= (1 + correlation) / (1 - correlation)
    return float(np.sqrt(np.linalg.eigvalsh(covariance).max()))
