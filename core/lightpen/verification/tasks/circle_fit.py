"""A circle of least squares through points in space.

`lightpen.measuring` does the fit. The error of its radius is, to first order,

    dr = sum_i g_i . dX_i

where ``g_i`` lies in the plane along the radius to point i.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from lightpen.arrays import BoolArray, FloatArray
from lightpen.errors import CalibrationError
from lightpen.measuring.features import fit_feature
from lightpen.measuring.surfaces import FeatureKind
from lightpen.verification.tasks.surface_points import lie_near

LEAST_POINTS = 3  # that determine a circle
EDGE_ON = 0.9  # of the normal along u
SMALLEST = 0.5  # mm, least radius of a circle
THIN = 0.02  # of the points' extent: less across is a line
N_SAMPLES = 500  # of three points each


@dataclass(frozen=True, eq=False)
class CircleFit:
    """A circle of least squares in its own plane."""

    center_cam: FloatArray  # (3,), mm
    normal_cam: FloatArray  # (3,), unit vector, towards the camera
    radius: float  # mm
    radial: FloatArray  # (N,), distances from the circle in its plane, outwards, mm
    axial: FloatArray  # (N,), distances from its plane, mm
    angles: FloatArray  # (N,), rad: from the right of the camera, anticlockwise
    weights: FloatArray  # (N, 3), derivative of the radius by each point

    @property
    def roundness(self) -> float:
        """Range of the radial distances, mm."""
        return float(np.ptp(self.radial))

    @property
    def flatness(self) -> float:
        """Range of the distances from the plane, mm."""
        return float(np.ptp(self.axial))

    @property
    def covered(self) -> float:
        """Covered angle: 360 minus the largest gap between touches, degrees."""
        return 360.0 - float(np.degrees(gaps_of(self.angles).max()))


def fit_circle(points_cam: FloatArray) -> CircleFit:
    """Fit a circle to points (N, 3), mm, not in one place nor on a line."""
    middle = points_cam.mean(axis=0)
    extents = np.linalg.svd(points_cam - middle, compute_uv=False)
    if extents[0] / np.sqrt(len(points_cam)) < SMALLEST or (
        extents[1] < THIN * extents[0]
    ):
        raise CalibrationError("circle.line")
    found = fit_feature(FeatureKind.CIRCLE, points_cam)
    normal = found.axis if found.axis[2] < 0 else -found.axis
    across = _across(normal)
    plane = np.stack([across, np.cross(normal, across)])
    radius, spokes = found.size("radius"), (points_cam - found.origin) @ plane.T
    outwards = spokes / np.linalg.norm(spokes, axis=1)[:, None]
    J = np.column_stack([outwards, np.ones(len(spokes))])
    return CircleFit(
        center_cam=found.origin,
        normal_cam=normal,
        radius=radius,
        radial=np.linalg.norm(spokes, axis=1) - radius,
        axial=(points_cam - found.origin) @ normal,
        angles=np.arctan2(spokes[:, 1], spokes[:, 0]),
        weights=np.linalg.pinv(J)[2][:, None] * (outwards @ plane),
    )


def ring_so_far(points_cam: FloatArray) -> CircleFit | None:
    """Return the circle that most of the points (N, 3), mm, lie on, by these alone.

    None before they determine one.
    """
    if len(points_cam) < LEAST_POINTS:
        return None
    try:
        return fit_circle(points_cam[on_ring_of(points_cam)])
    except CalibrationError:
        return None


def residuals_of(
    fit: CircleFit, points_cam: FloatArray | Sequence[FloatArray]
) -> FloatArray:
    """Return radial and out-of-plane deviations of points, (N, 2), mm."""
    ways = np.reshape(points_cam, (-1, 3)) - fit.center_cam
    axial = ways @ fit.normal_cam
    spokes = ways - axial[:, None] * fit.normal_cam
    return np.column_stack([np.linalg.norm(spokes, axis=1) - fit.radius, axial])


def _across(normal: FloatArray) -> FloatArray:
    """Return the unit vector in a plane nearest to u, or to v where u sticks out."""
    axis = np.eye(3)[1 if abs(normal[0]) > EDGE_ON else 0]
    across = axis - (axis @ normal) * normal
    return np.asarray(across / np.linalg.norm(across))


class RingResiduals(NamedTuple):
    """Derivatives of the residuals of points from a ring: radial, then out of plane."""

    by_points: FloatArray  # (2 N, 3 N)
    by_ring: FloatArray  # (2 N, 5): centre in its plane, height, two tilts


def ring_residuals(fit: CircleFit, n: int) -> RingResiduals:
    """Return the derivatives of the residuals of the n points of a fit."""
    across = _across(fit.normal_cam)
    plane = np.stack([across, np.cross(fit.normal_cam, across)])
    outwards = np.column_stack([np.cos(fit.angles), np.sin(fit.angles)])
    by_points = np.zeros((2, n, n, 3))
    by_points[0, range(n), range(n)] = outwards @ plane
    by_points[1, range(n), range(n)] = fit.normal_cam
    by_ring = np.zeros((2, n, 5))
    by_ring[0, :, :2] = -outwards
    by_ring[1, :, 2] = -1.0
    by_ring[1, :, 3:] = -fit.radius * outwards
    return RingResiduals(by_points.reshape(2 * n, 3 * n), by_ring.reshape(2 * n, 5))


def on_ring_of(points: FloatArray) -> BoolArray:
    """Return the mask of the points (N, 3) on the circle through most of them."""
    rng = np.random.default_rng(0)  # the same points give the same circle
    members = np.argsort(rng.random((N_SAMPLES, len(points))), axis=1)[:, :3]
    a, b, c = (points[members[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    doubled = np.sum(normals**2, axis=1)
    with np.errstate(all="ignore"):  # three points on a line make no circle
        to_center = (
            np.cross(normals, b - a) * np.sum((c - a) ** 2, axis=1)[:, None]
            + np.cross(c - a, normals) * np.sum((b - a) ** 2, axis=1)[:, None]
        ) / (2 * doubled[:, None])
        radii = np.linalg.norm(to_center, axis=1)
        normals = normals / np.sqrt(doubled)[:, None]
        spokes = points[None] - (a + to_center)[:, None]
        axial = np.einsum("sni,si->sn", spokes, normals)
        in_plane = np.linalg.norm(np.cross(spokes, normals[:, None]), axis=2)
        distances = np.hypot(in_plane - radii[:, None], axial)
    # Least median of squares: three points are on their circle, whatever the others.
    at = min((len(points) + 4) // 2, len(points)) - 1
    reached = np.nan_to_num(np.sort(distances, axis=1)[:, at], nan=np.inf)
    best = distances[int(np.argmin(reached))]
    fit = fit_circle(points[lie_near(best)])
    return lie_near(np.linalg.norm(residuals_of(fit, points), axis=1))


def gaps_of(angles: FloatArray) -> FloatArray:
    """Return the angle from each point to the next round the ring, in order, rad."""
    ordered = np.sort(angles)
    return np.diff(ordered, append=ordered[0] + 2 * np.pi)
