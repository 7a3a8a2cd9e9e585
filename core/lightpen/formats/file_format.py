"""A format in which something is exported, an entry of a table of formats."""

from collections.abc import Callable
from dataclasses import dataclass

from lightpen.messages import Message


@dataclass(frozen=True)
class FileFormat:
    """A format of exported files.

    Attributes
    ----------
    name : str
        Name on the command line.
    suffix : str
        End of the names of its files.
    text : callable
        Returns the content of a file.
    """

    name: str
    label: Message
    suffix: str
    text: Callable[..., str]

    def encoded(self, *values: object) -> bytes:
        """Return the content of a file for some values, in UTF-8."""
        return self.text(*values).encode("utf-8", "backslashreplace")
