"""Outcome of an attempt."""

from enum import StrEnum


class TrialOutcome(StrEnum):
    """Outcome of a verification or of the calibration of a camera."""

    ACCEPTED = "accepted"
    REFUSED = "refused"  # solved, but not used
    ABANDONED = "abandoned"  # before a solution
