"""Coverage of postures in a swing, and whether they determine the tip.

The direction ``a`` of the pen frame along which the tip can be found must itself turn
in the camera: the scatter matrix of the rotations, ``mean (R_i - R)^T (R_i - R)``, says
by how much. A swing about one axis leaves that axis without scatter.
"""

import math
from dataclasses import dataclass

import numpy as np

from lightpen.arrays import FloatArray, IntArray
from lightpen.errors import CalibrationError
from lightpen.messages import Message, message
from lightpen.model.posture import directions_of, tilts_of
from lightpen.model.rigid import nearest_rotation

MIN_SPREAD = np.radians(3.0)  # rms turn of the worst direction; a cone of 3 degrees
TILT_RINGS = (np.radians(8.0), np.radians(20.0))  # upright, leaning, leaning far
N_DIRECTIONS = 8
DIRECTION_NAMES = (
    "to the right",
    "to the right and away from the camera",
    "away from the camera",
    "to the left and away from the camera",
    "to the left",
    "to the left and towards the camera",
    "towards the camera",
    "to the right and towards the camera",
)


@dataclass(frozen=True, eq=False)
class Coverage:
    """Postures of a swing."""

    # (N,), angle between the pen's axis (its y) and upright (-v of the camera), rad
    tilts: FloatArray
    # (N,), where the pen leans, as the camera sees it: 0 to the right, pi/2 away from
    # the camera, rad
    directions: FloatArray
    turns: FloatArray  # (N,), turn about the pen's own axis from the mean posture, rad
    counts: IntArray  # (2, 8), images leaning, and leaning far, by direction
    n_upright: int  # images with hardly any tilt
    # (3,), rms turn of the worst to the best direction of the pen frame, rad
    spread: FloatArray
    # (3, 3), these directions, unit vectors of the pen frame, one a row
    axes: FloatArray

    @property
    def missing(self) -> list[str]:
        """Names of the directions without a tilted posture."""
        leant = self.counts.sum(axis=0) > 0
        return [
            name for name, seen in zip(DIRECTION_NAMES, leant, strict=True) if not seen
        ]


def measure_coverage(rotations: FloatArray) -> Coverage:
    """Return the posture coverage of rotations (N, 3, 3) of cam_from_pen."""
    counts = dial_counts(rotations)
    spread, axes = posture_spread(rotations)
    mean = nearest_rotation(rotations.mean(axis=0))
    relative = mean.T @ rotations
    return Coverage(
        tilts=tilts_of(rotations),
        directions=directions_of(rotations),
        turns=np.arctan2(
            relative[:, 0, 2] - relative[:, 2, 0], relative[:, 0, 0] + relative[:, 2, 2]
        ),
        counts=counts[1:],
        n_upright=int(counts[0, 0]),
        spread=spread,
        axes=axes,
    )


def posture_spread(rotations: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the spread of the pen's rotations cam_from_pen (N, 3, 3).

    That is the rms turn of three orthogonal directions, the least first, (3,), rad, and
    these directions, unit vectors of the pen frame, one a row.
    """
    deviations = rotations - rotations.mean(axis=0)
    scatter = np.einsum("nki,nkj->ij", deviations, deviations) / len(rotations)
    values, vectors = np.linalg.eigh(scatter)
    return np.sqrt(np.maximum(values, 0)), vectors.T


def require_spread(rotations: FloatArray) -> None:
    """Refuse rotations (N, 3, 3) that do not determine the tip, by what is missing."""
    spread, axes = posture_spread(rotations)
    if spread[0] >= MIN_SPREAD:
        return
    found, needed = float(np.degrees(spread[0])), math.degrees(MIN_SPREAD)
    if spread[1] < MIN_SPREAD:
        raise CalibrationError("coverage.hardly-moved", found=found, needed=needed)
    raise CalibrationError(
        "coverage.one-axis",
        axis=_axis_name(axes[0]),
        found=found,
        needed=needed,
        advice=_advice(axes[0]),
    )


def _axis_name(axis: FloatArray) -> Message:
    largest = int(np.argmax(np.abs(axis)))
    if abs(axis[largest]) > 0.9:
        return message("pen.axis", axis="xyz"[largest])
    x, y, z = axis.tolist()
    return message("pen.direction", x=x, y=y, z=z)


def _advice(axis: FloatArray) -> Message:
    largest = int(np.argmax(np.abs(axis)))
    return (
        message("coverage.lean-sideways"),
        message("coverage.tilt"),
        message("coverage.lean-forth"),
    )[largest]


def dial_counts(rotations: FloatArray) -> IntArray:
    """Return the number of postures (N, 3, 3) in each field of the dial, (3, 8).

    The rows are upright, leaning, leaning far; the columns the directions from the
    right against the clock, as `DIRECTION_NAMES` has them. All upright ones are in the
    first column.
    """
    ring = np.digitize(tilts_of(rotations), TILT_RINGS)
    sector = np.rint(directions_of(rotations) / (2 * np.pi / N_DIRECTIONS)).astype(int)
    counts = np.zeros((3, N_DIRECTIONS), dtype=np.int64)
    np.add.at(counts, (ring, np.where(ring > 0, sector % N_DIRECTIONS, 0)), 1)
    return counts
