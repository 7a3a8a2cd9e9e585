"""Zones: known by construction, and as an independent program finds them."""

import cv2
import numpy as np
import pytest

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.measuring.features import fit_feature
from lightpen.measuring.surfaces import FeatureKind
from lightpen.measuring.zones import Criterion, fit_zone
from lightpen.model.rigid import rotation_from_vector

RNG = np.random.default_rng(3)
R = rotation_from_vector(np.array([0.4, -0.7, 0.2]))
PLACE = np.array([100.0, -50.0, 900.0])
TURN = np.deg2rad(np.arange(0, 360, 15))
ZONE, INSIDE, OUTSIDE = Criterion


def placed(points: FloatArray) -> FloatArray:
    return np.asarray(points @ R.T + PLACE)


def ring(radial: FloatArray, z: float = 0.0) -> FloatArray:
    rho = 25 + radial
    return np.column_stack([rho * np.cos(TURN), rho * np.sin(TURN), 0 * TURN + z])


def test_flatness_of_alternating_corners_is_known() -> None:
    # Four corners that alternate hold the plane between them (Chebyshev).
    height = np.array([0.01, -0.01, 0.01, -0.01])
    corners = np.array([[50, 50], [-50, 50], [-50, -50], [50, -50]])
    inner = np.column_stack(
        [RNG.uniform(-30, 30, (20, 2)), RNG.uniform(-2e-3, 2e-3, 20)]
    )
    points = placed(np.vstack([np.column_stack([corners, height]), inner]))

    *_, zone = fit_zone(FeatureKind.PLANE, points, ZONE)

    assert zone == pytest.approx(0.02, abs=1e-9)
    assert zone < fit_feature(FeatureKind.PLANE, points).form_error


def test_roundness_of_alternating_points_is_known() -> None:
    radial = 0.002 * RNG.uniform(-1, 1, len(TURN))
    radial[::6] = 0.01 * np.array([1, -1, 1, -1])

    origin, _, sizes, zone = fit_zone(FeatureKind.CIRCLE, placed(ring(radial)), ZONE)

    assert zone == pytest.approx(0.02, abs=1e-9)
    assert sizes[0] == pytest.approx(25, abs=1e-9)
    np.testing.assert_allclose(origin, PLACE, atol=1e-9)


def test_a_circumscribed_circle_is_that_of_another_program() -> None:
    flat = ring(RNG.normal(scale=0.5, size=len(TURN)))
    _, radius = cv2.minEnclosingCircle(flat[:, :2].astype(np.float32))

    _, _, sizes, _ = fit_zone(FeatureKind.CIRCLE, placed(flat), OUTSIDE)

    assert sizes[0] == pytest.approx(radius, abs=2e-4)  # which adds 1e-4


@pytest.mark.parametrize("kind", [FeatureKind.CIRCLE, FeatureKind.CYLINDER])
@pytest.mark.parametrize(("criterion", "sign"), [(INSIDE, -1), (OUTSIDE, 1)])
def test_three_points_hold_an_inscribed_or_circumscribed_radius(
    kind: FeatureKind, criterion: Criterion, sign: int
) -> None:
    radial = -sign * RNG.uniform(0.005, 0.02, len(TURN))
    radial[::8] = 0.0
    heights = (0.0,) if kind is FeatureKind.CIRCLE else (-20.0, 0.0, 20.0)
    points = placed(np.vstack([ring(radial, z) for z in heights]))

    _, axes, sizes, _ = fit_zone(kind, points, criterion)

    assert sizes[0] == pytest.approx(25, abs=1e-8)
    np.testing.assert_allclose(np.cross(axes[:, 2], R[:, 2]), 0, atol=1e-9)


def test_a_sphere_within_its_touching_points_is_found() -> None:
    ways = np.vstack([np.eye(3), -np.eye(3), RNG.normal(size=(30, 3))])
    rho = np.concatenate([np.full(6, 10.0), RNG.uniform(10.01, 10.03, 30)])
    points = placed(ways / np.linalg.norm(ways, axis=1)[:, None] * rho[:, None])

    _, _, sizes, _ = fit_zone(FeatureKind.SPHERE, points, INSIDE)

    assert sizes[0] == pytest.approx(10, abs=1e-9)


def test_straightness_is_the_thinnest_cylinder_about_the_points() -> None:
    z = np.linspace(-50, 50, 21)
    turn = np.deg2rad(120) * np.arange(21)
    points = placed(
        0.01 * np.column_stack([np.cos(turn), np.sin(turn), 0 * z])
        + np.column_stack([0 * z, 0 * z, z])
    )

    *_, zone = fit_zone(FeatureKind.LINE, points, ZONE)

    assert 0.019 < zone <= 0.02 + 1e-9
    assert zone <= fit_feature(FeatureKind.LINE, points).form_error + 1e-9


def test_no_zone_is_wider_than_that_of_least_squares() -> None:
    turn = RNG.uniform(0, 6, 40)
    z = RNG.uniform(-10, 10, 40)
    rho = 20 + 0.3 * z + RNG.normal(scale=0.01, size=40)
    points = placed(np.column_stack([rho * np.cos(turn), rho * np.sin(turn), z]))

    *_, zone = fit_zone(FeatureKind.CONE, points, ZONE)

    assert 0.01 < zone <= fit_feature(FeatureKind.CONE, points).form_error


def test_a_plane_has_no_inscribed_fit() -> None:
    with pytest.raises(CalibrationError, match="Use least squares"):
        fit_zone(FeatureKind.PLANE, placed(RNG.normal(size=(9, 3))), INSIDE)
