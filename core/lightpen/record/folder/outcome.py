"""Outcome of an attempt."""

from enum import StrEnum


class TrialOutcome(StrEnum):
    """How a verification or the calibration of a camera ended."""

    ACCEPTED = "accepted"
    REFUSED = "refused"  # solved, but not used
    ABANDONED = "abandoned"  # before a solution
