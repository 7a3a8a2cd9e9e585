"""Information as the inverse of a covariance."""

import numpy as np
import pytest

from lightpen.model.coverage import inverse, known_by


def test_unknowns_of_very_different_units_are_inverted_to_rounding() -> None:
    rng = np.random.default_rng(0)
    A = rng.normal(size=(6, 12))
    units = np.array([1e-6, 1e-3, 1.0, 1e2, 1e4, 1e-5])
    matrix = (A @ A.T) * np.outer(units, units)
    found = inverse(matrix)
    # Rounding of a matrix of condition some 100, scaled.
    product = found @ matrix * np.outer(units, 1 / units)
    np.testing.assert_allclose(product, np.eye(6), atol=1e-12)
    np.testing.assert_array_equal(found, found.T)


def test_a_covariance_that_is_none_is_refused() -> None:
    with pytest.raises(np.linalg.LinAlgError):
        inverse(np.array([[1.0, 2.0], [2.0, 1.0]]))


def test_what_is_stated_as_exact_is_known_to_a_millionth() -> None:
    known = known_by(np.diag([4.0, 0.0]))
    # The floor of a variance is 1e-6 of it, and of an exact one 1e-12.
    np.testing.assert_allclose(np.diag(known), [1 / (4 * (1 + 1e-6)), 1e12])
