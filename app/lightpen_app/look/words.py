"""Displayed names and times."""

import re
from datetime import datetime

from lightpen.local_time import local_time

LONGEST_SHOWN = 32  # characters
LEAST_SHOWN = 12  # characters of a name where there is little room
LONGEST_WORD = 24  # characters; longer words may be split
BREAK = "\u200b"  # where a line may end, though no blank is there
JOINER = "\u2060"  # where a line may not end, though it could
PARTED = "  \u00b7  "  # between items in one line


def shortened(name: str, longest: int = LONGEST_SHOWN) -> str:
    """Return a name that fits into a line; its end is left out if it is long."""
    return name if len(name) <= longest else f"{name[: longest - 1]}\u2026"


def with_short_words(text: str) -> str:
    """Return a text that fits a narrow place: names that cannot wrap lose their end.

    Paths stay whole.
    """
    # Qt may begin a new line beside any Chinese character.
    word = rf"(?<!\S)[^\s/\\{BREAK}{JOINER}\u2e80-\uffef]{{{LONGEST_WORD + 1},}}(?!\S)"
    return re.sub(word, lambda found: shortened(found.group(), LEAST_SHOWN), text)


def breakable(text: str) -> str:
    """Allow line breaks in words without a blank, such as paths."""
    long_word = rf"\S{{{LONGEST_WORD},}}"
    return re.sub(long_word, lambda word: _parted(word.group()), text)


def unbroken(text: str) -> str:
    """Undo `breakable`."""
    return text.replace(BREAK, "")


def on_one_line(text: str) -> str:
    """Prevent line breaks within a text."""
    return JOINER.join(text.replace(" ", "\xa0"))


def phrases_whole(text: str) -> str:
    """Prevent line breaks within coverage factors and numbers of standards."""
    phrase = r"k = \d|(?:ISO|JCGM) \d\S*"
    return re.sub(phrase, lambda found: found.group().replace(" ", "\xa0"), text)


def _parted(word: str) -> str:
    """Split a long word after its punctuation, or anywhere if there is none."""
    parts = re.findall(rf"[^/\\_,;.]{{1,{LONGEST_WORD}}}[/\\_,;.]?|[/\\_,;.]", word)
    return BREAK.join(parts)


def moment_text(moment: datetime) -> str:
    """Return a moment in local time, to the minute."""
    return f"{local_time(moment):%Y-%m-%d %H:%M}"


def day_text(moment: datetime) -> str:
    """Return the local day of a moment."""
    return f"{local_time(moment):%Y-%m-%d}"
