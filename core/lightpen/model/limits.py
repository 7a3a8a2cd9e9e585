"""What a station asks of a swing, and allows a verification to find."""

from dataclasses import dataclass, field, fields
from math import isfinite

import numpy as np

from lightpen.model.due_rule import DueRule


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


@dataclass(frozen=True)
class VerificationLimits:
    """What a verification may find at most, mm.

    Attributes
    ----------
    across, along : float
        Standard deviation of a fixed point across and along the view: along u and v,
        and along w, where one camera sees some ten times less.
    radius : float
        Error of the mean radius of a circle.
    form : float
        Roundness of a circle, and its deviation from a plane.
    length : float
        Error of a length.
    location : float
        Diameter of the sphere about one point touched in several postures.
    repeatability : float
        Standard deviation of a coordinate of the tip over calibrations.
    drift : float
        How far a witness may move during a session.
    """

    across: float = 0.01
    along: float = 0.03
    radius: float = 0.02
    form: float = 0.1
    length: float = 0.03
    location: float = 0.1
    repeatability: float = 0.01
    drift: float = 0.02

    def __post_init__(self) -> None:
        for item in fields(self):
            value = getattr(self, item.name)
            if not (isfinite(value) and value > 0):
                raise ValueError(f"`{item.name}` must be above 0, got {value}.")


@dataclass(frozen=True)
class StationLimits:
    """All limits of a station, and when its tips are due."""

    swing: SwingLimits = field(default_factory=SwingLimits)
    verification: VerificationLimits = field(default_factory=VerificationLimits)
    due: DueRule = field(default_factory=DueRule)
