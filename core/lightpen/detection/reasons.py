"""Why an image does not take part in a calibration."""

from enum import StrEnum


class Reason(StrEnum):
    """Why an image does not take part in the calibration."""

    NONE = ""
    UNREADABLE = "unreadable"
    WRONG_SIZE = "wrong size"
    EMPTY = "empty"
    BLURRED = "blurred"
    TOO_FEW_LEDS = "too few LEDs"
    NOT_THE_PEN = "spots do not fit the pen"
    AMBIGUOUS = "ambiguous"
    MISFIT = "LEDs do not fit"
    SLIPPED = "tip slipped"
    TAKEN_OUT = "taken out"  # by the user
