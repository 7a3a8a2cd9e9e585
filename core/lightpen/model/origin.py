"""Where images come from, as it is kept with everything that is computed from them."""

from enum import StrEnum


class Origin(StrEnum):
    """What the images are of.

    A simulated tip is never in force for a pen; one of recorded images may be, as
    whoever accepts it knows when and of what they were taken.
    """

    LIVE = "live camera"
    RECORDED = "recorded"
    SIMULATED = "simulated"
