"""Quantiles of the normal and the chi-square distribution, by the upper tail.

`scipy.special` is imported when a quantile is first needed: it takes 0.1 s.
"""

from functools import cache
from math import sqrt


@cache
def normal_quantile(chance: float) -> float:
    """Return the quantile that a standard normal variable exceeds with this chance."""
    from scipy.special import ndtri

    return -float(ndtri(chance))


@cache
def chi_square_quantile(n_free: int, chance: float) -> float:
    """Return the upper quantile of chi-square with ``n_free`` degrees of freedom."""
    from scipy.special import chdtri

    return float(chdtri(n_free, chance))


def chi_quantile(n_free: int, chance: float) -> float:
    """Return the quantile of the length of a standard normal vector of ``n_free``."""
    return sqrt(chi_square_quantile(n_free, chance))
