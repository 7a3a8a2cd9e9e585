"""What the operator is told: codes with numbers, for the program's texts to word."""

from dataclasses import dataclass
from enum import StrEnum
from typing import TypeAlias

Argument: TypeAlias = float | int | str


class Code(StrEnum):
    """What is said; the arguments are given beside each."""

    SHOW_PEN = "show pen"
    SEAT_TIP = "seat tip"
    SWING_TO_SEAT = "swing to seat"  # no nominal tip: swing gently until it is found
    HOLD_STILL = "hold still"
    STARTS_IN = "starts in"  # whole seconds
    LEAN_TO_YOUR_RIGHT = "lean to your right"
    FOLLOW_ARROW = "follow arrow"
    FEW_LEDS = "few LEDs"  # seen, needed
    TOO_FAST = "too fast"
    BAD_FIT = "bad fit"  # noise of this image and of the others, px
    TIP_SLIPPED = "tip slipped"  # images dropped
    PEN_LOST = "pen lost"
    PEN_LIFTED = "pen lifted"
    TIP_ELSEWHERE = "tip elsewhere"  # distance, mm
    PAUSED = "paused"
    SOLVING = "solving"
    TOO_FEW_IMAGES = "too few images"  # kept, needed
    TOO_LITTLE_TILT = "too little tilt"  # images missing, directions of the dial 0 to 7
    NOT_UPRIGHT = "not upright"  # images missing
    UNKNOWN = "unknown"  # where the tip is cannot be told yet
    UNCERTAIN = "uncertain"  # U and its limit, mm; perhaps images missing
    HALVES_DIFFER = "halves differ"  # difference and its U, mm
    MANY_DROPPED = "many dropped"  # dropped and taken
    LEDS_OFF = "LEDs off"  # standard deviation of a coordinate, U by it alone, mm
    LED_DISPLACED = "LED displaced"  # its number, by how much, mm
    LEDS_MISFIT = "LEDs misfit"  # sigma and what is usual, px
    NO_TIP = "no tip"  # the sentence
    GOOD = "good"  # U, mm


@dataclass(frozen=True)
class Message:
    """One thing to tell the operator.

    Attributes
    ----------
    code : Code
    arguments : tuple
        What `Code` names, in that order.
    """

    code: Code
    arguments: tuple[Argument, ...] = ()
