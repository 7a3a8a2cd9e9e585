"""Decision rules: whether a measured value with its U keeps a limit.

simple acceptance
    Within the limits is accepted, U is stated beside it [1]_.
guard band
    Accepted is what keeps the limits by the guard band of 1.65 u at least, rejected
    what exceeds them by as much; between them nothing is proven [2]_.
risk
    Accepted is what conforms with a probability of ``1 - max_risk`` or more, rejected
    what does so with ``max_risk`` or less; between them nothing is proven [1]_.

The value is taken as normal with the standard uncertainty u = U / 2.

References
----------
.. [1] JCGM 106:2012, "The role of measurement uncertainty in conformity assessment",
   8.2 and 8.3.
.. [2] ISO 14253-1:2017, "Decision rules for verifying conformity or nonconformity with
   specifications".
"""

from enum import StrEnum
from math import inf

from lightpen.model.expanded_uncertainty import COVERAGE_FACTOR

GUARD_FACTOR = 1.65  # one-sided 95 % of a normal distribution
USUAL_RISK = 0.05


class DecisionRule(StrEnum):
    """Decision rule for a measured value and its limits."""

    SIMPLE = "simple acceptance"
    GUARD_BAND = "guard band"
    RISK = "risk"


class Decision(StrEnum):
    """Outcome of a decision rule."""

    ACCEPTED = "accepted"
    OPEN = "open"  # neither conformity nor nonconformity is proven
    REJECTED = "rejected"


def conformity_probability(
    value: float, uncertainty: float, *, lower: float = -inf, upper: float = inf
) -> float:
    """Return the probability that the true value lies within its limits.

    The uncertainty is U (k = 2) of the measured value, both in the unit of the limits.
    """
    if not uncertainty > 0:
        return float(lower <= value <= upper)
    from scipy.special import ndtr

    u = uncertainty / COVERAGE_FACTOR
    return float(ndtr((upper - value) / u) - ndtr((lower - value) / u))


def decide(
    rule: DecisionRule,
    value: float,
    uncertainty: float,
    *,
    lower: float = -inf,
    upper: float = inf,
    max_risk: float = USUAL_RISK,
) -> Decision:
    """Return the decision on a value with its U (k = 2) and limits of the true value.

    ``max_risk`` is the maximum risk of a false acceptance and of a false rejection.
    """
    if rule is DecisionRule.RISK:
        p = conformity_probability(value, uncertainty, lower=lower, upper=upper)
        if p >= 1 - max_risk:
            return Decision.ACCEPTED
        return Decision.REJECTED if p <= max_risk else Decision.OPEN
    band = 0.0
    if rule is DecisionRule.GUARD_BAND:
        band = GUARD_FACTOR * uncertainty / COVERAGE_FACTOR
    room = min(value - lower, upper - value)
    if room >= band:
        return Decision.ACCEPTED
    return Decision.REJECTED if room < -band else Decision.OPEN
