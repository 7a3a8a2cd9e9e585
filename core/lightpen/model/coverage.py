"""Coverage of postures in a swing, and whether they determine the tip.

The direction ``a`` of the pen frame along which the tip can be found must itself turn
in the camera: the scatter matrix of the rotations, ``mean (R_i - R)^T (R_i - R)``, says
by how much. A swing about one axis leaves that axis without scatter.
"""

import math
from dataclasses import dataclass
from enum import StrEnum
from functools import cache
from math import erf, inf, sqrt

import numpy as np

from lightpen.arrays import FloatArray, IntArray
from lightpen.errors import CalibrationError
from lightpen.messages import Message, message
from lightpen.model.rigid import directions_of, nearest_rotation, tilts_of

MIN_SPREAD = np.radians(3.0)  # rms turn of the worst direction; a cone of 3 degrees
TILT_RINGS = (np.radians(8.0), np.radians(20.0))  # upright, leaning, leaning far
N_DIRECTIONS = 8
DIRECTION_NAMES = (
    "to the right",
    "to the right and away from the camera",
    "away from the camera",
    "to the left and away from the camera",
    "to the left",
    "to the left and towards the camera",
    "towards the camera",
    "to the right and towards the camera",
)


@dataclass(frozen=True, eq=False)
class Coverage:
    """Postures of a swing."""

    # (N,), angle between the pen's axis (its y) and upright (-v of the camera), rad
    tilts: FloatArray
    # (N,), where the pen leans, as the camera sees it: 0 to the right, pi/2 away from
    # the camera, rad
    directions: FloatArray
    turns: FloatArray  # (N,), turn about the pen's own axis from the mean posture, rad
    counts: IntArray  # (2, 8), images leaning, and leaning far, by direction
    n_upright: int  # images with hardly any tilt
    # (3,), rms turn of the worst to the best direction of the pen frame, rad
    spread: FloatArray
    # (3, 3), these directions, unit vectors of the pen frame, one a row
    axes: FloatArray

    @property
    def missing(self) -> list[str]:
        """Names of the directions without a tilted posture."""
        leant = self.counts.sum(axis=0) > 0
        return [
            name for name, seen in zip(DIRECTION_NAMES, leant, strict=True) if not seen
        ]


def measure_coverage(rotations: FloatArray) -> Coverage:
    """Return the posture coverage of rotations (N, 3, 3) of cam_from_pen."""
    counts = dial_counts(rotations)
    spread, axes = posture_spread(rotations)
    mean = nearest_rotation(rotations.mean(axis=0))
    relative = mean.T @ rotations
    return Coverage(
        tilts=tilts_of(rotations),
        directions=directions_of(rotations),
        turns=np.arctan2(
            relative[:, 0, 2] - relative[:, 2, 0], relative[:, 0, 0] + relative[:, 2, 2]
        ),
        counts=counts[1:],
        n_upright=int(counts[0, 0]),
        spread=spread,
        axes=axes,
    )


