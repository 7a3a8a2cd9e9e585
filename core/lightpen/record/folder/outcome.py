"""Outcome of an attempt."""

from enum import StrEnum


class TrialOutcome(StrEnum):
    """How a verification or the calibration of a camera ended."""

    ACCEPTED = "accepted"
    REFUSED = "refused"  # it came to something, which was not used
    ABANDONED = "abandoned"  # before it came to anything
