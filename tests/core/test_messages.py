"""The message catalogue: every message has a template, and every template a use."""

import ast
import json
import re
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from string import Formatter
from typing import cast

import pytest

import lightpen
import lightpen.cameras.protocol  # its errors are children of the core's
import lightpen_app
import lightpen_app_extensions
import lightpen_extensions
import lightpen_extensions.stream.server  # as are these
from lightpen.cli import ADVICE
from lightpen.errors import FileError, LightpenError
from lightpen.messages import CATALOGUE, TRANSLATED, Code, Message, message

CORE, CORE_EXTENSIONS = (
    Path(each.__path__[0]) for each in (lightpen, lightpen_extensions)
)
APP, APP_EXTENSIONS = (
    Path(each.__path__[0]) for each in (lightpen_app, lightpen_app_extensions)
)
SOURCES = {
    path: path.read_text("utf-8")
    for folder in (CORE, CORE_EXTENSIONS, APP, APP_EXTENSIONS)
    for path in sorted(folder.rglob("*.py"))
}
CODE = r"[a-z]+(-[a-z]+)*\.[a-z0-9]+(-[a-z0-9]+)*"
WORDS = re.compile("[A-Za-z]{4}|[A-Za-z] [A-Za-z]")  # no axes, nor names of numbers
OF_THE_COMMAND_LINE = r"(^|\W)--[a-z]|\blightpen [a-z]|\b[A-Z]+\.[a-z]+\b"


@dataclass(frozen=True)
class Raised:
    """A call of `message`, or of an error with a code, as it is written."""

    code: str
    values: frozenset[str]


def fields_of(template: str) -> set[str]:
    return {name for _, name, _, _ in Formatter().parse(template) if name}


def pairs_of(folder: Path) -> list[tuple[str, object]]:
    """Return all names and values of a folder's messages, repeated ones too."""
    parts: list[list[tuple[str, object]]] = []
    text = (folder / "messages.json").read_bytes()
    json.loads(text, object_pairs_hook=parts.append)
    return [pair for part in parts for pair in part]


@cache
def all_calls(source: str) -> list[ast.Call]:
    nodes = ast.walk(ast.parse(source))
    return [node for node in nodes if isinstance(node, ast.Call)]


def called(call: ast.Call) -> str:
    return str(getattr(call.func, "attr", getattr(call.func, "id", "")))


def calls(source: str, names: set[str]) -> Iterator[ast.Call]:
    for call in all_calls(source):
        if called(call) in names:
            yield call


def code_of(node: ast.expr) -> str | None:
    match node:
        case ast.Constant(value=str() as code):
            return code
        case ast.Attribute(value=ast.Name(id="Code"), attr=name):
            return Code[name]
    return None


def raised_in(source: str) -> list[Raised]:
    return [
        Raised(
            code_of(call.args[0]) or "",
            frozenset(str(each.arg) for each in call.keywords),
        )
        for call in calls(source, {"message", *error_names()})
        if len(call.args) == 1
        and (called(call) == "message" or code_of(call.args[0]) is not None)
    ]


def hidden_in(source: str) -> list[str]:
    """Calls whose code is put together, so that no tool finds it."""
    return [
        ast.unparse(call)
        for call in calls(source, {"message"})
        if len(call.args) != 1 or code_of(call.args[0]) is None
    ]


def error_names(kind: type[LightpenError] = LightpenError) -> set[str]:
    return {kind.__name__}.union(*map(error_names, kind.__subclasses__()))


def bare_words_in(source: str) -> list[str]:
    """Words that reach a user without a template: of errors, and among values."""
    handed = [
        call.args[0]
        for call in calls(source, error_names())
        if call.args and not re.fullmatch(CODE, code_of(call.args[0]) or "")
    ]
    names = {"message", *error_names()}
    handed += [each.value for c in calls(source, names) for each in c.keywords]
    return [
        ast.unparse(node)
        for node in handed
        if has_words(node) or any(map(WORDS.search, texts_in(node)))
    ]


def texts_in(node: ast.AST) -> Iterator[str]:
    """All texts of an expression, but those of messages in it."""
    if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "message":
        return
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        yield node.value
    for child in ast.iter_child_nodes(node):
        yield from texts_in(child)


def has_words(node: ast.expr) -> bool:
    texts = [
        part.value
        for part in (node.values if isinstance(node, ast.JoinedStr) else [node])
        if isinstance(part, ast.Constant) and isinstance(part.value, str)
    ]
    return any(re.search("[A-Za-z]", text) for text in texts)


@cache
def all_raised() -> list[Raised]:
    return [each for source in SOURCES.values() for each in raised_in(source)]


