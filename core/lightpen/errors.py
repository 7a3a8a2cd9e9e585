"""Errors the user can put right; anything else is a bug and is left to crash."""


class LightpenError(Exception):
    """Base of the errors whose text is shown to the user as it stands."""


class FileError(LightpenError):
    """A file cannot be read or written, or does not hold what is needed."""


class UsageError(LightpenError):
    """The request contradicts itself or lacks something."""


class CalibrationError(LightpenError):
    """The observations do not determine the calibration."""


class Cancelled(Exception):  # noqa: N818 - not an error
    """The user stopped the computation."""
