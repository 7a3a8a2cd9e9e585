"""Auto exposure: the brightest LED is bright, and none is saturated.

The light of an LED is proportional to exposure and gain, so one image shows the next
setting; only of a saturated LED it is not known by how much it is too bright. Gain adds
noise, so it is raised only where a longer exposure would smear the moving pen.
"""

from dataclasses import dataclass, replace
from enum import StrEnum
from math import inf, log10, sqrt
from typing import Self

import numpy as np

from lightpen.arrays import IntArray
from lightpen.cameras.protocol import CameraCapabilities, CameraSettings, Frame
from lightpen.detection.exposure_advice import LONGEST_EXPOSURE_US
from lightpen.detection.inspection import Inspection
from lightpen.detection.spots import Spots

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
