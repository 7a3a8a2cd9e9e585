"""Information: the inverse of a covariance, and back."""

import numpy as np

from lightpen.arrays import FloatArray

EXACT = 1e-6  # standard deviation that counts as exact, in the unit of the value


def known_by(covariance: FloatArray) -> FloatArray:
    """Return the information (k, k) of a stated covariance (k, k).

    Variances are enlarged by 1e-6, since what is stated as exact may be rounded.
    """
    floor = np.maximum(np.diag(covariance) * EXACT, EXACT**2)
    return inverse(covariance + np.diag(floor))


def inverse(matrix: FloatArray) -> FloatArray:
    """Return the inverse (k, k) of a covariance or an information (k, k).

    By Cholesky decomposition after scaling, since the unknowns have different units.
    Raises `numpy.linalg.LinAlgError` unless it is positive definite.
    """
    scale = 1 / np.sqrt(np.diag(matrix))
    # As scipy.linalg.cho_solve, whose import takes 0.03 s.
    root = np.linalg.inv(np.linalg.cholesky(matrix * np.outer(scale, scale))) * scale
    return np.asarray(root.T @ root)


def symmetric_root(covariance: FloatArray) -> FloatArray:
    """Return the symmetric square root (k, k) of a covariance, also a singular one.

    Unlike other roots it is unique, so draws by it are the same with every library.
    """
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)) @ vectors.T)
