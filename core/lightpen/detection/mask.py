"""Circles of an image that are left out, one by one: drawn, or a click at a time."""

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.detection.inspection import stray_light
from lightpen.detection.spots import Spots


def with_circle(mask: FloatArray, circle: FloatArray) -> FloatArray:
    """Return a mask (M, 3) with a circle x, y, radius more, px."""
    return np.concatenate([mask, np.reshape(circle, (1, 3))])


def clicked(mask: FloatArray, spots: Spots, point: FloatArray) -> FloatArray:
    """Return a mask after a click on the image.

    A click into circles takes them away, one on or beside a spot puts one over it, and
    one anywhere else changes nothing.

    Parameters
    ----------
    mask : (M, 3) array
        x, y and radius, px.
    spots : Spots
        All that is bright in the image and not masked.
    point : (2,) array
        Where the click was, px.
    """
    is_hit = _distances(mask, point) <= mask[:, 2]
    if is_hit.any():
        return mask[~is_hit]
    circles = stray_light(spots)
    gaps = _distances(circles, point) - circles[:, 2]
    if not len(gaps) or gaps.min() > 0:
        return mask
    return with_circle(mask, circles[np.argmin(gaps)])


def _distances(circles: FloatArray, point: FloatArray) -> FloatArray:
    distances: FloatArray = np.linalg.norm(circles[:, :2] - point, axis=1)
    return distances
