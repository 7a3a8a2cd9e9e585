"""Tracks of unlabelled spots from image to image.

Spots are predicted to continue as they went, then as the affine map of the spots that
are certain moves them, which leaves little of a hand's tremor, and assigned to the
predictions [1]_. Where two spots could be taken for each other, or a spot is lost, its
piece ends; pieces are joined by the shape of the pen once that is found, never by
guessing.

References
----------
.. [1] H. W. Kuhn, "The Hungarian method for the assignment problem", Naval Research
   Logistics Quarterly 2 (1955) 83-97.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from lightpen.arrays import BoolArray, FloatArray, Image, IntArray
from lightpen.detection.reasons import UNFORESEEN
from lightpen.detection.spots import SpotFlaw, Spots, detect_spots
from lightpen.errors import FileError
from lightpen.formats.images import ImageSource, look_at_all

REACH = 0.06  # of the image width: largest change from the previous step
NEAR = 0.006  # of the image width: farthest from the prediction by the others
COASTING = 8  # images in which a spot may be missing
USUAL = 0.75  # of the spots, found at their predicted places
CONFUSED = 6.0  # times the usual error of a prediction, within which spots are alike
FINEST = 0.7  # px, of that error
STILL, MOVED = 3.0, 12.0  # px: a lamp, and spots that move
LASTING = 15  # images, after which that is reported
AFFINE = 4  # spots that fix an affine map, and check it


@dataclass(frozen=True, eq=False)
class Pieces:
    """Spots of N images by the piece of a track that they belong to."""

    pixels: FloatArray  # (N, P, 2), px; NaN where a piece has no spot
    spots: IntArray  # (N, P), number of the spot in its image; -1 where there is none

    @property
    def lengths(self) -> IntArray:
        """Images of each piece, (P,)."""
        return np.asarray((self.spots >= 0).sum(axis=0))


def padded(spots: Sequence[FloatArray]) -> FloatArray:
    """Return the spots of N images, each (S, 2), as one array (N, S, 2); NaN beyond."""
    most = max(map(len, spots), default=0)
    array = np.full((len(spots), most, 2), np.nan)
    for row, each in zip(array, spots, strict=True):
        row[: len(each)] = each
    return array


def follow(spots: Sequence[FloatArray], width: int) -> tuple[Pieces, Pieces]:
    """Follow spots (S, 2), px, in any order, from image to image of some width, px.

    Returns
    -------
    certain : Pieces
        As far as no spot could be taken for another.
    joined : Pieces
        Also where they may be confused, if both ways of time agree.
    """
    n = len(spots)
    forward = _links(spots, width)
    backward = {link[:4] for link in _links(spots[::-1], width)}
    agreed = [link for link in forward if _turned(link[:4], n) in backward]
    return (
        _pieces_of(spots, [link[:4] for link in agreed if link[4]]),
        _pieces_of(spots, [link[:4] for link in agreed]),
    )


def _turned(link: "Link", n: int) -> "Link":
    """Return a link with time reversed."""
    i, j, a, b = link
    return n - 1 - j, n - 1 - i, b, a


Link: TypeAlias = tuple[int, int, int, int]  # from image i to j, from spot a to b


def _links(
    spots: Sequence[FloatArray], width: int
) -> list[tuple[int, int, int, int, bool]]:
    """Return links between spots: `Link`, and whether it is certain."""
    nothing = np.zeros((0, 2))
    tracks = _Tracks(nothing, nothing, *np.zeros((3, 0), int))
    links = []
    for j, each in enumerate(spots):
        there, match, is_certain = _matched(tracks.last, tracks.step, each, width)
        for t in np.flatnonzero(match >= 0):
            i, a = int(tracks.image[t]), int(tracks.spot[t])
            links.append((i, j, a, int(match[t]), bool(is_certain[t])))
        tracks = tracks.advanced(there, match, each, j)
    return links


def _pieces_of(spots: Sequence[FloatArray], links: Sequence[Link]) -> Pieces:
    """Return the pieces that links make."""
    starts = np.cumsum([0, *map(len, spots)])
    piece = np.arange(starts[-1])
    for i, j, a, b in links:  # in the order of j
        piece[starts[j] + b] = piece[starts[i] + a]
    roots, piece = np.unique(piece, return_inverse=True)
    pixels = np.full((len(spots), len(roots), 2), np.nan)
    numbers = np.full((len(spots), len(roots)), -1)
    for i, each in enumerate(spots):
        own = piece[starts[i] : starts[i + 1]]
        pixels[i, own] = each
        numbers[i, own] = np.arange(len(each))
    return Pieces(pixels, numbers)


def find_lamps(pieces: Pieces) -> FloatArray:
    """Return the positions of lamps that stay while most spots move, (K, 2), px."""
    pixels = pieces.pixels
    moving = _range(pixels)
    lamps: list[FloatArray] = []
    for p in np.flatnonzero(pieces.lengths >= LASTING):
        own = pieces.spots[:, p] >= 0
        if moving[p] > STILL:
            continue
        others = _range(pixels[own])
        others = others[np.isfinite(others)]
        others = others[others > 0]
        if np.median(others) > MOVED:
            place = np.nanmedian(pixels[own, p], axis=0)
            if all(np.linalg.norm(place - other) > STILL for other in lamps):
                lamps.append(place)
    return np.array(lamps).reshape(-1, 2)


def without_lamps(
    spots: Sequence[FloatArray], lamps: FloatArray
) -> tuple[tuple[FloatArray, ...], tuple[IntArray, ...]]:
    """Return the spots that are not at places of lamps (K, 2), and their numbers."""
    numbers = []
    for each in spots:
        apart = np.linalg.norm(each[:, None] - lamps, axis=2)
        numbers.append(np.flatnonzero((apart > STILL).all(axis=1)))
    kept = tuple(each[own] for each, own in zip(spots, numbers, strict=True))
    return kept, tuple(numbers)


@dataclass(frozen=True, eq=False)
class _Tracks:
    """Open tracks: their last or predicted positions, and their last spot."""

    last: FloatArray
    step: FloatArray
    missed: IntArray
    image: IntArray
    spot: IntArray

    def advanced(
        self, there: FloatArray, match: IntArray, spots: FloatArray, image: int
    ) -> "_Tracks":
        """Return the tracks after an image; a lost one follows its prediction.

        Where most spots are new the pen has jumped, and all tracks begin anew: the few
        that found a spot have the wrong one, and would mislead those after it.
        """
        found = match >= 0
        has_jumped = bool(2 * found.sum() < len(spots))
        found &= not has_jumped
        at = match[found]
        step = np.zeros_like(spots)
        step[at] = spots[at] - self.last[found]
        is_new = np.ones(len(spots), bool)
        is_new[at] = False
        if len(at):  # a new spot is taken to go as those about it
            step[is_new] = np.median(step[at], axis=0)
        waiting = ~found & (self.missed < COASTING) & (not has_jumped)
        n = len(spots)
        return _Tracks(
            np.concatenate([spots, there[waiting]]),
            np.concatenate([step, (there - self.last)[waiting]]),
            np.concatenate([np.zeros(n, int), self.missed[waiting] + 1]),
            np.concatenate([np.full(n, image), self.image[waiting]]),
            np.concatenate([np.arange(n), self.spot[waiting]]),
        )


def _matched(
    last: FloatArray, step: FloatArray, spots: FloatArray, width: int
) -> tuple[FloatArray, IntArray, BoolArray]:
    """Return where tracks are predicted, their spots, and whether these are certain.

    A track without a spot has -1.
    """
    predicted = last + step
    n_tracks = len(predicted)
    match, is_certain = np.full(n_tracks, -1), np.zeros(n_tracks, bool)
    if not n_tracks or not len(spots):
        return predicted, match, is_certain
    near = NEAR * width
    there = predicted
    match = assign(there, spots, near)
    if (match >= 0).sum() < USUAL * min(n_tracks, len(spots)):
        there = predicted + _common_shift(predicted, spots, REACH * width, near)
        match = assign(there, spots, 2 * near)
    for _ in range(2):
        there = _moved(predicted, there, spots, match)
        match = assign(there, spots, near)
    found = match >= 0
    if not found.any():
        return there, match, is_certain
    errors = np.linalg.norm(there[found] - spots[match[found]], axis=1)
    limit = CONFUSED * max(float(np.median(errors)), FINEST)
    apart = np.linalg.norm(there[:, None] - spots, axis=2)
    apart[found, match[found]] = np.inf
    rivals = np.linalg.norm(there[:, None] - there, axis=2)
    np.fill_diagonal(rivals, np.inf)
    own = np.full(n_tracks, np.inf)
    own[found] = errors
    is_certain = (own < limit) & (apart.min(axis=1) > limit)
    is_certain &= rivals.min(axis=1) > limit
    return there, match, is_certain


def assign(predicted: FloatArray, spots: FloatArray, threshold: float) -> IntArray:
    """Return the spot of each prediction (T, 2) among spots (S, 2); -1 without one.

    The sum of distances is least; none exceeds the threshold, px.
    """
    from scipy.optimize import linear_sum_assignment  # takes 0.2 s

    match = np.full(len(predicted), -1)
    cost = np.linalg.norm(predicted[:, None] - spots, axis=2)
    rows, columns = linear_sum_assignment(np.minimum(cost, threshold))
    is_near = cost[rows, columns] < threshold
    match[rows[is_near]] = columns[is_near]
    return match


def _common_shift(
    predicted: FloatArray, spots: FloatArray, reach: float, near: float
) -> FloatArray:
    """Return the shift, (2,), px, that brings most predictions near spots."""
    shifts = (spots - predicted[:, None]).reshape(-1, 2)
    shifts = shifts[np.linalg.norm(shifts, axis=1) < reach]
    if not len(shifts):
        return np.zeros(2)
    shifted = predicted + shifts[:, None]
    apart = np.linalg.norm(shifted[:, :, None] - spots, axis=3).min(axis=2)
    cost = np.minimum(apart, near).mean(axis=1)
    cost += 0.1 * near * np.linalg.norm(shifts, axis=1) / reach
    return np.asarray(shifts[np.argmin(cost)])


def _moved(
    predicted: FloatArray, there: FloatArray, spots: FloatArray, match: IntArray
) -> FloatArray:
    """Return the predictions moved by the shift or affine map of those with a spot."""
    found = match >= 0
    n = int(found.sum())
    if n == 0:
        return there
    x, y = predicted[found], spots[match[found]]
    if n <= AFFINE:
        return np.asarray(predicted + np.median(y - x, axis=0))
    center = x.mean(axis=0)
    scale = max(float(np.ptp(x)), 1.0)
    A = np.column_stack([(x - center) / scale, np.ones(n)])
    moves, weight = y - x, np.ones(n)
    for _ in range(4):
        ridge = 1e-3 * weight.sum() * np.diag([1.0, 1.0, 0.0])
        normal = A.T @ (weight[:, None] * A) + ridge
        fit = np.linalg.solve(normal, A.T @ (weight[:, None] * moves))
        errors = np.linalg.norm(moves - A @ fit, axis=1)
        width = max(2 * float(np.median(errors)), FINEST)
        weight = 1 / (1 + (errors / width) ** 2)
    every = np.column_stack([(predicted - center) / scale, np.ones(len(predicted))])
    return np.asarray(predicted + every @ fit)


def _range(pixels: FloatArray) -> FloatArray:
    """Return the extent of pieces, (P,), px; NaN without a spot."""
    known = np.isfinite(pixels[..., 0]).any(axis=0)
    ranges = np.full(pixels.shape[1], np.nan)
    low = np.where(np.isfinite(pixels), pixels, np.inf).min(axis=0)
    high = np.where(np.isfinite(pixels), pixels, -np.inf).max(axis=0)
    ranges[known] = np.linalg.norm((high - low)[known], axis=1)
    return ranges


SEARCH_MEMORY_A_PIXEL = 5  # bytes, as of `lightpen.detection.observations`
UNFIT = SpotFlaw.MERGED | SpotFlaw.CUT | SpotFlaw.BLURRED
LEAST_EXTENT = 0.02  # of the image's longer side, by all centres; less are not in px

Report = Callable[[float], None]


@dataclass(frozen=True, eq=False)
class Sightings:
    """Unlabelled spots of N images in time order."""

    names: tuple[str, ...]  # file or frame, one an image
    centers: tuple[FloatArray, ...]  # (S, 2) each, px; centroids if there are shapes
    size: tuple[int, int]  # width and height of the images, px
    # (S, 2, 2) each, covariances of the areas, px^2; None if only centres are given
    shapes: tuple[FloatArray, ...] | None = None
    areas: tuple[FloatArray, ...] | None = None  # (S,) each, px^2; NaN if saturated
    edge_widths: FloatArray | None = None  # (N,), mean of each image, px

    def __len__(self) -> int:
        return len(self.names)


def sightings_of_centers(
    frames: tuple[str, ...], centers: tuple[FloatArray, ...], size: tuple[int, int]
) -> Sightings:
    """Return the sightings of centres that were found elsewhere.

    Raises `FileError` if most are outside an image of this size, or close together.
    """
    every = np.concatenate([np.zeros((0, 2)), *centers])
    outside = np.any((every < -0.5) | (every > size), axis=1)
    if 2 * outside.sum() > len(every):
        x, y = every.max(axis=0)
        raise FileError(
            "discover.centers-outside", x=x, y=y, width=size[0], height=size[1]
        )
    extent = np.ptp(every, axis=0).max() if len(every) else np.inf
    if extent < LEAST_EXTENT * max(size):
        raise FileError(
            "discover.centers-small", extent=extent, width=size[0], height=size[1]
        )
    return Sightings(frames, centers, size)


def find_spots(
    source: ImageSource, report: Report = lambda fraction: None
) -> Sightings:
    """Find the spots in images that are whole and sharp.

    Raises `FileError` if no image can be read.
    """
    found: list[tuple[Spots, tuple[int, int] | None]] = []
    fault: FileError | None = None

    def search(load: Callable[[], Image]) -> tuple[Spots, tuple[int, int] | FileError]:
        try:
            image = load()
        except FileError as error:
            return Spots.none(), error
        size = (image.shape[1], image.shape[0])
        try:
            return detect_spots(image, full_scale=source.full_scale), size
        except UNFORESEEN:
            return Spots.none(), size

    n_images = len(source.names)
    for spots, seen in look_at_all(source, search, SEARCH_MEMORY_A_PIXEL):
        if isinstance(seen, FileError):
            fault = seen
        found.append((spots, None if isinstance(seen, FileError) else seen))
        report(len(found) / n_images)
    sizes = [size for _, size in found if size is not None]
    if not sizes:
        assert fault is not None
        raise FileError("images.none-readable", n_images=n_images, why=fault.message)
    size = max(set(sizes), key=sizes.count)
    return sightings_of_spots(
        source.names, [s if own == size else Spots.none() for s, own in found], size
    )


def sightings_of_spots(
    names: tuple[str, ...], every: Sequence[Spots], size: tuple[int, int]
) -> Sightings:
    """Return the sightings of spots; of each image those that are whole and sharp."""
    good = [np.flatnonzero((spots.flaws & UNFIT) == 0) for spots in every]
    pairs = list(zip(every, good, strict=True))
    widths = [
        float(spots.edge_widths[chosen].mean()) if len(chosen) else np.nan
        for spots, chosen in pairs
    ]
    return Sightings(
        names=names,
        centers=tuple(spots.centers[chosen] for spots, chosen in pairs),
        size=size,
        shapes=tuple(spots.shapes[chosen] for spots, chosen in pairs),
        areas=tuple(_areas(spots)[chosen] for spots, chosen in pairs),
        edge_widths=np.array(widths),
    )


def _areas(spots: Spots) -> FloatArray:
    is_saturated = (spots.flaws & SpotFlaw.SATURATED) != 0
    return np.where(is_saturated, np.nan, spots.areas)
