"""Reasons for excluding an image from a calibration."""

from enum import StrEnum

import cv2

from lightpen.messages import Message, message

# Exceptions of the arithmetic on unforeseen images. One such image is left
# out, and says so; it does not end a swing or a calibration.
UNFORESEEN = (ArithmeticError, ValueError, cv2.error)


class Reason(StrEnum):
    """Reason for not using an image in the calibration."""

    NONE = ""
    UNREADABLE = "unreadable"
    UNHANDLED = "unhandled"
    WRONG_SIZE = "wrong size"
    EMPTY = "empty"
    BLURRED = "blurred"
    TOO_FEW_LEDS = "too few LEDs"
    TOO_SMALL = "LEDs too small"
    NOT_THE_PEN = "spots do not fit the pen"
    AMBIGUOUS = "ambiguous"
    MISFIT = "LEDs do not fit"
    SLIPPED = "tip slipped"
    TAKEN_OUT = "taken out"  # by the user
    OUTSIDE = "outside the part"  # of the swing that is used
    OTHER_MOMENT = "not of the same moment"  # as that of another camera
    COPY = "same as another image"
    ABSENT = "no image"  # of one camera at a moment that another saw

    @property
    def shows_pen(self) -> bool:
        """Whether such an image shows the pen, also if it takes no part."""
        return self in _OF_THE_PEN

    @property
    def words(self) -> Message:
        """Short text; empty for `NONE`."""
        return _WORDS[self]


_OF_THE_PEN = {
    Reason.NONE,
    Reason.MISFIT,
    Reason.SLIPPED,
    Reason.TAKEN_OUT,
    Reason.OTHER_MOMENT,
    Reason.COPY,
}

_WORDS = {
    Reason.UNREADABLE: message("reason.unreadable"),
    Reason.UNHANDLED: message("reason.unhandled"),
    Reason.WRONG_SIZE: message("reason.wrong-size"),
    Reason.EMPTY: message("reason.empty"),
    Reason.BLURRED: message("reason.blurred"),
    Reason.TOO_FEW_LEDS: message("reason.too-few-leds"),
    Reason.TOO_SMALL: message("reason.too-small"),
    Reason.NOT_THE_PEN: message("reason.not-the-pen"),
    Reason.AMBIGUOUS: message("reason.ambiguous"),
    Reason.MISFIT: message("reason.misfit"),
    Reason.SLIPPED: message("reason.slipped"),
    Reason.TAKEN_OUT: message("reason.taken-out"),
    Reason.OUTSIDE: message("reason.outside"),
    Reason.OTHER_MOMENT: message("reason.other-moment"),
    Reason.COPY: message("reason.copy"),
    Reason.ABSENT: message("reason.absent"),
}


def counted(n_images: int, reason: Reason) -> Message:
    """Return the number of excluded images by reason."""
    return message(
        "calibrate.images-of-a-reason", n_images=n_images, reason=reason.words
    )


def exception_detail(error: Exception) -> Message:
    """Return the detail of an image that failed by one of `UNFORESEEN`."""
    return message("image.unhandled", kind=type(error).__name__, problem=str(error))
