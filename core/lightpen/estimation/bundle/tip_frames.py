"""The frames of a pen with displaced LEDs.

A displaced LED makes the frame of the file ambiguous: either the other LEDs define it
by their best fit, or all LEDs at their actual positions do. The tip differs.
"""

from typing import NamedTuple

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.estimation.bundle.bundle import Bundle
from lightpen.estimation.contact.led_quality import LedQuality
from lightpen.model.rigid import fit_rigid

FEWEST_LEDS = 4  # that define a frame


class TipFrames(NamedTuple):
    """The tip in both frames, (3,) each, mm."""

    # (3,), in the frame in which the undisplaced LEDs fit the file best.
    of_file: FloatArray
    of_all: FloatArray  # (3,), in the frame in which all LEDs as fitted fit it best
    # Whether result and U refer to ``of_file``: displaced LEDs are left out.
    is_of_file: bool


def tip_frames(
    bundle: Bundle, leds: LedQuality, tip_pen: FloatArray
) -> TipFrames | None:
    """Return the tip in both frames; None where they are the same."""
    is_displaced = np.zeros(len(leds.rms), dtype=bool)
    is_displaced[np.array(leds.displaced, dtype=int) - 1] = True
    trusted = ~is_displaced
    if trusted.all() or trusted.sum() < FEWEST_LEDS:
        return None
    stated = bundle.unknowns.start.pen.leds
    found = bundle.state.pen.leds.copy()
    left_out = is_displaced & (2 * leds.n_used < leds.n_seen)
    found[left_out] = (stated + leds.displacement)[left_out]
    tips = []
    for chosen in (trusted, slice(None)):
        R, t = fit_rigid(found[chosen], stated[chosen])
        tips.append(R @ tip_pen + t)
    of_file, of_all = tips
    off = [float(np.linalg.norm(tip - tip_pen)) for tip in tips]
    return TipFrames(of_file, of_all, off[0] <= off[1])
