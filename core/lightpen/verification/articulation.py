"""One point in several postures, in the form of the articulated location error [1]_.

The point is touched five times in each of five postures. The mean of each posture is
one location; the location error is the diameter of the smallest sphere about them.

References
----------
.. [1] ISO 10360-12:2016, "Articulated arm coordinate measurement machines", articulated
   location error. The standard takes spheres measured by points; here a cone seats the
   tip, so that the error is one in its form only.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.estimation.instrument import Instrument
from lightpen.model.coverage import posture_spread
from lightpen.model.limits import VerificationLimits
from lightpen.sentences import sentence
from lightpen.verification.assessment import (
    CALIBRATE_AGAIN,
    Conformity,
    accepted,
    refused,
)
from lightpen.verification.fixed_point import LIFTED, MIN_SPREAD
from lightpen.verification.touch import Touch, joint_covariance, mean_point

N_POSTURES, N_TOUCHES = 5, 5
ASTRAY = 8.0  # times the median distance from the middle of all
SLACK = 1 + 1e-9  # of a sphere, for points that lie on it


@dataclass(frozen=True, eq=False)
class Articulation:
    """The location error of one point in several postures.

    Attributes
    ----------
    names : tuple of str
        Of the postures.
    locations : (N, 3) array
        Mean of each posture, camera frame, mm.
    spreads : (N,) array
        Largest distance of a touch from the mean of its posture, mm.
    location_error : float
        Diameter of the smallest sphere about the locations, mm.
    expected : float
        The same by what is known of the touches: mean of simulated ones, mm.
    """

    names: tuple[str, ...]
    locations: FloatArray
    spreads: FloatArray
    location_error: float
    expected: float
    assessment: Conformity


def measure_articulation(
    postures: Sequence[tuple[str, Sequence[Touch]]],
    instrument: Instrument,
    limits: VerificationLimits,
) -> Articulation:
    """Measure the location error of a point.

    Parameters
    ----------
    postures : sequence of (str, sequence of Touch)
        Name and touches of each.

    Raises
    ------
    CalibrationError
        There are fewer than five postures of five touches, the postures are alike, or a
        touch is of another point.
    """
    _require_enough(postures)
    points = np.array([t.point_cam for _, touches in postures for t in touches])
    _require_one_point(points, [t for _, touches in postures for t in touches])
    rotations = np.array([touches[0].rotation for _, touches in postures])
    spread = float(posture_spread(rotations)[0][-1])
    if spread < MIN_SPREAD:
        raise CalibrationError(
            sentence(
                "articulation.alike",
                "The postures differ by {found:.1f} degrees (rms), {needed:.0f} are "
                "needed. Hold the pen upright, and lean it to four sides.",
                found=float(np.degrees(spread)),
                needed=float(np.degrees(MIN_SPREAD)),
            )
        )
    own = [np.array([t.point_cam for t in touches]) for _, touches in postures]
    locations = np.array([each.mean(axis=0) for each in own])
    error = smallest_diameter(locations)
    return Articulation(
        names=tuple(name for name, _ in postures),
        locations=locations,
        spreads=np.array(
            [
                np.linalg.norm(each - middle, axis=1).max()
                for each, middle in zip(own, locations, strict=True)
            ]
        ),
        location_error=error,
        expected=_expected(postures, instrument),
        assessment=_assessment(error, limits),
    )


def by_posture(
    runs: Sequence[tuple[str, Sequence[Touch]]],
) -> list[tuple[str, Sequence[Touch]]]:
    """Return runs of a posture each; a single one holds five, one after the other."""
    if len(runs) != 1:
        return list(runs)
    (_, touches), n = runs[0], N_TOUCHES
    n_postures = max(len(touches) // n, N_POSTURES)
    return [(f"posture {i + 1}", touches[n * i : n * i + n]) for i in range(n_postures)]


def smallest_diameter(points: FloatArray) -> float:
    """Return the diameter of the smallest sphere about a few points (N, 3), mm."""
    best = np.inf
    for size in (2, 3, 4):
        for chosen in combinations(range(len(points)), size):
            center, radius = _sphere_through(points[list(chosen)])
            distances = np.linalg.norm(points - center, axis=1)
            if distances.max() <= radius * SLACK + 1e-12:
                best = min(best, radius)
        if np.isfinite(best):
            break
    return 2 * float(best)


def _sphere_through(points: FloatArray) -> tuple[FloatArray, float]:
    """Return the smallest sphere with two to four points (k, 3) on it."""
    base, others = points[0], points[1:] - points[0]
    half = 0.5 * np.sum(others**2, axis=1)
    # The centre lies in the span of the points.
    to_center = np.linalg.lstsq(others, half)[0]
    return base + to_center, float(np.linalg.norm(to_center))


def _require_enough(postures: Sequence[tuple[str, Sequence[Touch]]]) -> None:
    for name, touches in postures:
        if len(touches) < N_TOUCHES:
            raise CalibrationError(
                sentence(
                    "articulation.few-touches",
                    "{posture} has {n_touches} touches that can be used, {needed} are "
                    "needed in each posture.",
                    posture=name,
                    n_touches=len(touches),
                    needed=N_TOUCHES,
                )
            )
    if len(postures) < N_POSTURES:
        raise CalibrationError(
            sentence(
                "articulation.few-postures",
                "There are {n_postures} postures, {needed} are needed: upright, and "
                "leant to four sides.",
                n_postures=len(postures),
                needed=N_POSTURES,
            )
        )


def _require_one_point(points: FloatArray, touches: Sequence[Touch]) -> None:
    distances = np.linalg.norm(points - np.median(points, axis=0), axis=1)
    worst = int(np.argmax(distances))
    if distances[worst] > max(ASTRAY * float(np.median(distances)), LIFTED):
        raise CalibrationError(
            sentence(
                "articulation.elsewhere",
                "{touch} lies {distance:.2f} mm from where the others are: the pen was "
                "lifted, or slipped. Touch that posture again.",
                touch=touches[worst].label,
                distance=float(distances[worst]),
            )
        )


def _expected(
    postures: Sequence[tuple[str, Sequence[Touch]]], instrument: Instrument
) -> float:
    """Return the mean location error of points that scatter as is known of them."""
    rng = np.random.default_rng(0)
    means = [mean_point(touches) for _, touches in postures]
    covariance = joint_covariance(means, instrument)
    values, vectors = np.linalg.eigh(covariance)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    draws = (rng.standard_normal((100, len(root))) @ root.T).reshape(100, -1, 3)
    return float(np.mean([smallest_diameter(each) for each in draws]))


def _assessment(error: float, limits: VerificationLimits) -> Conformity:
    if error > limits.location:
        return refused(
            sentence(
                "articulation.off",
                "The point wanders within a sphere of {error:.4f} mm as the pen leans "
                "(limit {limit:.4f} mm).",
                error=error,
                limit=limits.location,
            ),
            CALIBRATE_AGAIN,
        )
    return accepted(
        sentence(
            "articulation.good",
            "The point stays within a sphere of {error:.4f} mm as the pen leans "
            "(limit {limit:.4f} mm).",
            error=error,
            limit=limits.location,
        )
    )
