"""What the core says, in the language that is chosen."""

from PySide6.QtCore import QCoreApplication

from lightpen.sentences import Sentence

CONTEXT = "core"


def worded(sentence: Sentence | None) -> str:
    """Return the words of a sentence of the core; empty if there is none."""
    return "" if sentence is None else sentence.text(translated)


def translated(template: str) -> str:
    """Return a template of the core in the language that is chosen."""
    return QCoreApplication.translate(CONTEXT, template)
