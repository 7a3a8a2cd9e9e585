"""Centres of LEDs of a few pixels, which have no plateau because of blur.

A disc less than some 20 px wide with a blur of 1.5 px is a bell, not a plateau with a
rim. Reflections on the board and bloom reach into its foot, so its outline near the
background shows neither its centre nor whether it is whole. A **windowed centroid**, in
a Gaussian window 0.45 half-level radii wide, iterated until it stays in the middle of
its window [1]_, is little disturbed by what lies beside the LED. From there a blurred
disc is fitted (`lightpen.detection.disc_fit`).

An LED whose shape differs from those of the others is partly hidden or merges with
something.

References
----------
.. [1] E. Bertin, S. Arnouts, "SExtractor: software for source extraction", Astronomy
   and Astrophysics Supplement 117 (1996) 393-404; its manual has windowed centroids.
"""

from dataclasses import dataclass
from math import ceil

import cv2
import numpy as np

from lightpen.arrays import BoolArray, FloatArray, Image, IntArray
from lightpen.detection.disc_fit import fit_discs

LARGEST_RADIUS = 12.0  # px, half-level, of a spot that is measured here
REACH = 2.5  # half-level radii, and
MORE_REACH = 4.0  # px, from the centre to the border of a window
BACKGROUND_QUANTILE = 0.1
FOOT, HEAD = 0.25, 0.75  # heights between which the area of tiny spots is counted
BELOW, ABOVE = 0.45, 0.55  # and of others, which light at their feet may join

NARROW = 0.45  # half-level radii, standard deviation
LEAST_WINDOW = 1.1  # px
ROUNDS = 10
FARTHEST = 0.5  # half-level radii, of a centre from its start, and
FAR = 0.2  # of one that is not clipped; good fits stay within 0.06

SATURATED_PEAK = 0.985  # of the full scale, mean of nine pixels

LONGEST = 4.0  # times as long as wide, of a spot
NEAR = 0.5  # radii, of a place that may be brighter than the middle of a region
LARGER = 1.5  # times the usual radius of the spots that are measured together
BRIGHTER = 1.05  # than the middle, of a place that is the LED's rather
TINY_RADIUS = 4.0  # px, half-level, of an LED whose light shows more than its shape
BOX = 1.5  # half-level radii, to the rim of a box whose mean is the background
FAINT = 0.1  # of the height, below which light does not count
RING = (2.0, 2.5)  # half-level radii, round a spot
LIT_SHARE = 0.1  # of a ring, and
DARK = 0.08  # of the light, round a spot that is alone
MIN_WIDTH = 4.0  # px, at half level; less shows no centre
LEAST_TINY = 1.2  # px; smaller ones are hot pixels
LARGEST_TINY = 12  # px, of the box at the foot
MAX_TINY = 4000  # contours examined


@dataclass(frozen=True, eq=False)
class SmallSpots:
    """LEDs of a few pixels."""

    centers: FloatArray  # (N, 2), px
    shapes: FloatArray  # (N, 2, 2), covariance of the area at half level, px^2
    radii: FloatArray  # (N,), at half level, px
    peaks: FloatArray  # (N,), above the local background, digital numbers
    sigmas: FloatArray  # (N,), standard deviation of one coordinate of each centre, px
    # (N,), standard deviation of a pixel beside the centre, digital numbers.
    noises: FloatArray
    are_whole: BoolArray  # (N,), whether the LED is neither hidden nor merged
    saturated: BoolArray  # (N,), whether the light is clipped
    # (N,), whether it is dark all round, so that the outline shows a whole LED.
    alone: BoolArray


@dataclass(frozen=True, eq=False)
class _Windows:
    """Light in square windows of side 2 r + 1 about pixels, above the background."""

    light: FloatArray  # (N, S, S)
    middles: IntArray  # (N, 2)
    radii: FloatArray  # (N,), half-level
    tops: FloatArray  # (N,), of the light
    peaks: FloatArray  # (N,), the same with the background, digital numbers

    @property
    def places(self) -> FloatArray:
        """Pixels from the middle, (S,)."""
        half = self.light.shape[1] // 2
        return np.arange(-half, half + 1.0)


