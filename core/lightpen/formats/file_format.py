"""A format in which something is exported, an entry of a table of formats."""

from collections.abc import Callable
from dataclasses import dataclass

from lightpen.messages import Message


@dataclass(frozen=True)
class FileFormat:
    """A format of exported files.

    The name is that on the command line, ``text`` returns the content of a file,
    and the suffix is the end of its name.
    """

    name: str
    label: Message
    suffix: str
    text: Callable[..., str]

    def encoded(self, *values: object) -> bytes:
        """Return the content of a file for some values, in UTF-8."""
        return self.text(*values).encode("utf-8", "backslashreplace")
