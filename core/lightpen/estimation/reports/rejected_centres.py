"""LED centres that the fit rejects: their share, and where most of them are."""

from typing import NamedTuple

import numpy as np

from lightpen.estimation.calibrate import Calibration
from lightpen.messages import Message, message

MOST = 0.5  # of the rejected centres: more are of one LED, or of one part of the image
PARTS = (
    message("rejected.upper-left"),
    message("rejected.upper-right"),
    message("rejected.lower-left"),
    message("rejected.lower-right"),
)


class RejectedCentres(NamedTuple):
    """Centres of the used images that the fit rejects."""

    n_seen: int
    n_rejected: int
    where: Message

    @property
    def share(self) -> float:
        """Share of the centres that are rejected."""
        return self.n_rejected / max(self.n_seen, 1)


def rejected_centres(calibration: Calibration) -> RejectedCentres:
    """Count the rejected centres of the used images of all cameras."""
    seen, rejected, parts = [], [], []
    for images in calibration.cameras:
        pixels = images.observations.pixels[images.used]
        is_seen = np.isfinite(pixels[..., 0])
        seen.append(is_seen)
        rejected.append(is_seen & ~images.leds_used[images.used])
        low, high = np.nanmin(pixels, axis=(0, 1)), np.nanmax(pixels, axis=(0, 1))
        right, lower = np.moveaxis(pixels > (low + high) / 2, -1, 0)
        parts.append(right + 2 * lower)
    out = np.concatenate(rejected)
    of_led = out.sum(axis=0)
    of_part = np.bincount(np.concatenate(parts)[out], minlength=len(PARTS))
    led, part = int(np.argmax(of_led)), int(np.argmax(of_part))
    n = int(out.sum())
    where = message("rejected.everywhere")
    if n and of_led[led] > MOST * n:
        where = message("rejected.led", led=led + 1)
    elif n and of_part[part] > MOST * n:
        where = PARTS[part]
    return RejectedCentres(int(np.concatenate(seen).sum()), n, where)
