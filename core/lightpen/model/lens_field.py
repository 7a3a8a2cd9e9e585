"""The residual field of a lens: smooth residuals of its distortion model.

A camera observes a point at ``pixels(point) + field``. Each component of the field is a
Gaussian process with the covariance ``a^2 exp(-d^2 / (2 l^2))`` of two pixels at the
distance d [1]_, with amplitude a and correlation length l. Its values at the nodes of a
grid over the image represent it; between them it is the conditional mean.

References
----------
.. [1] C. E. Rasmussen, C. K. I. Williams, "Gaussian processes for machine learning",
   MIT Press (2006), equations 2.16 and 2.23-2.26.
"""

from dataclasses import dataclass, field
from functools import cached_property
from math import ceil

import numpy as np

from lightpen.arrays import FloatArray

SPACING = 0.75  # of nodes, in correlation lengths: 1 % of the amplitude is left
FEWEST, MOST = 3, 10  # nodes along a side
ROUNDING = 1e-8  # of a variance, so that covariances can be inverted


@dataclass(frozen=True, eq=False)
class LensField:
    """Prior of the residual field of a lens."""

    width: int  # image size, px
    height: int
    columns: int  # nodes along each side; the first and last lie in the corner pixels
    rows: int
    amplitude: float  # standard deviation of each component before any measurement, px
    length: float  # correlation length, px
    # (M, 2), mean of (u, v) at the M nodes, row by row, px; 0 where not measured
    values: FloatArray = field(repr=False)
    # (M, M), of each component at the nodes, px^2; the two are independent
    covariance: FloatArray = field(repr=False)
    # (4 + n, 4 + n), of the camera's intrinsics without what of their errors goes with
    # the field: ``covariance`` contains that, as the two cancel in the image. None
    # where the errors are independent
    intrinsics_covariance: FloatArray | None = field(default=None, repr=False)

    @classmethod
    def of(
        cls, width: int, height: int, amplitude: float, length: float
    ) -> "LensField":
        """Return the prior field before any measurement, its mean 0."""
        columns, rows = (
            min(max(ceil((side - 1) / (SPACING * length)) + 1, FEWEST), MOST)
            for side in (width, height)
        )
        nodes = _grid(width, height, columns, rows)
        covariance = amplitude**2 * correlation(nodes, nodes, length)
        values = np.zeros((len(nodes), 2))
        return cls(width, height, columns, rows, amplitude, length, values, covariance)

    @cached_property
    def nodes(self) -> FloatArray:
        """Pixels of the nodes, (M, 2), row by row."""
        return _grid(self.width, self.height, self.columns, self.rows)

    def basis(self, pixels: FloatArray) -> FloatArray:
        """Return the weights of the nodes' values at pixels (..., 2), (..., M)."""
        return correlation(pixels, self.nodes, self.length) @ self.node_information

    def at(self, pixels: FloatArray) -> FloatArray:
        """Return the mean of the field at pixels, both (..., 2), px; NaN gives NaN."""
        return np.asarray(self.basis(pixels) @ self.values)

    def covariance_at(self, pixels: FloatArray) -> FloatArray:
        """Return the covariance of each component at pixels (K, 2), (K, K), px^2."""
        weights = self.basis(pixels)
        nodes = correlation(self.nodes, self.nodes, self.length)
        own = correlation(pixels, pixels, self.length) - weights @ nodes @ weights.T
        return np.asarray(
            weights @ self.covariance @ weights.T + self.amplitude**2 * own
        )

    @cached_property
    def node_information(self) -> FloatArray:
        """Information of a component at the nodes before any measurement, (M, M).

        For an amplitude of 1 px.
        """
        nodes = correlation(self.nodes, self.nodes, self.length)
        return np.asarray(np.linalg.inv(nodes + ROUNDING * np.eye(len(nodes))))


def correlation(one: FloatArray, other: FloatArray, length: float) -> FloatArray:
    """Return the correlation of a field at pixels (..., 2) and (M, 2), (..., M)."""
    u = one[..., None, 0] - other[:, 0]
    v = one[..., None, 1] - other[:, 1]
    return np.asarray(np.exp((u * u + v * v) * (-0.5 / length**2)))


def _grid(width: int, height: int, columns: int, rows: int) -> FloatArray:
    u, v = np.meshgrid(
        np.linspace(0.0, width - 1.0, columns), np.linspace(0.0, height - 1.0, rows)
    )
    return np.stack([u.ravel(), v.ravel()], axis=1)
