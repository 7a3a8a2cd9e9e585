"""Measured quantities that share their inputs: values with a common derivative.

Everything measured in a session follows from one vector of inputs: the coordinates of
all points and, if needed, the ball radius. A quantity keeps its derivative by all of
them, so errors common to two quantities cancel in their difference.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from lightpen.arrays import FloatArray, IntArray
from lightpen.model.expanded_uncertainty import COVERAGE_FACTOR
from lightpen_extensions.measure.measuring.features import Feature

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


def stacked_quantities(quantities: Sequence[Quantity]) -> Quantity:
    """Return several quantities as one, in their order."""
    return Quantity(
        np.concatenate([each.values for each in quantities]),
        np.concatenate([each.by_inputs for each in quantities]),
    )
