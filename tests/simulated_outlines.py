"""Areas and centroids of simulated outlines, by their contours."""

from dataclasses import dataclass

import numpy as np

from lightpen.arrays import FloatArray
from lightpen_extensions.simulator.render import Contours


@dataclass(frozen=True, eq=False)
class Outlines:
    """Areas and centroids of outlines."""

    areas: FloatArray  # (N,), px^2
    centroids: FloatArray  # (N, 2), px


def measure_insides(contours: Contours) -> Outlines:
    """Return exact areas and centroids of outlines, by Green's theorem."""
    middles = contours.nodes.mean(axis=1, keepdims=True)
    x, y = np.moveaxis(contours.nodes - middles, -1, 0)
    dy = contours.steps[..., 1]
    areas = (x * dy).sum(axis=-1)
    moments = np.stack([(x * x * dy / 2).sum(axis=-1), (x * y * dy).sum(axis=-1)], -1)
    return Outlines(np.abs(areas), middles[:, 0] + moments / areas[:, None])
