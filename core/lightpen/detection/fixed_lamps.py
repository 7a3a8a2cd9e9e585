"""Fixed lamps in view, by which motion of the camera is detected.

A lamp is the light in a circle that was masked as stray, or a spot that nearly every
image shows in the same place and is no LED of the pen. When the camera is bumped all
lamps jump at once: a light that disappears at one place and appears at another in the
same image is one lamp.
"""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from lightpen.arrays import BoolArray, FloatArray, Image
from lightpen.detection.pen_detection import PenDetection
from lightpen.detection.spots import SpotFlaw, Spots, detect_spots

NEARLY_ALL = 0.8  # of the images show a lamp
STAYS = 5.0  # px about its place
FARTHEST = 200.0  # px that a lamp jumps; what goes farther is another light
MAX_PLACES = 3  # of a lamp; lights with more places move with the pen
BRIEFEST = 3  # images of a lamp in one place
BETWEEN = 0.1  # of the images, that may show neither of two places
N_LOOKED_AT = 5  # images in which lamps are looked for first
MARGIN = 8  # px about a masked circle


def masked_lights(
    image: Image, mask: FloatArray | None, full_scale: int | None = None
) -> FloatArray:
    """Return the centre of the brightest clean spot in each masked circle, (M, 2), px.

    NaN in a circle without one. ``mask`` and ``full_scale`` as in
    `lightpen.detection.spots.detect_spots`.
    """
    circles = np.zeros((0, 3)) if mask is None else np.asarray(mask)
    found = np.full((len(circles), 2), np.nan)
    height, width = image.shape
    for k, (x, y, radius) in enumerate(circles):
        left, top = (max(int(v - radius) - MARGIN, 0) for v in (x, y))
        right = min(int(x + radius) + MARGIN, width)
        bottom = min(int(y + radius) + MARGIN, height)
        if left >= right or top >= bottom:
            continue
        window: Image = image[top:bottom, left:right].copy()
        spots = detect_spots(window, full_scale=full_scale)
        centers = spots.centers[_are_clean(spots)] + (left, top)
        inside = np.hypot(*(centers - (x, y)).T) < radius
        if inside.any():
            found[k] = centers[np.argmax(inside)]  # brightest first
    return found


def fixed_lamps(masked: FloatArray, detections: Sequence[PenDetection]) -> FloatArray:
    """Return the fixed lamps that nearly all images show, (N, K, 2), px; else NaN.

    They are lights in masked circles ``masked`` (N, M, 2), px, NaN where an image shows
    none, and unlabelled spots of the N detections.
    """
    return lamps_among(masked, list(map(other_lights, detections)))


def lamps_among(masked: FloatArray, lights: Sequence[FloatArray]) -> FloatArray:
    """Return the fixed lamps in images among lights that are no LEDs, as `fixed_lamps`.

    ``lights`` (S, 2), px, are those in each of the N images.
    """
    paths = [
        _path(path[:, None], np.nanmedian(path, axis=0))
        for path in np.swapaxes(masked, 0, 1)
        if _is_shown(path)
    ]
    in_circles = [each[np.isfinite(each[:, 0])] for each in masked]
    every = [np.concatenate(both) for both in zip(lights, in_circles, strict=True)]
    padded = np.full((len(every), max(map(len, every), default=0), 2), np.nan)
    for row, each in zip(padded, every, strict=True):
        row[: len(each)] = each
    shown = [each for each in every if len(each)]
    if len(shown) >= NEARLY_ALL * len(every):
        looked_at = np.linspace(0, len(shown) - 1, N_LOOKED_AT).astype(int)
        places = np.concatenate([shown[index] for index in looked_at])
        paths += [_path(padded, place) for place in places]
    # The same lamp, examined in several images, has the same path.
    distinct = {path.tobytes(): path for path in paths if _is_shown(path)}
    found: list[FloatArray] = []
    for path in _with_jumps(list(distinct.values())):
        is_fixed = np.isfinite(path[:, 0]).sum() >= NEARLY_ALL * len(path)
        if is_fixed and not any(_are_same(path, other) for other in found):
            found.append(path)
    return np.stack(found, axis=1) if found else np.zeros((len(lights), 0, 2))


