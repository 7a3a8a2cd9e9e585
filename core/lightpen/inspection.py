"""What a live image says of the set-up: exposure, focus and stray light."""

from dataclasses import dataclass

import numpy as np

from lightpen.arrays import FloatArray, IntArray
from lightpen.labelling.labels import Labels
from lightpen.spots import Flaw, Spots

DARK_CONTRAST = 0.25  # of the full range; noise then costs more than it need
SHARP_EDGE = 3.5  # px from dark to bright; a sharp lens and 20 ms of stillness give 2
STRAY_MARGIN = 1.5  # times the radius of a stray spot that is masked


@dataclass(frozen=True, eq=False)
class Inspection:
    """Exposure and focus of one image.

    Attributes
    ----------
    n_dark, n_good, n_saturated : int
        LEDs by brightness; of spots where no LED is labelled.
    edge_width : float
        Median width of their rims from dark to bright, px; NaN without any.
    """

    n_dark: int
    n_good: int
    n_saturated: int
    edge_width: float

    @property
    def is_sharp(self) -> bool:
        """Whether the rims are as sharp as good centres need."""
        return self.edge_width <= SHARP_EDGE


def inspect(spots: Spots, labels: Labels | None = None) -> Inspection:
    """Inspect the LEDs of an image, or all its spots where none are labelled.

    Parameters
    ----------
    spots : Spots
    labels : Labels, optional
    """
    chosen: IntArray = np.arange(len(spots))
    if labels is not None and (labels.spot >= 0).any():
        chosen = labels.spot[labels.spot >= 0]
    saturated = (spots.flaws[chosen] & Flaw.SATURATED) > 0
    dark = ~saturated & (spots.contrasts[chosen] < DARK_CONTRAST)
    widths = spots.edge_widths[chosen]
    return Inspection(
        n_dark=int(dark.sum()),
        n_good=int(np.sum(~dark & ~saturated)),
        n_saturated=int(saturated.sum()),
        edge_width=float(np.median(widths)) if len(widths) else float("nan"),
    )


def stray_light(spots: Spots) -> FloatArray:
    """Return circles that cover the spots of an image of the covered pen.

    Parameters
    ----------
    spots : Spots
        All that is bright while no LED can be seen.

    Returns
    -------
    (M, 3) array
        Centre x, y and radius, px; the ``mask`` of `lightpen.spots.detect_spots`.
    """
    radii = 2 * np.sqrt(np.linalg.eigvalsh(spots.shapes)[:, -1])
    return np.column_stack([spots.centers, STRAY_MARGIN * radii + spots.edge_widths])