def measure_small(
    image: Image, centers: FloatArray, radii: FloatArray, full_scale: float
) -> SmallSpots:
    """Measure spots of a few pixels.

    Parameters
    ----------
    image : (H, W) array
        Grey image, 8 or 16 bit.
    centers : (N, 2) array
        To within 2 px, px.
    radii : (N,) array
        Rough half-level radii, px.
    full_scale : float
        Brightest value a pixel can have.
    """
    radii = np.minimum(radii, LARGER * np.median(radii))
    windows = _windows(image, _brightest(image, centers, radii), radii)
    saturated = windows.peaks >= SATURATED_PEAK * full_scale
    narrow = _windowed(windows, np.zeros_like(centers))
    clipped = SATURATED_PEAK * full_scale - (windows.peaks - windows.tops)
    fits = fit_discs(windows.light, narrow, windows.radii, clipped)
    gaps = np.linalg.norm(fits.centers - narrow, axis=1)
    is_near = gaps < np.where(saturated, FARTHEST, FAR) * windows.radii
    found = np.where(is_near[:, None], fits.centers, narrow)
    moves = _towards_light(windows, found, float(np.median(fits.misfits)))
    moves[~is_near | saturated | (windows.radii > TINY_RADIUS)] = 0.0
    squares = (fits.sigmas**2 + np.median(fits.sigmas) ** 2) / 2
    sigmas = np.sqrt(squares + np.mean(moves**2))
    sigmas = np.where(is_near, sigmas, windows.radii)
    return SmallSpots(
        centers=np.asarray(windows.middles + found + moves),
        shapes=_shapes(windows, narrow),
        radii=windows.radii,
        peaks=windows.tops,
        sigmas=sigmas,
        noises=fits.noises,
        are_whole=is_near & (~fits.are_outliers),
        saturated=saturated,
        alone=_are_alone(windows, narrow),
    )


