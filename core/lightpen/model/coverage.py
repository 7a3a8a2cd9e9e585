"""Which postures a swing holds, and whether they fix the tip at all.

The direction ``a`` of the pen frame along which the tip can be found must itself turn
in the camera: the scatter matrix of the rotations, ``mean (R_i - R)^T (R_i - R)``, says
by how much. A swing about one axis leaves that axis without scatter.
"""

import math
from dataclasses import dataclass

import numpy as np

from lightpen.arrays import FloatArray, IntArray
from lightpen.errors import CalibrationError
from lightpen.model.posture import directions_of, tilts_of
from lightpen.model.rigid import nearest_rotation
from lightpen.sentences import Sentence, sentence

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
    """Postures of a swing.

    Attributes
    ----------
    tilts : (N,) array
        Angle between the pen's axis (its y) and upright (-v of the camera), rad.
    directions : (N,) array
        Where the pen leans, as the camera sees it: 0 to the right, pi/2 away from
        the camera, rad.
    turns : (N,) array
        Turn about the pen's own axis from the mean posture, rad.
    counts : (2, 8) array of int
        Images leaning moderately and far, by direction from the right.
    n_upright : int
        Images with hardly any tilt.
    spread : (3,) array
        Rms turn of the worst to the best direction of the pen frame, rad.
    axes : (3, 3) array
        These directions, unit vectors of the pen frame, one a row.
    """

    tilts: FloatArray
    directions: FloatArray
    turns: FloatArray
    counts: IntArray
    n_upright: int
    spread: FloatArray
    axes: FloatArray

    @property
    def missing(self) -> list[str]:
        """Directions in which the pen never leant, in words."""
        leant = self.counts.sum(axis=0) > 0
        return [
            name for name, seen in zip(DIRECTION_NAMES, leant, strict=True) if not seen
        ]


def measure_coverage(rotations: FloatArray) -> Coverage:
    """Measure which postures rotations (N, 3, 3) of cam_from_pen hold."""
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
    """Return by how much the directions of the pen turn in the camera.

    Parameters
    ----------
    rotations : (N, 3, 3) array
        Of cam_from_pen.

    Returns
    -------
    spread : (3,) array
        Rms turn of three orthogonal directions, the least first, rad.
    axes : (3, 3) array
        The directions, unit vectors of the pen frame, one a row.
    """
    deviations = rotations - rotations.mean(axis=0)
    scatter = np.einsum("nki,nkj->ij", deviations, deviations) / len(rotations)
    values, vectors = np.linalg.eigh(scatter)
    return np.sqrt(np.maximum(values, 0)), vectors.T


def require_spread(rotations: FloatArray) -> None:
    """Refuse rotations (N, 3, 3) that do not fix the tip.

    Raises
    ------
    CalibrationError
        Says which movement is missing.
    """
    spread, axes = posture_spread(rotations)
    if spread[0] >= MIN_SPREAD:
        return
    found, needed = float(np.degrees(spread[0])), math.degrees(MIN_SPREAD)
    if spread[1] < MIN_SPREAD:
        raise CalibrationError(
            sentence(
                "coverage.hardly-moved",
                "The pen hardly moved: its postures differ by {found:.1f} degrees "
                "(rms), {needed:.0f} degrees are needed. Tilt the pen to all sides, "
                "by 20 degrees or more, and turn it about its own axis.",
                found=found,
                needed=needed,
            )
        )
    raise CalibrationError(
        sentence(
            "coverage.one-axis",
            "The pen was swung about one axis only, {axis}: that axis itself turned "
            "by {found:.1f} degrees (rms), {needed:.0f} degrees are needed, so the "
            "tip's place along it is not fixed. {advice}",
            axis=_axis_name(axes[0]),
            found=found,
            needed=needed,
            advice=_advice(axes[0]),
        )
    )


def _axis_name(axis: FloatArray) -> Sentence:
    largest = int(np.argmax(np.abs(axis)))
    if abs(axis[largest]) > 0.9:
        return sentence("pen.axis", "the pen's {axis} axis", axis="xyz"[largest])
    x, y, z = axis.tolist()
    return sentence(
        "pen.direction",
        "the direction ({x:.2f}, {y:.2f}, {z:.2f}) of the pen",
        x=x,
        y=y,
        z=z,
    )


def _advice(axis: FloatArray) -> Sentence:
    largest = int(np.argmax(np.abs(axis)))
    return (
        sentence(
            "coverage.lean-sideways",
            "Lean the pen to the left and right as well as towards and away from the "
            "camera, and turn it about its own axis.",
        ),
        sentence(
            "coverage.tilt",
            "Tilt the pen to all sides, by 20 degrees or more, not only about its own "
            "axis.",
        ),
        sentence(
            "coverage.lean-forth",
            "Lean the pen towards and away from the camera as well as to the left and "
            "right, and turn it about its own axis.",
        ),
    )[largest]


def dial_counts(rotations: FloatArray) -> IntArray:
    """Return how many of the postures (N, 3, 3) lie in each field of the dial, (3, 8).

    The rows are upright, leaning, leaning far; the columns the directions from the
    right against the clock, as `DIRECTION_NAMES` has them. All upright ones are in the
    first column.
    """
    ring = np.digitize(tilts_of(rotations), TILT_RINGS)
    sector = np.rint(directions_of(rotations) / (2 * np.pi / N_DIRECTIONS)).astype(int)
    counts = np.zeros((3, N_DIRECTIONS), dtype=np.int64)
    np.add.at(counts, (ring, np.where(ring > 0, sector % N_DIRECTIONS, 0)), 1)
    return counts
