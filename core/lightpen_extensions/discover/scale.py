"""Scale of the pen by known lengths, and wide priors for everything else."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.model.camera import Camera
from lightpen.model.coverage import inverse
from lightpen.model.pen import Pen
from lightpen.model.self_calibration import EXACT_SCALE
from lightpen_extensions.discover.starts import KnownLength, farthest_apart, gradient_of

WIDE = 0.02  # of the pen's size: prior of an LED coordinate
LARGEST_SCALE = 0.01  # relative, of a scale that a pen file can state apart
CONTRADICTING = 4.0  # standard deviations
SHAPE = 2e-4  # relative: more than ratios of lengths within the shape are uncertain by


@dataclass(frozen=True)
class MeasuredLength:
    """A length that was measured on the pen."""

    leds: tuple[int, int] | None  # numbers from 1; None: the two farthest apart
    length: float  # mm
    sigma: float  # standard uncertainty, mm


def known_lengths(
    measured: Sequence[MeasuredLength], leds: FloatArray
) -> tuple[KnownLength, ...]:
    """Return measured lengths by the indices of numbered LEDs (L, 3).

    Raises `CalibrationError` if an LED is unknown or given twice.
    """
    return tuple(_known(each, leds) for each in measured)


def _known(each: MeasuredLength, leds: FloatArray) -> KnownLength:
    if each.leds is None:
        return KnownLength(*farthest_apart(leds)[:2], each.length, each.sigma)
    first, second = each.leds
    for number in each.leds:
        if not 1 <= number <= len(leds):
            raise CalibrationError(
                "discover.no-such-led", number=number, n_leds=len(leds)
            )
    if first == second:
        raise CalibrationError("discover.same-led", number=first)
    return KnownLength(first - 1, second - 1, each.length, each.sigma)


def scale_by(lengths: Sequence[KnownLength], leds: FloatArray) -> float:
    """Return the factor that brings LEDs (L, 3) to the lengths, least squares.

    Raises `CalibrationError` if they contradict each other; the text shows which.
    """
    found = np.array([each.between(leds) for each in lengths])
    stated = np.array([each.length for each in lengths])
    sigmas = np.array([each.sigma for each in lengths])
    weights = found / sigmas
    factor = float((weights @ (stated / sigmas)) / (weights @ weights))
    off = factor * found - stated
    limit = CONTRADICTING * np.hypot(sigmas, SHAPE * stated)
    worst = int(np.argmax(np.abs(off) / limit))
    if abs(off[worst]) > limit[worst]:
        rest = np.arange(len(lengths)) != worst
        others = float((found[rest] @ stated[rest]) / (found[rest] @ found[rest]))
        each = lengths[worst]
        raise CalibrationError(
            "discover.lengths-contradict",
            first=each.first + 1,
            second=each.second + 1,
            stated=each.length,
            implied=others * found[worst],
        )
    return factor


def nearest_pair(leds: FloatArray, length: float) -> tuple[int, int, float]:
    """Return the numbers of the two LEDs whose distance is nearest to a length, mm."""
    one, other = np.triu_indices(len(leds), k=1)
    apart = np.linalg.norm(leds[one] - leds[other], axis=1)
    k = int(np.argmin(np.abs(apart - length)))
    return int(one[k]) + 1, int(other[k]) + 1, float(apart[k])


def with_lengths_known(pen: Pen, lengths: Sequence[KnownLength]) -> Pen:
    """Return a pen with wide priors for all but known lengths, for the adjustment.

    Its LEDs have a wide covariance, narrowed along the derivative of each length to the
    variance of that length. The lengths hold during the swing, so the pen does not
    expand.
    """
    size = float(np.ptp(pen.leds, axis=0).max())
    information = np.eye(pen.leds.size) / (WIDE * size) ** 2
    for each in lengths:
        row = gradient_of(pen.leds, each)
        information += np.outer(row, row) / each.sigma**2
    return replace(
        pen,
        led_covariance=inverse(information),
        scale_sigma=EXACT_SCALE,
        expansion=0.0,
        expansion_sigma=None,
        temperature_c=None,
    )


def with_led_covariance(pen: Pen, covariance: FloatArray) -> Pen:
    """Return a pen with a covariance of its LEDs (3 L, 3 L), the scale stated apart.

    Images fit a pen of any size, so the longest distance defines the scale.
    """
    first, second, _ = farthest_apart(pen.leds)
    longest = KnownLength(first, second, 0.0, 0.0)
    row = gradient_of(pen.leds, longest)
    by_scale = covariance @ row
    variance = float(row @ by_scale)
    sigma = float(np.sqrt(variance)) / longest.between(pen.leds)
    if sigma > LARGEST_SCALE:
        return replace(pen, led_covariance=covariance, scale_sigma=EXACT_SCALE)
    return replace(
        pen,
        led_covariance=covariance - np.outer(by_scale, by_scale) / variance,
        scale_sigma=max(sigma, EXACT_SCALE),
    )


@dataclass(frozen=True, eq=False)
class Request:
    """Prior knowledge, and the form of the results."""

    lengths: tuple[MeasuredLength, ...]  # none: the largest distance is `RELATIVE`
    diameter: float  # of the LED discs, mm
    camera: Camera | None = None  # of a camera file, with its covariance

    @property
    def is_relative(self) -> bool:
        """Whether nothing gives the scale."""
        return not self.lengths
