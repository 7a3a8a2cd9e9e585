"""Projection uncertainty of intrinsics over the image.

An error of the intrinsics that is equivalent to a rotation of the camera does not
count: the orientation is estimated anew in each use. So the turn that explains most of
it is taken out of the field of errors over the image [1]_.

References
----------
.. [1] D. Kogan, mrcal, "Projection uncertainty": the implied rotation.
"""

from dataclasses import dataclass

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.model.camera import Camera
from lightpen.model.rigid import skew

COLUMNS, ROWS = 9, 7


@dataclass(frozen=True, eq=False)
class UncertaintyMap:
    """Standard uncertainty of projections over the image."""

    pixels: FloatArray  # (7, 9, 2), positions in the image, px
    # (7, 9), along the worst direction there, px; NaN where nothing is seen.
    sigmas: FloatArray

    @property
    def center(self) -> float:
        """In the middle of the image, px."""
        return float(self.sigmas[ROWS // 2, COLUMNS // 2])

    @property
    def typical(self) -> float:
        """Root mean square over the image, px."""
        return float(np.sqrt(np.nanmean(self.sigmas**2)))

    @property
    def worst(self) -> float:
        """The largest, px."""
        return float(np.nanmax(self.sigmas))


def map_uncertainty(camera: Camera, covariance: FloatArray) -> UncertaintyMap:
    """Return the projection uncertainty by a covariance of the intrinsics."""
    fields = error_fields(camera)
    by_place = fields @ covariance @ np.swapaxes(fields, -1, -2)
    sigmas = np.sqrt(np.maximum(np.linalg.eigvalsh(by_place)[..., -1], 0.0))
    sigmas[~camera.sees(_pixels(camera).reshape(-1, 2))] = np.nan
    return UncertaintyMap(_pixels(camera), sigmas.reshape(ROWS, COLUMNS))


def error_fields(camera: Camera) -> FloatArray:
    """Return the derivatives of image points by the intrinsics, (63, 2, 4 + n), px.

    The turn that explains most of each is left out; 0 where the camera sees nothing.
    """
    pixels = _pixels(camera).reshape(-1, 2)
    seen = camera.sees(pixels)
    directions = np.zeros_like(pixels)
    directions[seen] = camera.unproject(pixels[seen])
    points = np.concatenate([directions, np.ones((len(directions), 1))], axis=1)
    by_point = camera.project_with_jacobian(points).jacobian
    by_point[~seen] = 0.0
    turns = (-by_point @ skew(points)).reshape(-1, 3)
    fields = camera.intrinsics_jacobian(directions)
    fields[~seen] = 0.0
    flat = fields.reshape(len(turns), -1)
    explained = turns @ np.linalg.lstsq(turns, flat, rcond=None)[0]
    return np.asarray((flat - explained).reshape(fields.shape))


def moved_in_image(camera: Camera, difference: FloatArray) -> float:
    """Return the rms image shift by a difference of the intrinsics, px."""
    moves = error_fields(camera) @ difference
    return float(np.sqrt(np.mean(np.square(moves).sum(axis=-1))))


def _pixels(camera: Camera) -> FloatArray:
    grid = np.meshgrid(
        np.linspace(0, camera.width - 1, COLUMNS),
        np.linspace(0, camera.height - 1, ROWS),
    )
    return np.stack(grid, axis=-1)
