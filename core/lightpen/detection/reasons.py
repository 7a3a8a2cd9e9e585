"""Reasons for excluding an image from a calibration."""

from enum import StrEnum
from typing import Self

import cv2

from lightpen.messages import Message, message

# Exceptions of the arithmetic on unforeseen images. One such image is left
# out, and says so; it does not end a swing or a calibration.
UNFORESEEN = (ArithmeticError, ValueError, cv2.error)


class Reason(StrEnum):
    """Reason for not using an image in the calibration."""

    words: Message  # short text; without any for `NONE`
    shows_pen: bool  # whether such an image shows the pen, also if it takes no part

    def __new__(
        cls, value: str, words: Message | None = None, shows_pen: bool = False
    ) -> Self:
        """Return a reason with its words."""
        each = str.__new__(cls, value)
        each._value_, each.shows_pen = value, shows_pen
        each.words = words or Message("")
        return each

    NONE = "", None, True
    UNREADABLE = "unreadable", message("reason.unreadable")
    UNHANDLED = "unhandled", message("reason.unhandled")
    WRONG_SIZE = "wrong size", message("reason.wrong-size")
    EMPTY = "empty", message("reason.empty")
    BLURRED = "blurred", message("reason.blurred")
    TOO_FEW_LEDS = "too few LEDs", message("reason.too-few-leds")
    TOO_SMALL = "LEDs too small", message("reason.too-small")
    NOT_THE_PEN = "spots do not fit the pen", message("reason.not-the-pen")
    AMBIGUOUS = "ambiguous", message("reason.ambiguous")
    MISFIT = "LEDs do not fit", message("reason.misfit"), True
    SLIPPED = "tip slipped", message("reason.slipped"), True
    TAKEN_OUT = "taken out", message("reason.taken-out"), True  # by the user
    # of the swing that is used
    OUTSIDE = "outside the part", message("reason.outside")
    # as that of another camera
    OTHER_MOMENT = "not of the same moment", message("reason.other-moment"), True
    COPY = "same as another image", message("reason.copy"), True
    # of one camera at a moment that another saw
    ABSENT = "no image", message("reason.absent")


def counted(n_images: int, reason: Reason) -> Message:
    """Return the number of excluded images by reason."""
    return message(
        "calibrate.images-of-a-reason", n_images=n_images, reason=reason.words
    )


def exception_detail(error: Exception) -> Message:
    """Return the detail of an image that failed by one of `UNFORESEEN`."""
    return message("image.unhandled", kind=type(error).__name__, problem=str(error))
