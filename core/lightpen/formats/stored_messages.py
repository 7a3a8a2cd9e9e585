"""Messages in files: code and values, so that they can be shown in any language."""

from collections.abc import Mapping
from typing import Any, Self, TypeAlias, Union

from msgspec import Struct

from lightpen.messages import Message, Translate, Value, in_english

StoredValue: TypeAlias = Union[
    str, int, float, "StoredMessage", tuple["StoredMessage", ...], None
]


class StoredMessage(Struct, frozen=True):
    """A message with its English text for readers of the file.

    Attributes
    ----------
    code : str
        Code of a template in `lightpen.catalogue`.
    values : mapping of str to StoredValue
        Values for the fields of the template; None for a value that is not finite.
    """

    code: str
    text: str
    values: Mapping[str, StoredValue]

    @classmethod
    def of(cls, message: Message) -> Self:
        """Return the stored form of a message."""
        values = {name: _stored(value) for name, value in message.values.items()}
        return cls(message.code, str(message), values)

    def worded(self, translate: Translate = in_english) -> str:
        """Return the words in the language of a translation.

        The text is returned where the catalogue has no such message any more.
        """
        try:
            return _message(self).text(translate)
        except (LookupError, TypeError, ValueError):
            return self.text


def _stored(value: Any) -> StoredValue:
    if isinstance(value, Message):
        return StoredMessage.of(value)
    if isinstance(value, tuple):
        return tuple(map(StoredMessage.of, value))
    if isinstance(value, str | int):
        return value
    number = float(value)
    return number if number - number == 0 else None


def _message(stored: StoredMessage) -> Message:
    values = {name: _value(value) for name, value in stored.values.items()}
    return Message(stored.code, values)


def _value(stored: StoredValue) -> Value:
    if isinstance(stored, StoredMessage):
        return _message(stored)
    if isinstance(stored, tuple):
        return tuple(map(_message, stored))
    return float("nan") if stored is None else stored
