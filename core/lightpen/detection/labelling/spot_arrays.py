"""The spots of many images as arrays, without distortion.

Pinhole pixels are the undistorted normalised plane times the focal length.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from lightpen.arrays import BoolArray, FloatArray
from lightpen.detection.spots import SpotFlaw, Spots
from lightpen.model.camera import Camera

FAR = 1e7  # px, where no spot is
UNWHOLE = int(SpotFlaw.MERGED | SpotFlaw.CUT)


@dataclass(frozen=True, eq=False)
class SpotArrays:
    """The spots of B images in pinhole pixels, padded to N spots each."""

    focal: float  # pinhole pixels in one unit of the normalised plane
    points: FloatArray  # (B, N, 2), centres, `FAR` where there is no usable spot
    # (B, N, 2), centres of the merged and cut spots, `FAR` elsewhere.
    unwhole_points: FloatArray
    shapes: FloatArray  # (B, N, 2, 2), covariances of the areas
    usable: BoolArray  # (B, N)
    radius: float  # radius of the discs of the pen, mm

    @cached_property
    def rays(self) -> FloatArray:
        """Unit vectors to the usable spots, (B, N, 3)."""
        rays = np.ones((*self.usable.shape, 3))
        rays[..., :2] = self.points / self.focal
        rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
        return rays

    @cached_property
    def ranges(self) -> FloatArray:
        """Distances of the usable spots, if they are discs of the pen, (B, N), mm."""
        ranges = np.full(self.usable.shape, np.inf)
        points = self.points[self.usable] / self.focal
        shapes = self.shapes[self.usable] / self.focal**2
        ranges[self.usable] = _ranges(points, shapes, self.radius)
        return ranges


def spot_arrays(
    spots: Sequence[Spots], camera: Camera, radius: float, use_unwhole: bool = False
) -> SpotArrays:
    """Return the spots of images, undistorted.

    Parameters
    ----------
    spots : sequence of Spots
        One per image.
    radius : float
        Radius of the discs, mm.
    use_unwhole : bool
        Take merged and cut spots for whole ones.
    """
    n_spots = np.array([len(s) for s in spots])
    there = np.arange(max(int(n_spots.max()), 1)) < n_spots[:, None]
    flaws = np.zeros(there.shape, dtype=np.int64)
    flaws[there] = np.concatenate([s.flaws for s in spots])
    focal = float(np.sqrt(camera.fx * camera.fy))
    centers = np.concatenate([s.centers for s in spots])
    seen = there.copy()
    seen[there] = camera.sees(centers)
    centers[~seen[there]] = np.nan  # has no direction
    plane = camera.unproject_with_jacobian(centers)
    J = focal * plane.jacobian
    points = np.full((*there.shape, 2), FAR)
    points[there] = np.where(seen[there][:, None], focal * plane.points, FAR)
    shapes = np.empty((*there.shape, 2, 2))
    shapes[:] = np.eye(2)
    shapes[there] = J @ np.concatenate([s.shapes for s in spots]) @ J.transpose(0, 2, 1)
    unwhole = seen & (flaws & UNWHOLE != 0)
    usable = seen & (use_unwhole | ~unwhole)
    return SpotArrays(
        focal=focal,
        points=np.where(usable[..., None], points, FAR),
        unwhole_points=np.where(unwhole[..., None], points, FAR),
        shapes=shapes,
        usable=usable,
        radius=radius,
    )


def _ranges(x: FloatArray, shapes: FloatArray, radius: float) -> FloatArray:
    """Return distances of discs from their shapes in the normalised plane.

    Seen along its ray, a disc's longer semi-axis is radius / distance whatever its
    tilt; the plane is first turned square to the ray.
    """
    stretch = np.sqrt(1 + np.einsum("ni,ni->n", x, x))
    turn = np.eye(2) - x[:, :, None] * (x / (stretch * (stretch + 1))[:, None])[:, None]
    square = turn @ shapes @ np.swapaxes(turn, 1, 2) / (stretch**2)[:, None, None]
    half_trace = 0.5 * (square[:, 0, 0] + square[:, 1, 1])
    difference = 0.5 * (square[:, 0, 0] - square[:, 1, 1])
    largest = half_trace + np.hypot(difference, square[:, 0, 1])
    return np.asarray(radius / (2 * np.sqrt(largest)))
