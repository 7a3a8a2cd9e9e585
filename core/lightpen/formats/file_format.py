"""A format in which something is exported, an entry of a table of formats."""

from collections.abc import Callable
from dataclasses import dataclass

from lightpen.messages import Message


@dataclass(frozen=True)
class FileFormat:
    """A format of exported files."""

    name: str  # on the command line
    label: Message
    suffix: str  # end of the names of its files
    text: Callable[..., str]  # content of a file

    def encoded(self, *values: object) -> bytes:
        """Return the content of a file for some values, in UTF-8."""
        return self.text(*values).encode("utf-8", "backslashreplace")
