"""Fitted features: exact on constructed points, with the covariance that scatter shows.

A point moved along the normal of a feature by d is at the distance d from it. If the
distances are perpendicular to all columns of the Jacobian, the feature stays that of
least squares, so its solution is known exactly (ISO 10360-6).
"""

import numpy as np
import pytest

from lightpen.arrays import FloatArray
from lightpen.model.rigid import rotation_from_vector
from lightpen_extensions.measure.measuring import features
from lightpen_extensions.measure.measuring.features import _solve, fit_feature, starts
from lightpen_extensions.measure.measuring.surfaces import SURFACES, FeatureKind

EXACT = 1e-9  # mm
FAR = np.array([6000.0, -5000.0, 6500.0])  # some 10 m from the origin
RNG = np.random.default_rng(20261124)


def _around(n: int, arc: float) -> FloatArray:
    return RNG.uniform(0, np.deg2rad(arc), n)


def line(n: int) -> FloatArray:
    return np.column_stack([np.zeros((n, 2)), RNG.uniform(-60, 60, n)])


def plane(n: int) -> FloatArray:
    return np.column_stack([RNG.uniform(-80, 80, (n, 2)), np.zeros(n)])


def circle(n: int, arc: float = 360) -> FloatArray:
    turn = _around(n, arc)
    return 25.0 * np.column_stack([np.cos(turn), np.sin(turn), np.zeros(n)])


def sphere(n: int) -> FloatArray:
    ways = RNG.normal(size=(n, 3))
    ways[:, 2] = np.abs(ways[:, 2])  # a half sphere
    return np.asarray(25.0 * ways / np.linalg.norm(ways, axis=1)[:, None])


def cylinder(n: int, arc: float = 360, length: float = 80) -> FloatArray:
    turn = _around(n, arc)
    return np.column_stack(
        [25 * np.cos(turn), 25 * np.sin(turn), RNG.uniform(-length / 2, length / 2, n)]
    )


def cone(n: int, half_angle: float, arc: float = 360) -> FloatArray:
    z = RNG.uniform(-10, 10, n)
    if half_angle > 1:
        z /= np.tan(half_angle)
    rho, turn = 25 + z * np.tan(half_angle), _around(n, arc)
    return np.column_stack([rho * np.cos(turn), rho * np.sin(turn), z])


CASES: dict[str, tuple[FeatureKind, FloatArray, tuple[float, ...]]] = {
    "point": (FeatureKind.POINT, np.zeros((8, 3)), ()),
    "line": (FeatureKind.LINE, line(12), ()),
    "plane": (FeatureKind.PLANE, plane(15), ()),
    "circle": (FeatureKind.CIRCLE, circle(20), (25.0,)),
    "arc of 60 degrees": (FeatureKind.CIRCLE, circle(20, 60), (25.0,)),
    "half sphere": (FeatureKind.SPHERE, sphere(25), (25.0,)),
    "cylinder": (FeatureKind.CYLINDER, cylinder(30), (25.0,)),
    "short cylinder": (FeatureKind.CYLINDER, cylinder(30, length=5), (25.0,)),
    "cylinder, 90 degrees": (FeatureKind.CYLINDER, cylinder(30, arc=90), (25.0,)),
    "cone": (FeatureKind.CONE, cone(30, 0.4), (25.0, 0.4)),
    "slender cone": (FeatureKind.CONE, cone(30, 0.05), (25.0, 0.05)),
    "flat cone": (FeatureKind.CONE, cone(30, 1.4), (25.0, 1.4)),
    "cone, 120 degrees": (FeatureKind.CONE, cone(40, 0.5, arc=120), (25.0, 0.5)),
}


def constructed(
    kind: FeatureKind, q: FloatArray, sizes: FloatArray, size: float
) -> FloatArray:
    """Return points near a feature that keep it the one of least squares."""
    surface = SURFACES[kind]
    _, by_point, by_sizes = surface.distances(q, sizes)
    turned = -np.cross(q[:, None], by_point)
    J = np.concatenate([-by_point, turned], axis=2)[..., list(surface.free)]
    J = np.concatenate([J, by_sizes], axis=2).reshape(-1, surface.n_unknowns)
    noise = RNG.normal(scale=size, size=len(J))
    left, singular, _ = np.linalg.svd(J, full_matrices=False)
    own = left[:, singular > 1e-12 * singular[0]]
    noise -= own @ (own.T @ noise)
    noise -= own @ (own.T @ noise)
    return np.asarray(q + np.einsum("nk,nki->ni", noise.reshape(len(q), -1), by_point))