@pytest.fixture
def words(monkeypatch: pytest.MonkeyPatch) -> dict[str, str]:
    """Templates of a test's own, in the catalogue."""
    own = {"a.size": "{name} is {size:.1f} MB.", "a.of": "{what} of {whom}"}
    own |= {"a.none": "none", "a.some": "some"}
    maps = cast("list[Mapping[str, str]]", CATALOGUE.maps)  # type: ignore[attr-defined]
    monkeypatch.setattr(CATALOGUE, "maps", [own, *maps])
    return own


@pytest.mark.usefixtures("words")
def test_values_are_put_into_the_template() -> None:
    assert str(Message("a.size", {"name": "{x}.png", "size": 2.04})) == (
        "{x}.png is 2.0 MB."
    )


@pytest.mark.usefixtures("words")
def test_a_message_is_worded_in_another_language_with_all_that_is_in_it() -> None:
    words = {
        "{what} of {whom}": "{whom}: {what}",
        "none": "keine",
        "some": "einige",
        ", ": "; ",
    }
    both = (Message("a.none"), Message("a.some"))
    said = Message("a.of", {"what": both, "whom": "LEDs"})

    assert str(said) == "none, some of LEDs"
    assert said.text(words.__getitem__) == "LEDs: keine; einige"
    assert [part.code for part in said.parts()] == ["a.of", "a.none", "a.some"]


def test_an_error_carries_its_message() -> None:
    said = message("image.cut-off", name="a.png")

    assert str(FileError(said)) == "a.png is cut off. Capture or copy it again."
    assert FileError(said).message == said


@pytest.mark.slow
def test_every_code_is_written_where_tools_find_it() -> None:
    for path, source in SOURCES.items():
        if path.name != "messages.py":
            assert hidden_in(source) == [], path.name


def test_a_code_that_is_put_together_is_noticed() -> None:
    assert hidden_in("message(f'a.{x}', name=name)")
    assert hidden_in("message('a.b', 'It is damaged.')")
    assert not hidden_in("message('a.b', name=name)")


def test_a_code_stands_in_one_area_and_is_well_formed() -> None:
    pairs = [pair for folder in (CORE, CORE_EXTENSIONS) for pair in pairs_of(folder)]
    counts = Counter(code for code, template in pairs if isinstance(template, str))
    assert len(counts) > 500
    assert [code for code, count in counts.items() if count > 1] == []
    assert [code for code in counts if not re.fullmatch(CODE, code)] == []


def test_the_catalogue_has_exactly_the_messages_that_are_raised() -> None:
    assert {each.code for each in all_raised()} == set(CATALOGUE)


def test_every_message_of_a_swing_is_raised() -> None:
    assert {each.code for each in all_raised()} >= set(Code)


def test_every_field_of_a_template_has_a_value() -> None:
    lacking = {
        each.code: fields_of(CATALOGUE[each.code]) - each.values
        for each in all_raised()
    }
    assert {code: fields for code, fields in lacking.items() if fields} == {}


def test_no_words_reach_a_user_but_by_a_template() -> None:
    for path, source in SOURCES.items():
        if path.is_relative_to(CORE) or path.is_relative_to(CORE_EXTENSIONS):
            assert bare_words_in(source) == [], path.name


def test_words_without_a_template_are_noticed() -> None:
    assert bare_words_in("raise FileError('It is damaged.')")
    assert bare_words_in("raise DeviceLost(f'{name} is damaged.')")
    assert bare_words_in("message('a.b', found=f'{angle:.1f} degrees')")
    assert bare_words_in("message('a.b', found='many' if n else 'few')")
    assert bare_words_in("raise StreamError(_not_open(place, 'it is taken'))")
    assert not bare_words_in("message('a.b', size=f'{width}:{height}')")
    assert not bare_words_in("message('a.b', axis='xyz'[worst])")
    assert not bare_words_in("FileError(message('a.b'))")
    assert not bare_words_in("FileError('a.b', size=2)")
    assert bare_words_in("FileError('a.b', found='many' if n else 'few')")


def test_only_the_command_line_names_its_options() -> None:
    named = [
        template
        for template in TRANSLATED.values()
        if re.search(OF_THE_COMMAND_LINE, template)
    ]
    assert named == []


def test_a_template_that_names_an_option_is_noticed() -> None:
    for template in (
        "Name the units, such as --units mm.",
        "Put them into the pen frame: lightpen pen.",
        "Read RAW.csv again.",
    ):
        assert re.search(OF_THE_COMMAND_LINE, template)


def test_what_to_type_answers_a_message_of_the_catalogue() -> None:
    assert set(ADVICE) <= set(CATALOGUE)


def test_a_number_that_rounds_to_zero_has_no_sign() -> None:
    def worded(error: float) -> str:
        values = {"error": error, "uncertainty": 0.001, "limit": 0.01}
        return str(message("artefact.good", name="Ring", **values))

    assert "Ring: error 0.0000 mm" in worded(-0.00001)
    assert "Ring: error -0.0001 mm" in worded(-0.0001)
