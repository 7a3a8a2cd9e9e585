"""Origin of images, stored with everything computed from them."""

from enum import StrEnum


class Origin(StrEnum):
    """Origin of images.

    A simulated tip is never current for a pen; one of recorded images may be, as the
    person who accepts it knows their date and subject.
    """

    LIVE = "live camera"
    RECORDED = "recorded"
    SIMULATED = "simulated"