@pytest.mark.parametrize("place", [np.zeros(3), FAR], ids=["here", "10 m away"])
@pytest.mark.parametrize("size", [0.0, 0.02], ids=["exact", "with form error"])
@pytest.mark.parametrize("name", CASES)
def test_the_feature_of_least_squares_is_found_exactly(
    name: str, size: float, place: FloatArray
) -> None:
    kind, q, sizes = CASES[name]
    at_zero = constructed(kind, q, np.array(sizes), size)
    R = rotation_from_vector(np.array([0.5, -1.1, 0.8]))
    points = at_zero @ R.T + place

    feature = fit_feature(kind, points)

    slope = np.tan(sizes[1]) if kind is FeatureKind.CONE else 0.0
    along = R[:, 2] @ (feature.origin - place)
    wanted = np.array(sizes)
    if kind is FeatureKind.CONE:
        sign = np.sign(feature.axis @ R[:, 2])
        assert sign > 0
        wanted = np.array([25 + slope * along, sizes[1]])
    np.testing.assert_allclose(feature.sizes, wanted, rtol=0, atol=EXACT)
    off = feature.origin - place
    if kind in {FeatureKind.LINE, FeatureKind.CYLINDER, FeatureKind.CONE}:
        off = off - along * R[:, 2]
    elif kind is FeatureKind.PLANE:
        off = along * R[:, 2]
    np.testing.assert_allclose(off, 0, atol=EXACT)
    if kind not in {FeatureKind.POINT, FeatureKind.SPHERE}:
        across = np.cross(feature.axis, R[:, 2])
        np.testing.assert_allclose(25 * across, 0, atol=EXACT)
    if size == 0:
        assert feature.form_error < EXACT


@pytest.mark.parametrize("name", CASES)
def test_a_feature_follows_its_points_as_its_derivative_says(name: str) -> None:
    kind, q, _ = CASES[name]
    R = rotation_from_vector(np.array([0.5, -1.1, 0.8]))
    points = q @ R.T + FAR / 10
    feature = fit_feature(kind, points)
    change = RNG.standard_normal(points.shape)

    ends = [fit_feature(kind, points + h * change).values for h in (1e-4, -1e-4)]

    found = (ends[0] - ends[1]) / 2e-4
    predicted = feature.by_points @ change.ravel()
    if kind in {FeatureKind.POINT, FeatureKind.SPHERE}:  # have no axis
        found[3:6] = predicted[3:6] = 0.0
    np.testing.assert_allclose(found, predicted, rtol=1e-4, atol=1e-4)


@pytest.mark.parametrize("n_points", [8, pytest.param(10, marks=pytest.mark.slow)])
def test_few_points_of_a_cone_or_a_pin_end_in_no_false_minimum(n_points: int) -> None:
    rng = np.random.default_rng(n_points)
    for _ in range(15):
        for kind, slope in (
            (FeatureKind.CONE, np.tan(rng.uniform(0.1, 1.2))),
            (FeatureKind.CYLINDER, 0.0),
        ):
            radius = rng.uniform(5, 20) if slope else 1.5
            z = rng.uniform(-1, 1, n_points) * min(8, 0.8 * radius / max(slope, 0.01))
            turn = np.linspace(0, np.radians(rng.uniform(180, 360)), n_points)
            rho = radius + slope * z
            q = np.column_stack([rho * np.cos(turn), rho * np.sin(turn), z])
            q += 0.005 * rng.standard_normal(q.shape)
            R = rotation_from_vector(rng.normal(size=3))
            sizes = [radius, np.arctan(slope)] if slope else [radius]

            found = fit_feature(kind, q @ R.T + FAR)

            start = FAR, R, np.array(sizes)
            _, best = _solve(SURFACES[kind], q @ R.T + FAR, start, 1e-12)
            assert np.sum(found.distances**2) <= 1.001 * best


@pytest.mark.parametrize(
    ("n_points", "seed"), [(8, 4), (8, 41), (8, 51), (8, 127), (9, 26), (9, 95)]
)
def test_a_cone_that_four_plain_starts_miss_is_found(
    n_points: int, seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    rng = np.random.default_rng([n_points, seed])
    slope, radius = np.tan(rng.uniform(0.1, 1.2)), rng.uniform(5, 20)
    z = rng.uniform(-1, 1, n_points) * min(8, 0.8 * radius / slope)
    turn = np.linspace(0, np.radians(rng.uniform(180, 360)), n_points)
    rho = radius + slope * z
    q = np.column_stack([rho * np.cos(turn), rho * np.sin(turn), z])
    q += 0.005 * rng.standard_normal(q.shape)
    surface = SURFACES[FeatureKind.CONE]
    truth = np.zeros(3), np.eye(3), np.array([radius, np.arctan(slope)])
    _, best = _solve(surface, q, truth, 1e-12)

    found = fit_feature(FeatureKind.CONE, q)
    monkeypatch.setattr(features, "FEW", 0)  # as if the points were many
    plain = [_solve(surface, q, each, 1e-7)[1] for each in starts(FeatureKind.CONE, q)]

    assert np.sum(found.distances**2) <= 1.001 * best
    assert min(plain) > 1.01 * best
