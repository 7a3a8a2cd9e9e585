"""Assignment of rows to columns at least cost.

`scipy.optimize.linear_sum_assignment` does the same, but its package brings solvers of
16 MB along that nothing else here needs.
"""

import numpy as np

from lightpen.arrays import FloatArray, IntArray


def assigned_columns(costs: FloatArray) -> IntArray:
    """Return the column of each row (R,), or -1, for the least sum of costs (R, C).

    Each column goes to one row at most; as many are assigned as there can be.
    """
    from scipy.sparse import csr_array  # takes 0.2 s
    from scipy.sparse.csgraph import min_weight_full_bipartite_matching

    columns = np.full(len(costs), -1)
    # A cost of 0 would be no edge; a constant changes no assignment.
    edges = csr_array(costs - costs.min() + 1.0)
    rows, found = min_weight_full_bipartite_matching(edges)
    columns[rows] = found
    return columns
