"""Why an image does not take part in a calibration."""

from enum import StrEnum

import cv2

from lightpen.sentences import Sentence, sentence

# What arithmetic ends in on an image that nobody thought of. One such image is left
# out, and says so; it does not end a swing or a calibration.
MISHAPS = (ArithmeticError, ValueError, cv2.error)


class Reason(StrEnum):
    """Why an image does not take part in the calibration."""

    NONE = ""
    UNREADABLE = "unreadable"
    UNHANDLED = "unhandled"
    WRONG_SIZE = "wrong size"
    EMPTY = "empty"
    BLURRED = "blurred"
    TOO_FEW_LEDS = "too few LEDs"
    NOT_THE_PEN = "spots do not fit the pen"
    AMBIGUOUS = "ambiguous"
    MISFIT = "LEDs do not fit"
    SLIPPED = "tip slipped"
    TAKEN_OUT = "taken out"  # by the user
    OTHER_MOMENT = "not of the same moment"  # as that of another camera
    ABSENT = "no image"  # of one camera at a moment that another saw

    @property
    def shows_pen(self) -> bool:
        """Whether such an image shows the pen, also if it takes no part."""
        return self in _OF_THE_PEN

    @property
    def words(self) -> Sentence:
        """It in a few words; `NONE` has none."""
        return _WORDS[self]


_OF_THE_PEN = {
    Reason.NONE,
    Reason.MISFIT,
    Reason.SLIPPED,
    Reason.TAKEN_OUT,
    Reason.OTHER_MOMENT,
}

_WORDS = {
    Reason.UNREADABLE: sentence("reason.unreadable", "unreadable"),
    Reason.UNHANDLED: sentence("reason.unhandled", "the program failed on it"),
    Reason.WRONG_SIZE: sentence("reason.wrong-size", "wrong size"),
    Reason.EMPTY: sentence("reason.empty", "no LED seen"),
    Reason.BLURRED: sentence("reason.blurred", "blurred"),
    Reason.TOO_FEW_LEDS: sentence("reason.too-few-leds", "too few LEDs"),
    Reason.NOT_THE_PEN: sentence("reason.not-the-pen", "spots do not fit the pen"),
    Reason.AMBIGUOUS: sentence("reason.ambiguous", "ambiguous"),
    Reason.MISFIT: sentence("reason.misfit", "LEDs do not fit"),
    Reason.SLIPPED: sentence("reason.slipped", "tip slipped"),
    Reason.TAKEN_OUT: sentence("reason.taken-out", "taken out"),
    Reason.OTHER_MOMENT: sentence("reason.other-moment", "not of the same moment"),
    Reason.ABSENT: sentence("reason.absent", "no image"),
}


def counted(n_images: int, reason: Reason) -> Sentence:
    """Return how many images do not take part for a reason."""
    return sentence(
        "calibrate.images-of-a-reason",
        "{n_images} {reason}",
        n_images=n_images,
        reason=reason.words,
    )


def mishap_detail(error: Exception) -> Sentence:
    """Return what there is to say of an image that ended in one of `MISHAPS`."""
    return sentence(
        "image.unhandled",
        "The program failed on this image ({kind}: {problem}). Keep the image, and "
        "report it.",
        kind=type(error).__name__,
        problem=str(error),
    )
