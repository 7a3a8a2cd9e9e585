"""Spots that are no LED of the pen file but move with the pen: where they sit on it.

Each spot is a ray from the camera, which the pose of its image puts into the pen frame.
Two rays from different sides suppose a point; one that most views have a spot for sits
on the pen.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.detection.pose import Poses
from lightpen.model.camera import Camera

MAX_UNKNOWN_LEDS = 4
MIN_VIEWS = 3
SUPPORT = 0.6  # of the views
REACH = 4.0  # px from a supposed point to its spot
MIN_PARALLAX = 0.02  # rad between the rays that suppose a point
N_SUPPOSING = 8  # views whose rays do, spread over all
FARTHEST = 2000.0  # mm from the pen's origin
REFINED = 3  # times


@dataclass(frozen=True, eq=False)
class UnknownLeds:
    """Points on the pen that the file does not know."""

    points: FloatArray  # (P, 3), pen frame, mm
    pixels: FloatArray  # (N, P, 2), their spots in each view, px; NaN without one


def find_unknown_leds(
    camera: Camera, poses: Poses, pixels: Sequence[FloatArray]
) -> UnknownLeds:
    """Find points on the pen by the spots (K, 2) of each view that are no LED, px."""
    n_views = len(pixels)
    left = _padded(pixels)
    points: list[FloatArray] = []
    spots: list[FloatArray] = []
    while len(points) < MAX_UNKNOWN_LEDS:
        supposed = _supposed(camera, poses, left)
        if not len(supposed):
            break
        counts = np.isfinite(_nearest(camera, poses, supposed, left)[..., 0]).sum(0)
        point = supposed[int(np.argmax(counts))]
        for _ in range(REFINED):
            near = _nearest(camera, poses, point[None], left)[:, 0]
            if np.isfinite(near[:, 0]).sum() < MIN_VIEWS:
                break
            point = _meeting_point(camera, poses, near)
        near = _nearest(camera, poses, point[None], left)[:, 0]
        if np.isfinite(near[:, 0]).sum() < max(MIN_VIEWS, SUPPORT * n_views):
            break
        points.append(point)
        spots.append(near)
        left = np.where((left == near[:, None]).all(axis=2)[..., None], np.nan, left)
    return UnknownLeds(
        np.array(points).reshape(-1, 3),
        np.stack(spots, axis=1) if spots else np.zeros((n_views, 0, 2)),
    )


def _padded(pixels: Sequence[FloatArray]) -> FloatArray:
    most = max((len(each) for each in pixels), default=0)
    padded = np.full((len(pixels), most, 2), np.nan)
    for i, each in enumerate(pixels):
        padded[i, : len(each)] = each
    return padded


def _rays(
    camera: Camera, poses: Poses, pixels: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return origins (N, 3) and unit directions (N, K, 3) of rays in the pen frame."""
    R, t = poses.rotations, poses.translations
    normalised = np.full_like(pixels, np.nan)
    seen = np.isfinite(pixels[..., 0])
    seen[seen] = camera.sees(pixels[seen])
    normalised[seen] = camera.unproject(pixels[seen])
    ahead = np.concatenate([normalised, np.ones((*pixels.shape[:2], 1))], axis=2)
    directions = ahead @ R
    directions /= np.linalg.norm(directions, axis=2, keepdims=True)
    return -np.einsum("nji,nj->ni", R, t), directions


def _supposed(camera: Camera, poses: Poses, pixels: FloatArray) -> FloatArray:
    """Return points (S, 3) half way between two rays that nearly meet."""
    if not np.isfinite(pixels).any():
        return np.zeros((0, 3))
    origins, directions = _rays(camera, poses, pixels)
    chosen = np.unique(
        np.linspace(0, len(pixels) - 1, N_SUPPOSING).round().astype(np.int64)
    )
    supposed = []
    for i, k in combinations(chosen.tolist(), 2):
        u, v = directions[i][:, None], directions[k][None]
        cosine = np.sum(u * v, axis=2)
        base = origins[k] - origins[i]
        along_u, along_v = np.sum(u * base, axis=2), np.sum(v * base, axis=2)
        with np.errstate(invalid="ignore"):
            wide = np.abs(cosine) < np.cos(MIN_PARALLAX)
        squared_sine = np.where(wide, 1 - cosine**2, 1.0)
        s = (along_u - cosine * along_v) / squared_sine
        w = (cosine * along_u - along_v) / squared_sine
        first = origins[i] + s[..., None] * u
        second = origins[k] + w[..., None] * v
        middle = 0.5 * (first + second)
        near = wide & (np.linalg.norm(middle, axis=2) < FARTHEST)
        supposed.append(middle[near])
    return np.concatenate(supposed) if supposed else np.zeros((0, 3))


def _nearest(
    camera: Camera, poses: Poses, points: FloatArray, pixels: FloatArray
) -> FloatArray:
    """Return the spot at each point in each view, (N, P, 2), px; NaN without one."""
    R_t = np.swapaxes(poses.rotations, 1, 2)
    there = camera.project(points @ R_t + poses.translations[:, None])
    gaps = np.sum((there[:, :, None] - pixels[:, None]) ** 2, axis=3)
    gaps = np.where(np.isfinite(gaps), gaps, np.inf)
    which = gaps.argmin(axis=2)
    near = np.take_along_axis(pixels, which[..., None], axis=1)
    is_near = np.take_along_axis(gaps, which[..., None], axis=2) < REACH**2
    return np.where(is_near, near, np.nan)


def _meeting_point(camera: Camera, poses: Poses, pixels: FloatArray) -> FloatArray:
    """Return the point nearest to the rays of spots (N, 2) of N views."""
    origins, directions = _rays(camera, poses, pixels[:, None])
    seen = np.isfinite(pixels[:, 0])
    u = directions[seen, 0]
    across = np.eye(3) - u[:, :, None] * u[:, None, :]
    right = np.einsum("nij,nj->i", across, origins[seen])
    return np.asarray(np.linalg.lstsq(across.sum(axis=0), right)[0])
