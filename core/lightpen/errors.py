"""Errors that the user can correct; any other exception is a bug and not caught."""

from pathlib import Path

from lightpen.messages import Message, Value, message_values


class LightpenError(Exception):
    """Base of the errors shown to the user, by a message or its code with values.

    The message says what was found, what is needed, what to do; a path is shown.
    """

    def __init__(self, content: Message | str, /, **values: Value | Path) -> None:
        self.message = (
            Message(content, message_values(values))
            if isinstance(content, str)
            else content
        )
        super().__init__(self.message)


class FileError(LightpenError):
    """A file cannot be read or written, or has the wrong content."""


class NameTakenError(FileError):
    """A file that was to be new exists."""


class ArchiveError(LightpenError):
    """The archive cannot be read or written, or is not one of this program."""


class NoArchiveError(ArchiveError):
    """There is no archive, or nothing was ever entered in it."""


class UsageError(LightpenError):
    """The request contradicts itself or lacks something."""


class CalibrationError(LightpenError):
    """The observations do not determine the calibration."""


class AcceptanceError(LightpenError):
    """The tip must not be made current, or not as requested."""


class Cancelled(Exception):  # noqa: N818 - not an error
    """The user stopped the computation."""
