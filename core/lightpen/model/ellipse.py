"""The image of a round LED: an ellipse, and the offset of its centre.

A disc of radius r, unit normal n and centre X in the camera frame has the dual conic

    C* = r^2 (I - n n^T) - X X^T

in the normalised image plane [1]_, from which centre and shape of the ellipse follow.
Lens distortion then bends the ellipse; over a disc of some 40 px its second order
suffices (checked against exact outlines to 1e-4 px).

References
----------
.. [1] R. Hartley, A. Zisserman, "Multiple View Geometry", 2nd ed. (2004), section
   2.2.3 and 8.3: images of conics and dual conics.
.. [2] J. Heikkila, "Geometric camera calibration using circular control points",
   IEEE PAMI 22 (2000) 1066-1077: the eccentricity of projected circles.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.model.camera import Camera, LensModel, PointMap

IDENTITY = np.eye(2)
N_CELLS = 40  # along each side of the table of the offsets of centroids
ALONG = np.array([1, N_CELLS + 1])  # nodes of the table, by x and y
SHAPES = 100 * np.array([[[1, 0], [0, 1]], [[2, 0], [0, 1]], [[1, 0.5], [0.5, 1]]])


class Ellipses(NamedTuple):
    """Filled ellipses in an image: means and covariances of their areas."""

    centers: FloatArray  # (..., 2)
    shapes: FloatArray  # (..., 2, 2), of the areas; eigenvalues a^2 / 4 and b^2 / 4


def ellipse_centers(
    camera: Camera, centers_cam: FloatArray, normals_cam: FloatArray, radius: float
) -> FloatArray:
    """Return the centres (..., 2), px, of the ellipses that discs are imaged as.

    The centre of the conic in the undistorted normalised plane is distorted to pixels.
    Centres, mm, and unit normals of the discs (..., 3) are in the camera frame; the
    radius is in mm.
    """
    return camera.pixels(conic_centers(centers_cam, normals_cam, radius))


def ellipse_centers_with_jacobian(
    camera: Camera, centers_cam: FloatArray, normals_cam: FloatArray, radius: float
) -> PointMap:
    """Return the centres of the ellipses that discs are imaged as, and d px / d mm.

    The derivative is taken of the projected centre: the ellipse's centre lies within
    some 0.1 px of it and moves with it to a part in a thousand. For the arguments see
    `ellipse_centers`; a radius of 0 takes the projected centres.
    """
    conics = conic_centers(centers_cam, normals_cam, radius)
    pixels = camera.pixels_with_jacobian(conics)
    inverse_depth = 1 / centers_cam[..., 2:]
    J = np.empty((*centers_cam.shape[:-1], 2, 3))
    J[..., :2] = pixels.jacobian * inverse_depth[..., None]
    projected = centers_cam[..., :2] * inverse_depth
    J[..., 2] = -np.einsum("...ij,...j->...i", J[..., :2], projected)
    return PointMap(pixels.points, J)


def disc_images(
    camera: Camera, centers_cam: FloatArray, normals_cam: FloatArray, radius: float
) -> Ellipses:
    """Return centre and shape, px, of the ellipses of discs; see `ellipse_centers`."""
    conics = conic_images(centers_cam, normals_cam, radius)
    pixels = camera.pixels_with_jacobian(conics.centers)
    J = pixels.jacobian
    return Ellipses(pixels.points, J @ conics.shapes @ np.swapaxes(J, -1, -2))


def disc_centroids(
    camera: Camera, centers_cam: FloatArray, normals_cam: FloatArray, radius: float
) -> FloatArray:
    """Return the centroids (..., 2), px, of the images of discs.

    To second order they are also the centres of ellipses fitted to the rims. For the
    arguments see `ellipse_centers`; NaN where there is no ellipse.
    """
    return _centroids(camera, conic_images(centers_cam, normals_cam, radius))


def conic_images(
    centers_cam: FloatArray, normals_cam: FloatArray, radius: float
) -> Ellipses:
    """Return centre and shape of the conics that discs are in the normalised plane.

    For the arguments see `ellipse_centers`.
    """
    X, n = centers_cam, normals_cam
    r2 = radius**2
    scale = X[..., 2] ** 2 - r2 * (1 - n[..., 2] ** 2)
    centers = conic_centers(centers_cam, normals_cam, radius)
    # C* = scale [[S - c c^T, -c], [-c^T, -1]], (x - c)^T S^-1 (x - c) = 1 on the rim.
    upper = (
        r2 * (IDENTITY - n[..., :2, None] * n[..., None, :2])
        - X[..., :2, None] * X[..., None, :2]
    )
    rim = upper / scale[..., None, None] + centers[..., :, None] * centers[..., None, :]
    return Ellipses(centers, 0.25 * rim)


def centers_from_centroids(
    camera: Camera, centroids: FloatArray, shapes: FloatArray
) -> FloatArray:
    """Return the ellipse centres (..., 2) of discs from their area centroids, px.

    Distortion moves the centroid of an area off the distorted centre of the area by a
    term of second order, some 0.003 px for a disc of 40 px near the image border.
    ``shapes`` (..., 2, 2) are the covariances of the areas, px^2; NaN passes through.
    """
    known = np.isfinite(centroids[..., 0]) & np.isfinite(shapes[..., 0, 0])
    is_smooth = camera.lens is LensModel.BROWN and camera.folded_share == 0
    offsets_of = _tabulated_offsets if is_smooth else _centroid_offsets
    centers = centroids.copy()
    centers[known] -= offsets_of(camera, centroids[known], shapes[known])
    return centers


def _tabulated_offsets(
    camera: Camera, centers: FloatArray, shapes: FloatArray
) -> FloatArray:
    """Return `_centroid_offsets` of discs (N, 2), which are linear in their shapes."""
    scale, table = _offset_table(camera)
    places = centers * scale
    nodes = np.minimum(np.maximum(np.rint(places), 0), N_CELLS)
    away = np.ones((len(centers), 1, 3))
    away[:, 0, 1:] = places - nodes
    terms = shapes.reshape(-1, 4)[:, [0, 1, 3]][..., None] * away
    near = table[(nodes @ ALONG).astype(np.intp)]
    return np.asarray((near @ terms.reshape(-1, 9, 1))[..., 0])


@lru_cache(maxsize=8)
def _offset_table(camera: Camera) -> tuple[FloatArray, FloatArray]:
    """Return the cells in a pixel, (2,), and the Taylor series of offsets, (M, 2, 9).

    These are the derivatives, 1/px, by (xx, xy, yy) of a shape at each node, and the
    changes of these from cell to cell along x and y.
    """
    ends = (np.linspace(0, n - 1, N_CELLS + 1) for n in camera.image_size)
    places = np.stack(np.meshgrid(*ends), axis=-1)
    even, wide, leaning = (
        _centroid_offsets(camera, places, np.broadcast_to(shape, (*places.shape, 2)))
        for shape in SHAPES
    )
    by_xx, by_xy = wide - even, 2 * (leaning - even)
    factors = np.stack([by_xx, by_xy, even - by_xx], axis=-1) / SHAPES[0, 0, 0]
    along_y, along_x = np.gradient(factors, axis=(0, 1))
    series = np.stack([factors, along_x, along_y], axis=-1)
    scale = N_CELLS / (np.array(camera.image_size) - 1)
    return scale, series.reshape(-1, 2, 9)


def conic_centers(
    centers_cam: FloatArray, normals_cam: FloatArray, radius: float
) -> FloatArray:
    """Return the centres of the conics that discs are in the normalised plane."""
    X, n = centers_cam, normals_cam
    r2 = radius**2
    tilt = r2 * n[..., 2]
    scale = X[..., 2] ** 2 + tilt * n[..., 2] - r2
    centers: FloatArray = (
        X[..., :2] * X[..., 2:] + tilt[..., None] * n[..., :2]
    ) / scale[..., None]
    return centers


def _centroid_offsets(
    camera: Camera, centers: FloatArray, shapes: FloatArray
) -> FloatArray:
    """Return centroid minus distorted centre."""
    undistorted = camera.unproject_with_jacobian(centers)
    J = undistorted.jacobian
    normalised = Ellipses(undistorted.points, J @ shapes @ np.swapaxes(J, -1, -2))
    return _centroids(camera, normalised) - centers


def _centroids(camera: Camera, conics: Ellipses) -> FloatArray:
    """Return the centroids of distorted areas, from four points of equal covariance.

    The distorted mean of points ``c +- sqrt(2) l_k``, l_k the columns of a root of the
    covariance, is exact to second order; each weighs as the area it stands for.
    """
    steps = np.zeros((*conics.centers.shape[:-1], 4, 2))
    steps[..., 0, 0] = np.sqrt(2 * conics.shapes[..., 0, 0])
    steps[..., 0, 1] = 2 * conics.shapes[..., 0, 1] / steps[..., 0, 0]
    steps[..., 1, 1] = np.sqrt(2 * conics.shapes[..., 1, 1] - steps[..., 0, 1] ** 2)
    steps[..., 2:, :] = -steps[..., :2, :]
    there = camera.pixels_with_jacobian(conics.centers[..., None, :] + steps)
    J = there.jacobian
    areas = J[..., 0, 0] * J[..., 1, 1] - J[..., 0, 1] * J[..., 1, 0]
    means = np.einsum("...k,...ki->...i", areas, there.points)
    return np.asarray(means / areas.sum(axis=-1)[..., None])
