"""Shape and turns of a pen from its tracks under weak perspective.

References
----------
.. [1] C. Tomasi, T. Kanade, "Shape and motion from image streams under orthography: a
   factorization method", Int. J. Computer Vision 9 (1992) 137-154.
.. [2] C. J. Poelman, T. Kanade, "A paraperspective factorization method for shape and
   motion recovery", IEEE PAMI 19 (1997) 206-218, section 2.4: scaled orthography.
"""

from typing import NamedTuple

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.model.rigid import nearest_rotation

FILLING_STEPS = 60
SIZE_WEIGHT = 10.0  # of the mean scale of 1 beside the other equations
LEAST_METRIC = 1e-6  # of the largest eigenvalue, that the least is taken to be


class WeakShape(NamedTuple):
    """Shape and motion, up to a mirror along the line of sight."""

    points: FloatArray  # (L, 3), about their centroid; the mean scale is 1 px a unit
    rotations: FloatArray  # (N, 3, 3), of cam_from_shape
    scales: FloatArray  # (N,), px a unit
    centroids: FloatArray  # (N, 2), image of the centroid, px

    @property
    def mirrored(self) -> "WeakShape":
        """The other shape with the same images: near and far exchanged."""
        flip = np.array([1.0, 1.0, -1.0])
        rotations = flip[:, None] * self.rotations * flip
        return self._replace(points=self.points * flip, rotations=rotations)


def factorise(pixels: FloatArray, least_metric: float = LEAST_METRIC) -> WeakShape:
    """Return shape and motion from tracks.

    Parameters
    ----------
    pixels : (N, L, 2) array
        px; NaN where a point is not seen, which is filled by the points beside it.
    least_metric : float
        Where a flat pen or strong perspective leaves the depth of the shape open, the
        least eigenvalue of its metric is taken to be this share of the largest.
    """
    filled = filled_tracks(pixels)
    n = len(filled)
    centroids = filled.mean(axis=1)
    tracks = np.concatenate(np.moveaxis(filled - centroids[:, None], 2, 0))
    left, values, right = np.linalg.svd(tracks, full_matrices=False)
    motion = left[:, :3] * np.sqrt(values[:3])
    shape = np.sqrt(values[:3])[:, None] * right[:3]
    upgrade = _metric_upgrade(motion[:n], motion[n:], least_metric)
    motion, points = motion @ upgrade, np.linalg.solve(upgrade, shape).T
    a, b = motion[:n], motion[n:]
    lengths = np.linalg.norm(a, axis=1) + np.linalg.norm(b, axis=1)
    scales = np.maximum(lengths / 2, 1e-6)
    axes = np.stack([a, b, np.cross(a, b) / scales[:, None]], axis=1)
    return WeakShape(points, nearest_rotation(axes), scales, centroids)


def filled_tracks(pixels: FloatArray) -> FloatArray:
    """Return tracks without gaps: interpolated, then drawn to an affine shape."""
    known = np.isfinite(pixels[..., 0])
    filled = pixels.copy()
    every = np.arange(len(pixels))
    for j in range(pixels.shape[1]):
        own = known[:, j]
        for k in range(2):
            filled[:, j, k] = np.interp(every, every[own], pixels[own, j, k])
    if known.all():
        return filled
    n = len(pixels)
    tracks = np.concatenate([filled[..., 0], filled[..., 1]])
    seen = np.concatenate([known, known])
    for _ in range(FILLING_STEPS):
        centroids = tracks.mean(axis=1, keepdims=True)
        left, values, right = np.linalg.svd(tracks - centroids, full_matrices=False)
        fit = (left[:, :3] * values[:3]) @ right[:3] + centroids
        tracks = np.where(seen, tracks, fit)
    return np.stack([tracks[:n], tracks[n:]], axis=2)


def _metric_upgrade(a: FloatArray, b: FloatArray, least: float) -> FloatArray:
    """Return the matrix (3, 3) by which the rows of motion become axes of a camera."""
    size = (_product(a, a) + _product(b, b)).mean(axis=0, keepdims=True)
    alike = np.concatenate([_product(a, a) - _product(b, b), _product(a, b)])
    rows = np.concatenate([alike, SIZE_WEIGHT * size])
    right = np.zeros(len(rows))
    right[-1] = 2 * SIZE_WEIGHT
    m = np.linalg.lstsq(rows, right, rcond=None)[0]
    values, vectors = np.linalg.eigh(m[[[0, 1, 2], [1, 3, 4], [2, 4, 5]]])
    floor = max(least * float(np.abs(values).max()), 1e-300)
    return np.asarray(vectors * np.sqrt(np.maximum(values, floor)))


def _product(p: FloatArray, q: FloatArray) -> FloatArray:
    """Return the coefficients of p^T M q by the six elements of M, (N, 6)."""
    x, y, z = p.T
    u, v, w = q.T
    return np.stack(
        [x * u, x * v + y * u, x * w + z * u, y * v, y * w + z * v, z * w], axis=1
    )
