"""Inspection of live images: exposure, focus and stray light."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from lightpen.arrays import FloatArray, IntArray
from lightpen.detection.labelling.labels import Labels
from lightpen.detection.spots import SATURATED_LEVEL, SpotFlaw, Spots

DARK_PEAK = 0.25  # of the full range; below, noise is avoidably large
SHARP_EDGE = 3.5  # px from dark to bright; a sharp lens and 20 ms of stillness give 2
STRAY_MARGIN = 1.5  # times the radius of a stray spot that is masked
SEARCHED_IMAGES = 10
STRAY_SHARE = 0.5  # of the images; mains light flickers, noise is seen in one only
SAME_SPOT = 2.0  # px between the centres of a spot in two images, at least


@dataclass(frozen=True)
class Exposure:
    """Brightness of the LEDs of an image."""

    # Peak of each LED as a fraction of full scale; 1 if saturated.
    peaks: tuple[float, ...] = ()
    are_leds: bool = True  # false if no LED was identified: peaks of all spots
    # Numbers of the LEDs, from 1; empty if none was identified.
    leds: tuple[int, ...] = ()

    @property
    def dark_leds(self) -> tuple[int, ...]:
        """Numbers of the LEDs below `DARK_PEAK`."""
        return tuple(led for led, peak in self._led_peaks() if peak < DARK_PEAK)

    @property
    def saturated_leds(self) -> tuple[int, ...]:
        """Numbers of the LEDs that reach the full scale."""
        return tuple(led for led, peak in self._led_peaks() if peak >= SATURATED_LEVEL)

    def _led_peaks(self) -> Iterator[tuple[int, float]]:
        return zip(self.leds, self.peaks, strict=False)

    @property
    def n_dark(self) -> int:
        """LEDs below `DARK_PEAK`."""
        return sum(peak < DARK_PEAK for peak in self.peaks)

    @property
    def n_saturated(self) -> int:
        """LEDs that reach the full scale."""
        return sum(peak >= SATURATED_LEVEL for peak in self.peaks)

    @property
    def n_good(self) -> int:
        """LEDs that are neither dark nor saturated."""
        return len(self.peaks) - self.n_dark - self.n_saturated


@dataclass(frozen=True, eq=False)
class Inspection:
    """Exposure and focus of one image."""

    exposure: Exposure  # exposure of the LEDs, or of all spots if no LED is labelled
    # Median width of their rims from dark to bright, px; NaN without any.
    edge_width: float
    chosen: IntArray  # (N,), which of the spots these are


def is_sharp(edge_width: float) -> bool:
    """Return whether rims of this width, px, are as sharp as good centres need."""
    return edge_width <= SHARP_EDGE


def inspect(spots: Spots, labels: Labels | None = None) -> Inspection:
    """Inspect the LEDs of an image, or all its spots where none are labelled."""
    are_leds = labels is not None and bool((labels.spot >= 0).any())
    chosen: IntArray = np.arange(len(spots))
    leds: tuple[int, ...] = ()
    if labels is not None and are_leds:
        chosen = labels.spot[labels.spot >= 0]
        leds = tuple((np.flatnonzero(labels.spot >= 0) + 1).tolist())
    clipped = (spots.flaws[chosen] & SpotFlaw.SATURATED) > 0
    peaks = np.where(clipped, 1.0, spots.contrasts[chosen])
    widths = spots.edge_widths[chosen]
    return Inspection(
        exposure=Exposure(tuple(peaks.tolist()), are_leds, leds),
        edge_width=float(np.median(widths)) if len(widths) else float("nan"),
        chosen=chosen,
    )


def stray_light(spots: Spots) -> FloatArray:
    """Return circles that cover the spots of an image of the covered pen, (M, 3), px.

    They are centre x, y and radius: the ``mask`` of
    `lightpen.detection.spots.detect_spots`.
    """
    radii = 2 * np.sqrt(np.linalg.eigvalsh(spots.shapes)[:, -1])
    return np.column_stack([spots.centers, STRAY_MARGIN * radii + spots.edge_widths])


def lasting_light(images: Sequence[Spots]) -> FloatArray:
    """Return circles (M, 3) that cover spots seen in at least half of the images.

    The images show no LED. Circles are as of `stray_light`; each covers its spot in all
    of the images.
    """
    circles = np.concatenate([np.zeros((0, 3)), *map(stray_light, images)])
    of_image = np.repeat(np.arange(len(images)), [len(spots) for spots in images])
    left = np.ones(len(circles), dtype=bool)
    found = []
    for i, (x, y, radius) in enumerate(circles):
        if not left[i]:
            continue
        distances = np.hypot(circles[:, 0] - x, circles[:, 1] - y)
        same = left & (distances <= max(radius / STRAY_MARGIN, SAME_SPOT))
        left &= ~same
        if len(np.unique(of_image[same])) >= max(STRAY_SHARE * len(images), 1):
            found.append(_hull(circles[same]))
    return np.array(found).reshape(-1, 3)


@dataclass(frozen=True, eq=False)
class StraySearch:
    """A search for stray light, image by image, while the pen is covered."""

    images: tuple[Spots, ...] = ()  # bright spots in the images so far
    n_with_pen: int = 0  # images among these that show the pen

    @property
    def is_over(self) -> bool:
        """Whether enough images were searched."""
        return len(self.images) >= SEARCHED_IMAGES

    @property
    def shows_pen(self) -> bool:
        """Whether the pen is not covered, so that its LEDs are among the spots."""
        return self.n_with_pen >= max(STRAY_SHARE * len(self.images), 1)

    @property
    def is_dark(self) -> bool:
        """Whether most images show neither a bright nor a moving spot."""
        n_lit = sum(len(spots) > 0 for spots in self.images)
        return n_lit < max(STRAY_SHARE * len(self.images), 1)

    def after(self, spots: Spots, *, shows_pen: bool) -> Self:
        """Return the search after another image."""
        return replace(
            self, images=(*self.images, spots), n_with_pen=self.n_with_pen + shows_pen
        )

    def circles(self) -> FloatArray:
        """Return circles to mask, (M, 3), see `lasting_light`; none at a pen."""
        return np.zeros((0, 3)) if self.shows_pen else lasting_light(self.images)


def _hull(circles: FloatArray) -> FloatArray:
    """Return a circle about the mean centre that holds all of these."""
    center = circles[:, :2].mean(axis=0)
    offsets = np.linalg.norm(circles[:, :2] - center, axis=1)
    return np.append(center, (offsets + circles[:, 2]).max())


def with_circle(mask: FloatArray, circle: FloatArray) -> FloatArray:
    """Return a mask (M, 3) with a circle x, y, radius more, px."""
    return np.concatenate([mask, np.reshape(circle, (1, 3))])


def clicked(mask: FloatArray, spots: Spots, point: FloatArray) -> FloatArray:
    """Return a mask after a click on the image.

    A click into circles removes them, one on or beside a spot adds a circle, any other
    changes nothing.

    Parameters
    ----------
    mask : (M, 3) array
        x, y and radius, px.
    spots : Spots
        Bright spots that are not masked.
    point : (2,) array
        Position of the click, px.
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
    return np.asarray(np.linalg.norm(circles[:, :2] - point, axis=1))
