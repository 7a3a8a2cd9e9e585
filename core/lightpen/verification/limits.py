"""What a station allows a verification to find."""

from dataclasses import dataclass, fields
from math import isfinite


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
