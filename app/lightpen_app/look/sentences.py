"""Messages of the core in the selected language."""

from collections.abc import Iterable

from PySide6.QtCore import QCoreApplication

from lightpen.formats.stored_messages import StoredMessage
from lightpen.messages import COMMA, Message

CONTEXT = "core"


def worded(message: Message | StoredMessage | None) -> str:
    """Return the words of a message of the core; empty if there is none."""
    if isinstance(message, StoredMessage):
        return message.worded(translated)
    return "" if message is None else message.text(translated)


def listed(words: Iterable[str]) -> str:
    """Return words with the comma of the language between them."""
    return worded(COMMA).join(words)


def translated(template: str) -> str:
    """Return a template of the core in the language that is chosen."""
    return QCoreApplication.translate(CONTEXT, template)
