"""Messages to the user: a code with values; the catalogue has the text.

The core raises a message by its code; `lightpen.catalogue` holds its English template.
The command line prints English; the wizard looks the template up in its language. A
message names no command and no button, as both show it: each adds its own advice by the
code. Stored messages keep code and values, so that they print in any language later.
"""

from collections import ChainMap
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeAlias, Union

from lightpen.catalogue import (
    archive,
    camera_and_pen_files,
    cameras,
    command_line,
    desktop,
    detection,
    discovery,
    estimation,
    files,
    images,
    intrinsics,
    measuring,
    model,
    pen_check,
    record,
    simulator,
    streaming,
    swing,
    tables,
    verification,
    verification_history,
    verification_tasks,
)

Value: TypeAlias = Union[str, int, float, "Message", tuple["Message", ...]]
Translate: TypeAlias = Callable[[str], str]

TRANSLATED = (
    archive,
    camera_and_pen_files,
    cameras,
    desktop,
    detection,
    discovery,
    estimation,
    files,
    images,
    intrinsics,
    measuring,
    model,
    pen_check,
    record,
    simulator,
    streaming,
    swing,
    tables,
    verification,
    verification_history,
    verification_tasks,
)
CATALOGUE: Mapping[str, str] = ChainMap(
    *(area.MESSAGES for area in (*TRANSLATED, command_line))
)


def in_english(template: str) -> str:
    """Return a template unchanged."""
    return template


@dataclass(frozen=True)
class Message:
    """A message, or a few words that are part of one."""

    code: str  # key of the template in the catalogue; it stays when the words change
    # For the fields of the template; a tuple of messages is joined by commas.
    values: Mapping[str, Value] = field(default_factory=dict)

    @property
    def template(self) -> str:
        """The English words, with a field for each value."""
        return CATALOGUE[self.code]

    def text(self, translate: Translate = in_english) -> str:
        """Return the words, in English unless a translation of templates is given."""
        words = {name: _worded(value, translate) for name, value in self.values.items()}
        return translate(self.template).format(**words)

    def parts(self) -> Iterator["Message"]:
        """Return the message and all messages among its values."""
        yield self
        for value in self.values.values():
            for each in value if isinstance(value, tuple) else (value,):
                if isinstance(each, Message):
                    yield from each.parts()

    def __str__(self) -> str:
        return self.text()


def printable(text: str) -> str:
    """Return a text with unprintable characters escaped."""
    if text.isprintable():
        return text
    return "".join(
        character if character.isprintable() else ascii(character)[1:-1]
        for character in text
    )


def message(code: str, /, **values: Value | Path) -> Message:
    """Return a message of the catalogue; its code is a literal, for tools to find.

    Unprintable characters of paths are escaped.
    """
    return Message(code, message_values(values))


def message_values(values: Mapping[str, Value | Path]) -> dict[str, Value]:
    """Return the values of a message, with paths as text."""
    return {
        name: printable(str(value)) if isinstance(value, Path) else value
        for name, value in values.items()
    }


class Number(float):
    """A number that is written without a sign before zero."""

    def __format__(self, spec: str) -> str:
        text = super().__format__(spec)
        return text if any(map(text.__contains__, "123456789in")) else text.lstrip("-")


COMMA = message("list.comma")  # between the messages or words of one value


def _worded(value: Value, translate: Translate) -> str | int | float:
    if isinstance(value, Message):
        return value.text(translate)
    if isinstance(value, tuple):
        return COMMA.text(translate).join(each.text(translate) for each in value)
    return Number(value) if isinstance(value, float) else value
