"""What the program says to its user: a template with values, to be worded anywhere.

The core writes each sentence once, in English, where it has something to say. The
command line prints it so; the wizard looks its template up in the language that is
chosen, and puts the same values in. A sentence names no command and no button, as it is
shown by both: who shows it may add what to do there, by its code.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import TypeAlias, Union

Value: TypeAlias = Union[str, int, float, "Sentence", tuple["Sentence", ...]]
Translate: TypeAlias = Callable[[str], str]


def in_english(template: str) -> str:
    """Return a template as it is written."""
    return template


@dataclass(frozen=True)
class Sentence:
    """A sentence, or a few words that are part of one.

    Attributes
    ----------
    code : str
        Names what is said, for programs: it stays when the words change.
    template : str
        In English, with a field for each value as `str.format` has them.
    values : mapping of str to Value
        Several sentences as one value are told one after the other.
    """

    code: str
    template: str
    values: Mapping[str, Value] = field(default_factory=dict)

    def text(self, translate: Translate = in_english) -> str:
        """Return the words.

        Parameters
        ----------
        translate : callable, optional
            Returns a template in another language.
        """
        words = {name: _worded(value, translate) for name, value in self.values.items()}
        return translate(self.template).format(**words)

    def parts(self) -> Iterator["Sentence"]:
        """Return the sentence and all that are in it."""
        yield self
        for value in self.values.values():
            for each in value if isinstance(value, tuple) else (value,):
                if isinstance(each, Sentence):
                    yield from each.parts()

    def __str__(self) -> str:
        return self.text()


def sentence(code: str, template: str, /, **values: Value) -> Sentence:
    """Return a sentence; code and template are literals, so that tools find them."""
    return Sentence(code, template, values)


COMMA = sentence("list.comma", ", ")  # between the sentences or words of one value


def _worded(value: Value, translate: Translate) -> str | int | float:
    if isinstance(value, Sentence):
        return value.text(translate)
    if isinstance(value, tuple):
        return COMMA.text(translate).join(each.text(translate) for each in value)
    return value
