"""Variation of board views: position, size and skew in the image.

Measures and required ranges are taken from the calibrator of ROS [1]_.

References
----------
.. [1] ROS image_pipeline, camera_calibration, ``calibrator.py``.
"""

from dataclasses import dataclass

import cv2
import numpy as np

from lightpen.arrays import FloatArray
from lightpen.intrinsics.views import Views

ENOUGH = np.array([0.7, 0.7, 0.4, 0.5])  # of x, y, size and skew
MIN_POINTS = 4  # of a view, for its outline


@dataclass(frozen=True)
class ViewProgress:
    """How much of the variation that suffices the views have, 0 to 1 each."""

    x: float = 0.0
    y: float = 0.0
    size: float = 0.0
    skew: float = 0.0


def view_progress(views: Views) -> ViewProgress:
    """Return the variation of the views of the first camera."""
    size = views.image_sizes[0]
    found = [
        _measures(_outline(views, seen), size)
        for seen in views.pixels[:, 0]
        if np.isfinite(seen[:, 0]).sum() >= MIN_POINTS
    ]
    if not found:
        return ViewProgress()
    least, most = np.min(found, axis=0), np.max(found, axis=0)
    least[2:] = 0.0  # a small or upright view is no achievement
    share = np.clip((most - least) / ENOUGH, 0.0, 1.0)
    return ViewProgress(*share.tolist())


def _outline(views: Views, seen: FloatArray) -> FloatArray:
    """Return the corners of the board in an image, (4, 2), px, by a homography."""
    is_seen = np.isfinite(seen[:, 0])
    plane = views.board.points[is_seen, :2]
    H, _ = cv2.findHomography(plane, seen[is_seen])
    corners = np.column_stack([views.board.outline[:, :2], np.ones(4)]) @ H.T
    return np.asarray(corners[:, :2] / corners[:, 2:])


def _measures(outline: FloatArray, size: tuple[int, int]) -> FloatArray:
    """Return x, y, size and skew of a board with these corners, (4,), 0 to 1."""
    x, y = outline.T
    area = 0.5 * abs(x @ np.roll(y, -1) - y @ np.roll(x, -1))
    side = np.sqrt(area)
    room = np.maximum(np.array(size) - side, 1.0)
    place = np.clip((outline.mean(axis=0) - 0.5 * side) / room, 0.0, 1.0)
    one, other = outline[0] - outline[1], outline[2] - outline[1]
    lengths = np.linalg.norm(one) * np.linalg.norm(other)
    angle = np.arccos(np.clip(one @ other / lengths, -1.0, 1.0))
    skew = min(1.0, 2.0 * abs(0.5 * np.pi - angle))
    return np.array([*place, np.sqrt(area / (size[0] * size[1])), skew])
