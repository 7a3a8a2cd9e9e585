"""What the core said once and a file holds in English, in the language that is chosen.

A file keeps the words with the numbers in them, not how they were made. So the sentence
is looked for whose words these are, and what stands in its places is put into the words
of the other language.
"""

import re
from dataclasses import dataclass
from functools import cache
from string import Formatter
from xml.etree import ElementTree

from lightpen.sentences import COMMA
from lightpen_app.look.languages import TRANSLATIONS, Language
from lightpen_app.look.sentences import CONTEXT, translated

CATALOGUE = TRANSLATIONS / f"lightpen_{Language.CHINESE}.ts"  # names every sentence


@dataclass(frozen=True)
class _Known:
    """A sentence of the core, the longest of its own words, and its places' names."""

    template: str
    words: str
    fields: tuple[str, ...]

    def match(self, text: str) -> re.Match[str] | None:
        """Return a match whose groups are what stands in the places."""
        if self.words not in text:
            return None  # without a pattern: hundreds take long to be compiled
        return _pattern(self.template).fullmatch(text)


def worded_anew(text: str) -> str:
    """Return words of the core in the language that is chosen; others as they are."""
    for known in _sentences():
        match = known.match(text)
        if match is not None:
            values = dict(zip(known.fields, map(_value, match.groups()), strict=True))
            return _filled(translated(known.template), values)
    return text


def _value(text: str) -> str:
    """Return what stands in a place: a sentence, several after each other, or a value.

    Sentences are told as such only if all of them are known; a name may hold commas.
    """
    whole, parts = worded_anew(text), text.split(COMMA.template)
    if whole != text or len(parts) == 1:
        return whole
    anew = list(map(worded_anew, parts))
    is_list = all(new != old for new, old in zip(anew, parts, strict=True))
    return translated(COMMA.template).join(anew) if is_list else text


def _filled(template: str, values: dict[str, str]) -> str:
    parts = Formatter().parse(template)
    return "".join(words + values.get(name or "", "") for words, name, *_ in parts)


@cache
def _sentences() -> tuple[_Known, ...]:
    """Return the sentences of the core, those with the most words of their own first.

    One without any says no more than what stands in it.
    """
    found = []
    for context in ElementTree.parse(CATALOGUE).getroot().iter("context"):
        if context.findtext("name") == CONTEXT:
            found += [each.text or "" for each in context.iter("source")]
    lengths = {
        template: sum(len(words) for words, *_ in Formatter().parse(template))
        for template in found
        if re.search("[A-Za-z]", re.sub(r"\{[^}]*\}", "", template))
    }
    ordered = sorted(lengths, key=lambda template: lengths[template], reverse=True)
    return tuple(map(_known, ordered))


def _known(template: str) -> _Known:
    parts = list(Formatter().parse(template))
    return _Known(
        template,
        max((words for words, *_ in parts), key=len),
        tuple(name for _, name, *_ in parts if name is not None),
    )


@cache
def _pattern(template: str) -> re.Pattern[str]:
    """Return what the words of a sentence look like, whatever stands in its places."""
    pattern = ""
    for words, name, *_ in Formatter().parse(template):
        pattern += re.escape(words)
        if name is not None:
            pattern += "(.+?)"
    return re.compile(pattern, re.DOTALL)