@dataclass(frozen=True, eq=False)
class _Stay:
    """A light in one place, from an image to another, (N, 2)."""

    path: FloatArray
    place: FloatArray
    first: int
    last: int
    is_lasting: bool  # shown by nearly all images of that time


def _with_jumps(paths: Sequence[FloatArray]) -> list[FloatArray]:
    """Return paths, each continued by where its lamp jumps to."""
    stays = list(map(_stay, paths))
    steps = {
        (a, b): other.place - one.place
        for a, one in enumerate(stays)
        for b, other in enumerate(stays)
        if _may_jump(one, other)
    }
    nexts_of: defaultdict[int, list[int]] = defaultdict(list)
    for a, b in steps:
        nexts_of[a].append(b)
    lights = np.array([a for a, _ in steps], int)
    every = np.array(list(steps.values())).reshape(-1, 2)

    @cache
    def agreeing(a: int, b: int) -> int:
        """Return the number of lamps that moved by this step."""
        is_near = np.linalg.norm(every - steps[a, b], axis=1) <= STAYS
        return len(np.unique(lights[is_near]))

    gone_on = []
    for a in range(len(stays)):
        path, at, n_places = stays[a].path, a, 1
        while nexts := nexts_of[at]:
            here = at
            at = min(
                nexts,
                key=lambda b: (
                    -agreeing(here, b),
                    float(np.linalg.norm(steps[here, b])),
                ),
            )
            path = np.where(np.isfinite(path), path, stays[at].path)
            n_places += 1
        gone_on.append(path if n_places <= MAX_PLACES else stays[a].path)
    return gone_on


def _stay(path: FloatArray) -> _Stay:
    (shown,) = np.isfinite(path[:, 0]).nonzero()
    place = np.median(path[shown], axis=0)
    first, last = int(shown[0]), int(shown[-1])
    n_images = last - first + 1
    is_lasting = n_images >= BRIEFEST and len(shown) >= NEARLY_ALL * n_images
    return _Stay(path, place, first, last, is_lasting)


def _may_jump(one: _Stay, other: _Stay) -> bool:
    """Return whether a light may have jumped from one place to the other."""
    between = other.first - one.last - 1
    if not 0 <= between <= BETWEEN * len(one.path):
        return False
    if not (one.is_lasting and other.is_lasting):
        return False
    return bool(np.linalg.norm(other.place - one.place) <= FARTHEST)


def _is_shown(path: FloatArray) -> bool:
    """Return whether any image shows a light."""
    return bool(np.isfinite(path[:, 0]).any())


def other_lights(detection: PenDetection) -> FloatArray:
    """Return the centres of clean spots that are no LEDs, (S, 2), px."""
    spots, labels = detection.spots, detection.labels
    if spots is None or labels is None:
        return np.zeros((0, 2))
    clean = _are_clean(spots)
    clean[labels.spot[labels.spot >= 0]] = False
    return np.asarray(spots.centers[clean])


def _are_same(path: FloatArray, other: FloatArray) -> bool:
    """Return whether two lamps, each in nearly all images, are one."""
    apart = np.linalg.norm(path - other, axis=1)
    return bool(np.isfinite(apart).any() and np.nanmedian(apart) <= STAYS)


def _are_clean(spots: Spots) -> BoolArray:
    return np.asarray((spots.flaws & ~SpotFlaw.SATURATED) == 0)


def _path(padded: FloatArray, place: FloatArray) -> FloatArray:
    """Return the spot of each image that is nearest to a place, if it is near."""
    distances = np.linalg.norm(padded - place, axis=2)
    distances = np.where(np.isfinite(distances), distances, np.inf)
    nearest = distances.argmin(axis=1)
    path: FloatArray = padded[np.arange(len(padded)), nearest]
    path[distances.min(axis=1) > STAYS] = np.nan
    return path