def widths_of_tiny(image: Image, level: float, background: float) -> list[float]:
    """Return the widths of spots too small for a centre, px.

    They exceed ``level`` and the background does not, digital numbers.
    """
    bright = (image > level).view(np.uint8)
    contours, _ = cv2.findContours(bright, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
    widths = []
    for contour in contours[:MAX_TINY]:
        x, y, width, height = cv2.boundingRect(contour)
        if max(width, height) > LARGEST_TINY:
            continue
        light = image[y : y + height, x : x + width] - background
        soft = np.clip((light / light.max() - FOOT) / (HEAD - FOOT), 0, 1)
        widths.append(2 * np.sqrt(soft.sum() / np.pi))
    # One pixel is a hot one.
    return [width for width in widths if LEAST_TINY < width < MIN_WIDTH]


def _brightest(image: Image, centers: FloatArray, radii: FloatArray) -> FloatArray:
    """Return the brightest places near centres that are not bright themselves."""
    half = round(NEAR * float(np.median(radii)))
    _, _, light = _cut_out(image, centers, half)
    places = np.arange(-half, half + 1)
    smooth = np.stack([cv2.GaussianBlur(each, (0, 0), LEAST_WINDOW) for each in light])
    flat = smooth.reshape(len(smooth), -1)
    row, column = np.divmod(flat.argmax(axis=1), 2 * half + 1)
    there = np.rint(centers) + np.stack([places[column], places[row]], axis=-1)
    is_brighter = flat.max(axis=1) > BRIGHTER * smooth[:, half, half]
    return np.where(is_brighter[:, None], there, centers)


def _cut_out(
    image: Image, centers: FloatArray, half: int
) -> tuple[IntArray, IntArray, FloatArray]:
    middles = np.rint(centers).astype(np.int64)
    places = np.arange(-half, half + 1)
    rows = np.clip(middles[:, 1, None] + places, 0, image.shape[0] - 1)
    columns = np.clip(middles[:, 0, None] + places, 0, image.shape[1] - 1)
    light = image[rows[:, :, None], columns[:, None, :]].astype(np.float64)
    return middles, places, light


def _windows(image: Image, centers: FloatArray, radii: FloatArray) -> _Windows:
    half = ceil(REACH * float(radii.max()) + MORE_REACH)
    middles, _, light = _cut_out(image, centers, half)
    flat = np.sort(light.reshape(len(light), -1), axis=1)
    background = flat[:, int(BACKGROUND_QUANTILE * flat.shape[1])]
    peaks = light[:, half - 1 : half + 2, half - 1 : half + 2].mean(axis=(1, 2))
    light -= background[:, None, None]
    tops = np.maximum(peaks - background, 1.0)
    heights = light / tops[:, None, None]
    soft = np.clip((heights - BELOW) / (ABOVE - BELOW), 0, 1)
    radii = np.sqrt(_about_the_middles(soft).sum(axis=(1, 2)) / np.pi)
    # What is larger by far has a neighbour in its half-level area.
    usual = max(float(np.median(radii)), LEAST_WINDOW)
    radii = np.clip(radii, LEAST_WINDOW, LARGER * usual)
    return _Windows(light, middles, radii, tops, peaks)


def _about_the_middles(soft: FloatArray) -> FloatArray:
    """Return soft-thresholded windows without the regions beside the middle ones."""
    half = soft.shape[1] // 2
    # A dark row between windows separates their regions.
    lit = np.pad(soft > 0, ((0, 0), (0, 1), (0, 0))).view(np.uint8)
    _, labels = cv2.connectedComponents(lit.reshape(-1, soft.shape[2]))
    regions = labels.reshape(lit.shape)[:, :-1]
    middles = regions[:, half, half, None, None]
    return np.asarray(np.where((regions == middles) & (middles > 0), soft, 0.0))


def _weights(
    windows: _Windows, at: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return places from the centres, (N, 2, S), Gaussian weights there, variances."""
    variances = np.maximum(NARROW * windows.radii, LEAST_WINDOW) ** 2
    away = windows.places - at[:, :, None]
    return away, np.exp(-0.5 * away**2 / variances[:, None, None]), variances


def _windowed(windows: _Windows, starts: FloatArray) -> FloatArray:
    """Return the centroids that lie in the middle of their Gaussian windows, (N, 2)."""
    at, farthest = starts, FARTHEST * windows.radii[:, None]
    for _ in range(ROUNDS):
        away, weights, _ = _weights(windows, at)
        over_rows = np.einsum("nyx,ny->nx", windows.light, weights[:, 1])
        over_columns = np.einsum("nyx,nx->ny", windows.light, weights[:, 0])
        weighted = np.stack([over_rows, over_columns], axis=1) * weights
        amounts = np.maximum(weighted.sum(axis=2), 1e-9)
        # For a bell as wide as its window the centroid lags by half.
        at = at + 2 * (weighted * away).sum(axis=2) / amounts
        at = np.clip(at, starts - farthest, starts + farthest)
    return at


def _towards_light(windows: _Windows, at: FloatArray, misfit: float) -> FloatArray:
    """Return the steps (N, 2) from fitted discs to the centroids of light, px.

    These are whole if the LEDs are no blurred discs at all, and nothing if they are:
    the weight is the share of the squares of residuals that noise does not make.
    """
    away = np.abs(windows.places - np.rint(at)[:, :, None])
    beside = np.maximum(away[:, 1, :, None], away[:, 0, None, :])
    edges = np.ceil(BOX * windows.radii)[:, None, None]
    rim, inside = beside == edges, beside <= edges
    n_rim = np.maximum(rim.sum(axis=(1, 2)), 1)  # none where a fit leaves its window
    background = (windows.light * rim).sum(axis=(1, 2)) / n_rim
    light = windows.light - background[:, None, None]
    least = FAINT * (windows.tops - background)
    light = np.where(inside & (light > least[:, None, None]), light, 0.0)
    along = np.stack([light.sum(axis=1), light.sum(axis=2)], axis=1)
    amounts = np.maximum(along.sum(axis=2), 1e-9)
    centroids = (along * windows.places).sum(axis=2) / amounts
    return np.asarray((1 - 1 / max(misfit, 1.0)) * (centroids - at))


def _are_alone(windows: _Windows, at: FloatArray) -> BoolArray:
    """Return whether rings about spots are dark."""
    away = windows.places - at[:, :, None]
    distances = np.hypot(away[:, 1, :, None], away[:, 0, None, :])
    distances /= windows.radii[:, None, None]
    low, high = RING
    ring = (low < distances) & (distances < high)
    lit = ring & (windows.light > DARK * windows.tops[:, None, None])
    n_ring, n_lit = ring.sum(axis=(1, 2)), lit.sum(axis=(1, 2))
    return np.asarray((n_ring > 0) & (n_lit < LIT_SHARE * n_ring))


def _shapes(windows: _Windows, at: FloatArray) -> FloatArray:
    """Return covariances of half-level areas, as long as the light is, (N, 2, 2)."""
    away, weights, variances = _weights(windows, at)
    over_rows, over_columns = weights[:, 1], weights[:, 0]
    x, y = away[:, 0], away[:, 1]
    light = windows.light
    amount = np.maximum(np.einsum("nyx,ny,nx->n", light, over_rows, over_columns), 1e-9)
    xx = np.einsum("nyx,ny,nx->n", light, over_rows, over_columns * x**2) / amount
    yy = np.einsum("nyx,ny,nx->n", light, over_rows * y**2, over_columns) / amount
    xy = np.einsum("nyx,ny,nx->n", light, over_rows * y, over_columns * x) / amount
    # A bell of covariance V in a window of variance s has 1 / (1 / V + 1 / s).
    seen = np.stack([xx, xy, xy, yy], axis=-1).reshape(-1, 2, 2)
    eye = np.eye(2)
    sharpness = np.linalg.inv(seen + 1e-3 * eye) - eye / variances[:, None, None]
    values, vectors = np.linalg.eigh(sharpness)
    values = np.maximum(values, values[:, -1:] / LONGEST**2)
    values = np.maximum(values, 1e-6)
    round_values = np.sqrt(values.prod(axis=1, keepdims=True)) / values
    scaled = round_values * (windows.radii**2 / 4)[:, None]
    return np.asarray((vectors * scaled[:, None, :]) @ np.swapaxes(vectors, 1, 2))