def posture_spread(rotations: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the spread of the pen's rotations cam_from_pen (N, 3, 3).

    That is the rms turn of three orthogonal directions, the least first, (3,), rad, and
    these directions, unit vectors of the pen frame, one a row.
    """
    deviations = rotations - rotations.mean(axis=0)
    scatter = np.einsum("nki,nkj->ij", deviations, deviations) / len(rotations)
    values, vectors = np.linalg.eigh(scatter)
    return np.sqrt(np.maximum(values, 0)), vectors.T


def require_spread(rotations: FloatArray) -> None:
    """Refuse rotations (N, 3, 3) that do not determine the tip, by what is missing."""
    spread, axes = posture_spread(rotations)
    if spread[0] >= MIN_SPREAD:
        return
    found, needed = float(np.degrees(spread[0])), math.degrees(MIN_SPREAD)
    if spread[1] < MIN_SPREAD:
        raise CalibrationError("coverage.hardly-moved", found=found, needed=needed)
    raise CalibrationError(
        "coverage.one-axis",
        axis=_axis_name(axes[0]),
        found=found,
        needed=needed,
        advice=_advice(axes[0]),
    )


def _axis_name(axis: FloatArray) -> Message:
    largest = int(np.argmax(np.abs(axis)))
    if abs(axis[largest]) > 0.9:
        return message("pen.axis", axis="xyz"[largest])
    x, y, z = axis.tolist()
    return message("pen.direction", x=x, y=y, z=z)


def _advice(axis: FloatArray) -> Message:
    largest = int(np.argmax(np.abs(axis)))
    return (
        message("coverage.lean-sideways"),
        message("coverage.tilt"),
        message("coverage.lean-forth"),
    )[largest]


def dial_counts(rotations: FloatArray) -> IntArray:
    """Return the number of postures (N, 3, 3) in each field of the dial, (3, 8).

    The rows are upright, leaning, leaning far; the columns the directions from the
    right against the clock, as `DIRECTION_NAMES` has them. All upright ones are in the
    first column.
    """
    ring = np.digitize(tilts_of(rotations), TILT_RINGS)
    sector = np.rint(directions_of(rotations) / (2 * np.pi / N_DIRECTIONS)).astype(int)
    counts = np.zeros((3, N_DIRECTIONS), dtype=np.int64)
    np.add.at(counts, (ring, np.where(ring > 0, sector % N_DIRECTIONS, 0)), 1)
    return counts


COVERAGE_FACTOR = 2.0  # k
COVERAGE = erf(COVERAGE_FACTOR / sqrt(2))  # of a normal distribution, 0.9545


# Decision rules: whether a measured value with its U keeps a limit.
#
# simple acceptance
#     Within the limits is accepted, U is stated beside it [1]_.
# guard band
#     Accepted is what keeps the limits by the guard band of 1.65 u at least, rejected
#     what exceeds them by as much; between them nothing is proven [2]_.
# risk
#     Accepted is what conforms with a probability of ``1 - max_risk`` or more, rejected
#     what does so with ``max_risk`` or less; between them nothing is proven [1]_.
#
# The value is taken as normal with the standard uncertainty u = U / 2.
#
# References
# ----------
# .. [1] JCGM 106:2012, "The role of measurement uncertainty in conformity
#    assessment", 8.2 and 8.3.
# .. [2] ISO 14253-1:2017, "Decision rules for verifying conformity or nonconformity
#    with specifications".


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


# Quantiles of the normal and the chi-square distribution, by the upper tail.
#
# `scipy.special` is imported when a quantile is first needed: it takes 0.1 s.


@cache
def normal_quantile(chance: float) -> float:
    """Return the quantile that a standard normal variable exceeds with this chance."""
    from scipy.special import ndtri

    return -float(ndtri(chance))


@cache
def chi_square_quantile(n_free: float, chance: float) -> float:
    """Return the upper quantile of chi-square with ``n_free`` degrees of freedom."""
    from scipy.special import chdtri

    return float(chdtri(n_free, chance))


def chi_quantile(n_free: int, chance: float) -> float:
    """Return the quantile of the length of a standard normal vector of ``n_free``."""
    return sqrt(chi_square_quantile(n_free, chance))


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
    from scipy.linalg.lapack import dpotrf, dpotri  # takes 0.03 s

    scale = 1 / np.sqrt(np.diag(matrix))
    scales = np.outer(scale, scale)
    root, flaw = dpotrf(matrix * scales, lower=1)
    if flaw or not np.isfinite(scale).all():
        raise np.linalg.LinAlgError("The matrix is not positive definite.")
    lower = np.tril(dpotri(root, lower=1)[0]) * scales
    return np.asarray(lower + np.tril(lower, -1).T)


def symmetric_root(covariance: FloatArray) -> FloatArray:
    """Return the symmetric square root (k, k) of a covariance, also a singular one.

    Unlike other roots it is unique, so draws by it are the same with every library.
    """
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)) @ vectors.T)
