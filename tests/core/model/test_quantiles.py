"""Quantiles of the normal and the chi-square distribution."""

import pytest

from lightpen.model.coverage import chi_quantile, chi_square_quantile, normal_quantile


def test_published_quantiles_are_met() -> None:
    # M. Abramowitz, I. A. Stegun, "Handbook of mathematical functions", table 26.8.
    assert normal_quantile(0.025) == pytest.approx(1.95996, abs=5e-6)
    assert chi_square_quantile(1, 0.001) == pytest.approx(10.828, abs=5e-4)
    assert chi_square_quantile(3, 0.01) == pytest.approx(11.3449, abs=5e-5)
    assert chi_square_quantile(54, 0.5) == pytest.approx(53.335, abs=2e-3)


def test_a_single_degree_of_freedom_is_a_squared_normal_variable() -> None:
    for chance in (0.3, 0.01, 1e-5):
        both_sides = normal_quantile(chance / 2)
        assert chi_quantile(1, chance) == pytest.approx(both_sides, rel=1e-9)


def test_half_of_a_normal_variable_exceeds_its_median() -> None:
    assert normal_quantile(0.5) == 0.0
