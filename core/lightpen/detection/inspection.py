"""Inspection of live images: exposure, focus and stray light."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from math import inf, log10, sqrt
from typing import Self

import numpy as np

from lightpen.arrays import FloatArray, IntArray
from lightpen.cameras.protocol import CameraCapabilities, CameraSettings, Frame, Range
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


# The fastest guided swing, 30 degrees a second, then smears an LED by some 1.5 px.
LONGEST_EXPOSURE_US = 5000.0


class Advice(StrEnum):
    """The next step towards a good exposure, the one that costs least first."""

    SHOW_PEN = "show pen"
    LEAVE = "leave"
    LOWER_GAIN = "lower gain"
    SHORTEN_EXPOSURE = "shorten exposure"
    CLOSE_APERTURE = "close aperture"
    LENGTHEN_EXPOSURE = "lengthen exposure"
    RAISE_GAIN = "raise gain"
    OPEN_APERTURE = "open aperture"
    EVEN_OUT = "even out"


def advise(
    exposure: Exposure, settings: CameraSettings, caps: CameraCapabilities | None
) -> Advice:
    """Return the advice for the brightness of the LEDs; no caps: nothing can be set."""
    if not exposure.peaks:
        return Advice.SHOW_PEN
    if exposure.n_saturated and exposure.n_dark:
        return Advice.EVEN_OUT
    exposures = None if caps is None else caps.exposure_us
    gains = None if caps is None else caps.gain_db
    if exposure.n_saturated:
        if _is_above_low(settings.gain_db, gains):
            return Advice.LOWER_GAIN
        if _is_above_low(settings.exposure_us, exposures):
            return Advice.SHORTEN_EXPOSURE
        return Advice.CLOSE_APERTURE
    if exposure.n_dark:
        if _is_below(settings.exposure_us, exposures, LONGEST_EXPOSURE_US):
            return Advice.LENGTHEN_EXPOSURE
        if _is_below(settings.gain_db, gains):
            return Advice.RAISE_GAIN
        return Advice.OPEN_APERTURE
    return Advice.LEAVE


def _is_above_low(value: float | None, offered: Range | None) -> bool:
    return value is not None and offered is not None and value > offered.low


def _is_below(
    value: float | None, offered: Range | None, limit: float = float("inf")
) -> bool:
    return (
        value is not None and offered is not None and value < min(offered.high, limit)
    )


# Auto exposure: the brightest LED is bright, and none is saturated.
#
# The light of an LED is proportional to exposure and gain, so one image shows the next
# setting; only of a saturated LED it is not known by how much it is too bright. Gain
# adds noise, so it is raised only where a longer exposure would smear the moving pen.


TARGET = 0.8  # of the full scale
TOLERANCE = 0.03
SATURATED_STEP = 0.4  # times the light of an image with a saturated LED
LARGEST_STEP = 8.0  # dim light is mostly noise and background
BELOW_SATURATION = 0.9  # times the least light that saturated
MAX_STEPS = 15
MAX_BLIND = 40  # images without LEDs in succession: two seconds


class ExposureState(StrEnum):
    """State of an adjustment of the exposure."""

    ADJUSTING = "adjusting"
    DONE = "done"
    NO_LEDS = "no LEDs"
    TOO_BRIGHT = "too bright"  # at the shortest exposure and the least gain
    TOO_DARK = "too dark"  # at the longest useful exposure and full gain
    UNSTEADY = "unsteady"  # the light changes from image to image


@dataclass(frozen=True)
class AutoExposure:
    """An adjustment of exposure and gain, image by image."""

    # Exposure and gain to be set; images taken with others are passed over.
    asked: CameraSettings
    outcome: ExposureState = ExposureState.ADJUSTING
    level: float = 0.0  # brightest LED of the last image, as a fraction of full scale
    # Least light (exposure in us, times gain) that saturated an LED so far.
    saturating: float = inf
    n_steps: int = 0
    n_blind: int = 0

    @classmethod
    def begun(cls, settings: CameraSettings) -> Self:
        """Return an adjustment that begins with the current settings."""
        return cls(
            CameraSettings(exposure_us=settings.exposure_us, gain_db=settings.gain_db)
        )

    def after(
        self, frame: Frame, spots: Spots, leds: Inspection, caps: CameraCapabilities
    ) -> Self:
        """Return the adjustment after another image, which was inspected."""
        if self.outcome is not ExposureState.ADJUSTING or not self._is_of_asked(frame):
            return self
        if len(leds.chosen) == 0:
            n_blind = self.n_blind + 1
            outcome = ExposureState.NO_LEDS if n_blind >= MAX_BLIND else self.outcome
            return replace(self, n_blind=n_blind, outcome=outcome)
        level = brightest_level(frame, spots, leds.chosen)
        light = (self.asked.exposure_us or 0.0) * _gain(self.asked.gain_db)
        seen = replace(self, level=level, n_blind=0, n_steps=self.n_steps + 1)
        if leds.exposure.n_saturated:
            seen = replace(seen, saturating=min(self.saturating, light))
            return seen._ask(light * SATURATED_STEP, caps, ExposureState.TOO_BRIGHT)
        wanted = min(
            light * min(TARGET / max(level, TARGET / LARGEST_STEP), LARGEST_STEP),
            BELOW_SATURATION * self.saturating,
        )
        if abs(wanted / light - 1) <= TOLERANCE / TARGET:
            return replace(seen, outcome=ExposureState.DONE)
        if seen.n_steps >= MAX_STEPS:
            return replace(seen, outcome=ExposureState.UNSTEADY)
        limit = ExposureState.TOO_DARK if wanted > light else ExposureState.TOO_BRIGHT
        return seen._ask(wanted, caps, limit)

    def _is_of_asked(self, frame: Frame) -> bool:
        asked = self.asked
        return (frame.exposure_us, frame.gain_db) == (asked.exposure_us, asked.gain_db)

    def _ask(
        self, light: float, caps: CameraCapabilities, limit: ExposureState
    ) -> Self:
        """Return the adjustment with settings for this light, or at its limit."""
        exposures, gains = caps.exposure_us, caps.gain_db
        now = self.asked
        if exposures is None or now.exposure_us is None:
            return replace(self, outcome=limit)
        longest = max(min(exposures.high, LONGEST_EXPOSURE_US), exposures.low)
        gain_db = now.gain_db
        if gains is not None and caps.gain_in_db:
            least = 10 ** (gains.low / 20)
            gain_db = gains.nearest(20 * log10(max(light / longest, least)))
        exposure_us = light / _gain(gain_db)
        exposure_us = exposures.nearest(min(exposure_us, longest))
        asked = CameraSettings(exposure_us=exposure_us, gain_db=gain_db)
        if asked == now:
            return replace(self, outcome=limit)
        return replace(self, asked=asked)


def brightest_level(frame: Frame, spots: Spots, chosen: IntArray) -> float:
    """Return the level of the brightest LED, as a fraction of the full scale.

    That is what the brightest tenth of its disc exceeds, so that neither noise nor a
    hot pixel counts.
    """
    image, levels = frame.image, []
    for (x, y), area in zip(spots.centers[chosen], spots.areas[chosen], strict=True):
        half = max(round(sqrt(area) / 2), 1)  # of a square of this area
        # The middle of a cut LED may be beyond the border.
        left = min(max(round(x) - half, 0), image.shape[1] - 1)
        top = min(max(round(y) - half, 0), image.shape[0] - 1)
        window = image[
            top : max(round(y) + half, 0) + 1, left : max(round(x) + half, 0) + 1
        ]
        levels.append(float(np.percentile(window, 90)))
    return max(levels) / frame.full_scale


def _gain(gain_db: float | None) -> float:
    return float(10 ** ((gain_db or 0.0) / 20))
