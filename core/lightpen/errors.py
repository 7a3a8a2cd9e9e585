"""Errors the user can put right; anything else is a bug and is left to crash."""

from lightpen.sentences import Sentence


class LightpenError(Exception):
    """Base of the errors that are shown to the user.

    Parameters
    ----------
    sentence : Sentence
        What was found, what is needed and what to do.
    """

    def __init__(self, sentence: Sentence) -> None:
        super().__init__(sentence)
        self.sentence = sentence


class FileError(LightpenError):
    """A file cannot be read or written, or does not hold what is needed."""


class NameTakenError(FileError):
    """A file that was to be new exists."""


class ArchiveError(LightpenError):
    """The archive cannot be read or written, or is not one of this program."""


class NoArchiveError(ArchiveError):
    """There is no archive, or nothing was ever entered in it."""


class StreamError(LightpenError):
    """Poses cannot be streamed as it was asked for."""


class UsageError(LightpenError):
    """The request contradicts itself or lacks something."""


class CalibrationError(LightpenError):
    """The observations do not determine the calibration."""


class AcceptanceError(LightpenError):
    """The tip must not be put in force, or not as it was asked for."""


class Cancelled(Exception):  # noqa: N818 - not an error
    """The user stopped the computation."""
