"""What a swing needs, and when it ends."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class SwingLimits:
    """What a swing needs, and when it ends.

    Attributes
    ----------
    max_uncertainty : float
        U (k = 2) of the tip along its weakest direction, mm. A station with a camera
        calibrated on 24 views of a board and LEDs measured to 2 um reaches it with 60
        images, though it does not measure how warm the pen is: by that alone U is
        0.0066 mm. One that does reaches 0.008 mm.
    min_per_field : int
        Images in each field of the dial.
    spacing : float
        Angle by which a kept posture differs from all others, rad.
    """

    max_uncertainty: float = 0.012
    min_images: int = 60
    max_images: int = 300
    min_per_field: int = 2
    spacing: float = float(np.radians(2.5))

    def __post_init__(self) -> None:
        counts = self.min_images, self.min_per_field, self.max_images - 1
        if not (self.max_uncertainty > 0 and self.spacing >= 0 and min(counts) >= 0):
            raise ValueError(f"Nothing can be swung by {self}.")
