"""Touches of a part, with the covariance that they share."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lightpen.arrays import FloatArray, IntArray
from lightpen_extensions.measure.measuring.quantities import Quantity


@dataclass(frozen=True, eq=False)
class PartTouches:
    """Touches of a part in order."""

    points_cam: FloatArray  # (N, 3), centres of the ball, camera frame, mm
    covariance: FloatArray  # (3 N, 3 N), of all coordinates, with what they share, mm^2
    # (N, 3), unit vectors along which the ball came to the surface; NaN if unknown
    approaches_cam: FloatArray
    styli_cam: FloatArray  # (N, 3), unit vectors from the ball into the pen
    owners: tuple[str, ...]  # feature of each touch
    ball_radius: float = 0.0  # mm; 0 to measure at the centre of the tip
    ball_uncertainty: float = 0.0  # U (k = 2) of the radius, mm

    @property
    def n_inputs(self) -> int:
        """Number of inputs: all coordinates and the ball radius."""
        return 3 * len(self.points_cam) + 1

    @property
    def inputs(self) -> FloatArray:
        """Covariance of all inputs, (P, P), mm^2."""
        covariance = np.zeros((self.n_inputs, self.n_inputs))
        covariance[:-1, :-1] = self.covariance
        covariance[-1, -1] = (self.ball_uncertainty / 2) ** 2
        return covariance

    @property
    def ball(self) -> Quantity:
        """The ball radius as a quantity."""
        by_inputs = np.zeros((1, self.n_inputs))
        by_inputs[0, -1] = 1.0
        return Quantity(np.array([self.ball_radius]), by_inputs)

    def of(self, name: str) -> IntArray:
        """Return the indices of the touches of a feature."""
        return np.flatnonzero([owner == name for owner in self.owners])

    def noise(self, touches: IntArray) -> float:
        """Return the standard deviation of a coordinate about the mean of touches, mm.

        What moves all of them alike does not count.
        """
        n = len(touches)
        columns = self.columns(touches)
        own = self.covariance[np.ix_(columns, columns)].reshape(n, 3, n, 3)
        spread = np.einsum("iaia->", own) - np.einsum("iaja->", own) / n
        return float(np.sqrt(max(spread, 0.0) / (3 * max(n - 1, 1))))

    def columns(self, touches: IntArray) -> IntArray:
        """Return the indices of their coordinates among the inputs, (3 n,)."""
        return np.asarray((3 * touches[:, None] + np.arange(3)).ravel())

    def points(self, touches: IntArray | Sequence[int]) -> Quantity:
        """Return the coordinates of touches as one quantity, (3 n,)."""
        at = np.asarray(touches)
        columns = self.columns(at)
        by_inputs = np.zeros((len(columns), self.n_inputs))
        by_inputs[np.arange(len(columns)), columns] = 1.0
        return Quantity(self.points_cam[at].ravel(), by_inputs)
