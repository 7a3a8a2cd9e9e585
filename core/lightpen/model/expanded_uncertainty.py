"""What expanded uncertainties are: U with k = 2, of some 95 % coverage."""

from math import erf, sqrt

COVERAGE_FACTOR = 2.0  # k
COVERAGE = erf(COVERAGE_FACTOR / sqrt(2))  # of a normal distribution, 0.9545
