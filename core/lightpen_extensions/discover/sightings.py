"""Spots in the images of a swing, before pen and camera are known."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from lightpen.arrays import FloatArray, Image
from lightpen.detection.reasons import UNFORESEEN
from lightpen.detection.spots import SpotFlaw, Spots, detect_spots
from lightpen.errors import FileError
from lightpen.formats.images import ImageSource, look_at_all

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
