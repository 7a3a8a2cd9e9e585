"""Assignments: as another implementation finds them."""

import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment

from lightpen.model.assignment import assigned_columns


@pytest.mark.parametrize("shape", [(6, 6), (4, 9), (9, 4), (1, 1)])
def test_the_assignment_is_the_one_of_least_cost(shape: tuple[int, int]) -> None:
    costs = np.random.default_rng(4).uniform(-1, 1, shape)
    costs[0, 0] = 0.0
    rows, columns = linear_sum_assignment(costs)
    expected = np.full(len(costs), -1)
    expected[rows] = columns

    np.testing.assert_array_equal(assigned_columns(costs), expected)
