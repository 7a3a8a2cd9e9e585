"""Messages of the core in the selected language."""

from PySide6.QtCore import QCoreApplication

from lightpen.formats.stored_messages import StoredMessage
from lightpen.messages import Message

CONTEXT = "core"


def worded(message: Message | StoredMessage | None) -> str:
    """Return the words of a message of the core; empty if there is none."""
    if isinstance(message, StoredMessage):
        return message.worded(translated)
    return "" if message is None else message.text(translated)


def translated(template: str) -> str:
    """Return a template of the core in the language that is chosen."""
    return QCoreApplication.translate(CONTEXT, template)
