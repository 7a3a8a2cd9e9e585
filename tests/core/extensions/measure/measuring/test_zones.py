"""Zones: known by construction, and as an independent program finds them.

Points at distances of equal size hold the feature between them if their signs are those
of a linear dependence of their derivatives (Kolmogorov's criterion, G. A. Watson,
"Approximation Theory and Numerical Methods", 1980). An inscribed or circumscribed
feature is held by points that touch it all around.
"""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from tests.core.extensions.measure.measuring.test_features import CASES, EXACT, FAR

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.model.rigid import rotation_from_vector
from lightpen_extensions.measure.measuring.compensation import (
    ZONES,
    Criterion,
    fit_zone,
)
from lightpen_extensions.measure.measuring.features import fit_feature
from lightpen_extensions.measure.measuring.surfaces import SURFACES, FeatureKind

RNG = np.random.default_rng(3)
R = rotation_from_vector(np.array([0.4, -0.7, 0.2]))
TURN = np.deg2rad(np.arange(0, 360, 15))
ZONE, INSIDE, OUTSIDE = Criterion
IN_PLANE = 2, 3, 4  # motions of a circle that least squares fixes
HALF = 0.01  # mm, of a zone
N_TRIES = 100


def placed(points: FloatArray) -> FloatArray:
    return np.asarray(points @ R.T + FAR)


def held(kind: FeatureKind, q: FloatArray, sizes: FloatArray) -> FloatArray:
    """Return points near a feature that hold it in a zone of twice `HALF`."""
    surface = SURFACES[kind]
    if kind is FeatureKind.CIRCLE:
        free = [each for each in surface.free if each not in IN_PLANE]
        surface = replace(surface, free=tuple(free))
    found, J = surface.derivatives(q, sizes)
    rows = J[:, 0] / np.linalg.norm(J[:, 0], axis=0)
    tries = []
    for _ in range(N_TRIES):
        few = RNG.permutation(len(q))[: rows.shape[1] + 1]
        _, singular, axes = np.linalg.svd(rows[few].T)
        tries.append((singular[-1] * np.abs(axes[-1]).min(), few, axes[-1]))
    _, few, dependence = max(tries, key=lambda each: each[0])
    distances = RNG.uniform(-HALF / 2, HALF / 2, len(q))
    distances[few] = HALF * np.sign(dependence)
    return np.asarray(q + distances[:, None] * found.by_point[:, 0])


@pytest.mark.parametrize(
    "name",
    [k for k, (kind, *_) in CASES.items() if kind in ZONES[ZONE] and k != "line"],
)
def test_a_minimum_zone_is_found_exactly(name: str) -> None:
    kind, q, stated = CASES[name]
    points = placed(held(kind, q, np.array(stated)))

    origin, axes, sizes, zone = fit_zone(kind, points, ZONE)

    off, wanted = R.T @ (origin - FAR), np.array(stated)
    if kind is FeatureKind.CONE:
        wanted[0] += off[2] * np.tan(wanted[1])
    if kind is FeatureKind.PLANE:
        off[:2] = 0.0
    elif kind in {FeatureKind.CYLINDER, FeatureKind.CONE}:
        off[2] = 0.0
    assert zone == pytest.approx(2 * HALF, abs=EXACT)
    np.testing.assert_allclose(sizes, wanted, rtol=0, atol=EXACT)
    np.testing.assert_allclose(off, 0, atol=EXACT)
    if kind is not FeatureKind.SPHERE:
        np.testing.assert_allclose(25 * np.cross(axes[:, 2], R[:, 2]), 0, atol=EXACT)
    assert zone < fit_feature(kind, points).form_error


