"""Information: what is known of unknowns, the inverse of their covariance."""

import numpy as np

from lightpen.arrays import FloatArray

EXACT = 1e-6  # standard deviation of what is taken as exact, in its own unit


def known_by(covariance: FloatArray) -> FloatArray:
    """Return the information in what is stated; what is so as exact may be rounded."""
    floor = np.maximum(np.diag(covariance) * EXACT, EXACT**2)
    return inverse(covariance + np.diag(floor))


def inverse(matrix: FloatArray) -> FloatArray:
    """Return the inverse of a positive matrix of unknowns in different units."""
    scale = 1 / np.sqrt(np.diag(matrix))
    scales = np.outer(scale, scale)
    inverse = np.linalg.inv(matrix * scales) * scales
    return np.asarray(0.5 * (inverse + inverse.T))
