"""A test of the software for feature fitting, in the form of ISO 10360-6.

Reference pairs are made independently of the program: points of a known feature are
displaced along its normals by residuals that are orthogonal to all derivatives of the
distances, so that the known feature is that of least squares, exactly.

References
----------
.. [1] ISO 10360-6:2001, Estimation of errors in computing Gaussian associated features.
.. [2] M. G. Cox, A. B. Forbes, "Strategies for testing assessment software", NPL Report
   DITC 211/92 (1992): the null-space method.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum
from math import cos, pi, sin, tan

import numpy as np

from lightpen.arrays import FloatArray
from lightpen_extensions.measure.measuring.features import Feature, fit_feature
from lightpen_extensions.measure.measuring.surfaces import FeatureKind

N_SETS, SEED = 20, 10360
MAX_PERMISSIBLE_LENGTH = 1e-6  # mm, of locations and sizes
MAX_PERMISSIBLE_ANGLE = 1e-8  # rad, of orientations and angles
Fit = Callable[[FeatureKind, FloatArray], Feature]


class Quality(Enum):
    """What of a feature is compared."""

    LOCATION = "location, mm"
    ORIENTATION = "orientation, rad"
    SIZE = "size, mm"
    ANGLE = "half angle, rad"


@dataclass(frozen=True, eq=False)
class ReferencePair:
    """A reference data set and its reference feature.

    Attributes
    ----------
    points : (N, 3) array
        mm.
    origin, axis : (3,) arrays
        Of the feature of least squares, mm and unit vector.
    size : float
        Radius, mm; that of a cone at its origin.
    half_angle : float
        Of a cone, rad.
    """

    kind: FeatureKind
    points: FloatArray
    origin: FloatArray
    axis: FloatArray
    size: float = 0.0
    half_angle: float = 0.0


@dataclass(frozen=True)
class FittingResult:
    """The largest deviation of a quality over all sets of a kind."""

    kind: str
    quality: str
    n_sets: int
    deviation: float
    permissible: float

    @property
    def passed(self) -> bool:
        """Return whether it keeps the maximum permissible error."""
        return self.deviation <= self.permissible


def run_fitting_test(
    fit: Fit = fit_feature, n_sets: int = N_SETS
) -> list[FittingResult]:
    """Fit all reference data sets, and return the largest deviations."""
    results = []
    for index, (kind, make) in enumerate(MADE.items()):
        rng = np.random.default_rng([SEED, index])
        pairs = [_placed(make(rng), rng) for _ in range(n_sets)]
        found = [_deviations(pair, fit(kind, pair.points)) for pair in pairs]
        for quality in found[0]:
            is_angle = quality in (Quality.ORIENTATION, Quality.ANGLE)
            limit = MAX_PERMISSIBLE_ANGLE if is_angle else MAX_PERMISSIBLE_LENGTH
            worst = max(deviations[quality] for deviations in found)
            results.append(
                FittingResult(kind.value, quality.value, n_sets, worst, limit)
            )
    return results


def _deviations(pair: ReferencePair, found: Feature) -> dict[Quality, float]:
    apart = found.origin - pair.origin
    along = apart @ pair.axis
    across = float(np.linalg.norm(apart - along * pair.axis))
    turned = float(np.linalg.norm(np.cross(found.axis, pair.axis)))
    match pair.kind:
        case FeatureKind.PLANE:
            return {Quality.LOCATION: abs(float(along)), Quality.ORIENTATION: turned}
        case FeatureKind.SPHERE | FeatureKind.CIRCLE:
            deviations = {Quality.LOCATION: float(np.linalg.norm(apart))}
        case _:
            deviations = {Quality.LOCATION: across}
    if pair.kind is not FeatureKind.SPHERE:
        deviations[Quality.ORIENTATION] = turned
    if pair.kind is FeatureKind.CONE:
        opens = float(np.sign(found.axis @ pair.axis)) * found.sizes[1]
        there = pair.size + along * tan(pair.half_angle)
        deviations[Quality.SIZE] = abs(found.sizes[0] - float(there))
        deviations[Quality.ANGLE] = abs(opens - pair.half_angle)
    elif pair.kind is not FeatureKind.LINE:
        deviations[Quality.SIZE] = abs(found.sizes[0] - pair.size)
    return deviations


def _residuals(
    rng: np.random.Generator, derivatives: Sequence[FloatArray], n: int
) -> FloatArray:
    """Return residuals (N,), mm, orthogonal to all derivatives (N,)."""
    orthonormal = np.linalg.qr(np.column_stack(list(derivatives)))[0]
    noise = rng.normal(size=n)
    noise -= orthonormal @ (orthonormal.T @ noise)
    noise -= orthonormal @ (orthonormal.T @ noise)  # again, to rounding
    amplitude: float = 10 ** rng.uniform(-4, -1.5)
    residuals: FloatArray = amplitude * noise / np.abs(noise).max()
    return residuals


def _placed(pair: ReferencePair, rng: np.random.Generator) -> ReferencePair:
    """Return a pair somewhere in a large volume, in any direction."""
    R = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    R *= np.linalg.det(R)
    t = rng.uniform(-500, 500, 3)
    points = pair.points @ R.T + t
    place = R @ pair.origin + t, R @ pair.axis
    return ReferencePair(pair.kind, points, *place, pair.size, pair.half_angle)


Z = np.array([0.0, 0.0, 1.0])
CENTRE = np.zeros(3)


def _line(rng: np.random.Generator) -> ReferencePair:
    n = int(rng.integers(8, 30))
    z = rng.uniform(-1, 1, n) * rng.uniform(10, 200)
    x, y = (_residuals(rng, [np.ones(n), z], n) for _ in range(2))
    return ReferencePair(FeatureKind.LINE, np.column_stack([x, y, z]), CENTRE, Z)


def _plane(rng: np.random.Generator) -> ReferencePair:
    n = int(rng.integers(8, 30))
    x, y = rng.uniform(-1, 1, (2, n)) * rng.uniform(10, 200, (2, 1))
    z = _residuals(rng, [np.ones(n), x, y], n)
    return ReferencePair(FeatureKind.PLANE, np.column_stack([x, y, z]), CENTRE, Z)


def _circle(rng: np.random.Generator) -> ReferencePair:
    n, radius = int(rng.integers(8, 30)), rng.uniform(2, 100)
    u = np.linspace(0, rng.uniform(pi / 2, 1.9 * pi), n)
    r = radius + _residuals(rng, [np.ones(n), np.cos(u), np.sin(u)], n)
    points = np.column_stack([r * np.cos(u), r * np.sin(u), np.zeros(n)])
    return ReferencePair(FeatureKind.CIRCLE, points, CENTRE, Z, radius)


def _sphere(rng: np.random.Generator) -> ReferencePair:
    n, radius = int(rng.integers(12, 40)), rng.uniform(2, 100)
    normals = rng.normal(size=(n, 3))
    normals[:, 2] = np.abs(normals[:, 2])  # a hemisphere can be probed
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    d = _residuals(rng, [np.ones(n), *normals.T], n)
    points = (radius + d)[:, None] * normals
    return ReferencePair(FeatureKind.SPHERE, points, CENTRE, Z, radius)


def _cylinder(rng: np.random.Generator) -> ReferencePair:
    n, radius = int(rng.integers(12, 40)), rng.uniform(2, 100)
    u = rng.uniform(0, rng.uniform(pi, 2 * pi), n)
    z = rng.uniform(-1, 1, n) * rng.uniform(10, 100)
    c, s = np.cos(u), np.sin(u)
    r = radius + _residuals(rng, [np.ones(n), c, s, z * c, z * s], n)
    points = np.column_stack([r * c, r * s, z])
    return ReferencePair(FeatureKind.CYLINDER, points, CENTRE, Z, radius)


def _cone(rng: np.random.Generator) -> ReferencePair:
    n, half = int(rng.integers(16, 40)), rng.uniform(0.1, 0.8)
    u = rng.uniform(0, rng.uniform(pi, 2 * pi), n)
    height = rng.uniform(10, 50)
    radius = height * tan(half) + rng.uniform(2, 50)
    z = rng.uniform(-1, 1, n) * height
    c, s = np.cos(u), np.sin(u)
    r = radius + z * tan(half)
    foot = np.column_stack([r * c, r * s, z])
    normals = np.column_stack([cos(half) * c, cos(half) * s, np.full(n, -sin(half))])
    by_turns = np.cross(foot, normals)[:, :2].T
    d = _residuals(rng, [np.ones(n), c, s, *by_turns, z], n)
    points = foot + d[:, None] * normals
    return ReferencePair(FeatureKind.CONE, points, CENTRE, Z, radius, half)


MADE: dict[FeatureKind, Callable[[np.random.Generator], ReferencePair]] = {
    FeatureKind.LINE: _line,
    FeatureKind.PLANE: _plane,
    FeatureKind.CIRCLE: _circle,
    FeatureKind.SPHERE: _sphere,
    FeatureKind.CYLINDER: _cylinder,
    FeatureKind.CONE: _cone,
}
