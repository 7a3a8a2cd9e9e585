"""Origin of images, stored with everything computed from them."""

from enum import StrEnum


class Origin(StrEnum):
    """Origin of images.

    A simulated tip is never current for a pen; one of recorded images may be, as
    whoever accepts it knows when and of what they were taken.
    """

    LIVE = "live camera"
    RECORDED = "recorded"
    SIMULATED = "simulated"
