"""Detection of copied images, which count once."""

from dataclasses import replace

import numpy as np

from lightpen.detection.observations import Observations
from lightpen.detection.reasons import Reason

SAME = 0.002  # px, rms: the noise of any two images is more, that of a new coding less


def without_copies(observations: Observations) -> Observations:
    """Return observations whose copies of other images have the reason ``COPY``.

    The first of several copies counts. Copies have the same LEDs with the same centres,
    but for rounding and the coding of a video; two images of a pen at rest differ by
    their noise.
    """
    reasons = list(observations.reasons)
    used = np.flatnonzero([reason is Reason.NONE for reason in reasons])
    if len(used) == 0:
        return observations
    pixels = observations.pixels[used].reshape(len(used), -1)
    seen = np.isfinite(pixels)
    clean = np.where(seen, pixels, 0.0)
    # Copies have nearly the same sum, so that they stand beside each other.
    order = np.argsort(clean.sum(axis=1), kind="stable")
    same = np.all(seen[order[1:]] == seen[order[:-1]], axis=1)
    apart = clean[order[1:]] - clean[order[:-1]]
    counts = np.maximum(seen[order[1:]].sum(axis=1), 1)
    same &= np.sum(apart**2, axis=1) < SAME**2 * counts
    starts = np.concatenate([[True], ~same])[: len(order)]
    for group in np.split(order, np.flatnonzero(starts)[1:]):
        for copy in np.sort(group)[1:]:
            reasons[used[copy]] = Reason.COPY
    return replace(observations, reasons=tuple(reasons))