def touching(kind: FeatureKind, length: float, beyond: FloatArray) -> FloatArray:
    """Return points of radius 25 and, where not held by them, by so much more."""
    heights = (0.0,) if kind is FeatureKind.CIRCLE else (-length / 2, 0.0, length / 2)
    if kind is FeatureKind.SPHERE:
        ways = np.vstack([np.eye(3), -np.eye(3), RNG.normal(size=(len(beyond) - 6, 3))])
        ways /= np.linalg.norm(ways, axis=1)[:, None]
        beyond[:6] = 0.0
        return np.asarray((25 + beyond[:, None]) * ways)
    beyond[::8] = 0.0
    flat = (25 + beyond)[:, None] * np.column_stack([np.cos(TURN), np.sin(TURN)])
    return np.vstack([np.insert(flat, 2, z, axis=1) for z in heights])


@pytest.mark.parametrize(("criterion", "sign"), [(INSIDE, 1), (OUTSIDE, -1)])
@pytest.mark.parametrize(
    ("kind", "length"),
    [
        (FeatureKind.CIRCLE, 0.0),
        (FeatureKind.SPHERE, 0.0),
        (FeatureKind.CYLINDER, 40.0),
        (FeatureKind.CYLINDER, 4.0),
    ],
)
def test_inscribed_and_circumscribed_features_are_found_exactly(
    kind: FeatureKind, length: float, criterion: Criterion, sign: int
) -> None:
    beyond = sign * RNG.uniform(0.005, 0.02, len(TURN))
    points = placed(touching(kind, length, beyond))

    origin, axes, sizes, _ = fit_zone(kind, points, criterion)

    off = R.T @ (origin - FAR)
    n_fixed = 2 if kind is FeatureKind.CYLINDER else 3
    assert sizes[0] == pytest.approx(25, abs=EXACT)
    np.testing.assert_allclose(off[:n_fixed], 0, atol=EXACT)
    if kind is not FeatureKind.SPHERE:
        np.testing.assert_allclose(25 * np.cross(axes[:, 2], R[:, 2]), 0, atol=EXACT)


def test_straightness_is_the_thinnest_cylinder_about_the_points() -> None:
    three = HALF * np.column_stack([np.cos(TURN[::8]), np.sin(TURN[::8])])
    inner = np.insert(RNG.uniform(-HALF / 2, HALF / 2, (20, 2)), 2, 0, axis=1)
    inner[:, 2] = RNG.uniform(-40, 40, 20)
    ends = [np.insert(three, 2, z, axis=1) for z in (-50.0, 50.0)]
    points = placed(np.vstack([*ends, inner]))

    origin, axes, _, zone = fit_zone(FeatureKind.LINE, points, ZONE)

    assert zone == pytest.approx(2 * HALF, abs=EXACT)
    np.testing.assert_allclose((R.T @ (origin - FAR))[:2], 0, atol=EXACT)
    np.testing.assert_allclose(50 * np.cross(axes[:, 2], R[:, 2]), 0, atol=EXACT)


def test_a_circumscribed_circle_is_that_of_another_program() -> None:
    rho = 25 + RNG.normal(scale=0.5, size=len(TURN))
    flat = np.column_stack([rho * np.cos(TURN), rho * np.sin(TURN), 0 * TURN])
    _, radius = cv2.minEnclosingCircle(flat[:, :2].astype(np.float32))

    _, _, sizes, _ = fit_zone(FeatureKind.CIRCLE, placed(flat), OUTSIDE)

    assert sizes[0] == pytest.approx(radius, abs=2e-4)  # which adds 1e-4


def test_a_plane_has_no_inscribed_fit() -> None:
    with pytest.raises(CalibrationError, match="Use least squares"):
        fit_zone(FeatureKind.PLANE, placed(RNG.normal(size=(9, 3))), INSIDE)


def test_an_inscribed_circle_needs_points_all_around() -> None:
    arc = 25 * np.column_stack([np.cos(TURN[:11]), np.sin(TURN[:11])])

    with pytest.raises(CalibrationError, match="do not determine"):
        fit_zone(FeatureKind.CIRCLE, placed(np.insert(arc, 2, 0, axis=1)), INSIDE)
