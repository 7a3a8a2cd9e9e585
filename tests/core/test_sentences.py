"""What the core says: templates that tools find, with values, by codes that last."""

import ast
import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from string import Formatter

import lightpen
import lightpen.cameras.protocol  # its errors are children of the core's
from lightpen.cli import ADVICE
from lightpen.errors import FileError, LightpenError
from lightpen.messages import Code
from lightpen.sentences import sentence

CORE = Path(lightpen.__path__[0])
COMMAND_LINE = (CORE / "cli.py", *(CORE / "commands").glob("*.py"))
SOURCES = {path: path.read_text("utf-8") for path in sorted(CORE.rglob("*.py"))}
CODE = r"[a-z]+(-[a-z]+)*\.[a-z0-9]+(-[a-z0-9]+)*"
WORDS = re.compile("[A-Za-z]{4}|[A-Za-z] [A-Za-z]")  # no axes, nor names of numbers
OF_THE_COMMAND_LINE = r"(^|\W)--[a-z]|\blightpen [a-z]|\b[A-Z]+\.[a-z]+\b"


@dataclass(frozen=True)
class Said:
    """A call of `sentence`, as it is written."""

    code: str
    template: str
    values: frozenset[str]

    @property
    def fields(self) -> set[str]:
        return {name for _, name, _, _ in Formatter().parse(self.template) if name}


@cache
def all_calls(source: str) -> list[ast.Call]:
    nodes = ast.walk(ast.parse(source))
    return [node for node in nodes if isinstance(node, ast.Call)]


def calls(source: str, names: set[str]) -> Iterator[ast.Call]:
    for call in all_calls(source):
        if getattr(call.func, "attr", getattr(call.func, "id", "")) in names:
            yield call


def code_of(node: ast.expr) -> str | None:
    match node:
        case ast.Constant(value=str() as code):
            return code
        case ast.Attribute(value=ast.Name(id="Code"), attr=name):
            return Code[name]
    return None


def said_in(source: str) -> list[Said]:
    """The sentences of a module, but those that `hidden_in` tells."""
    found = []
    for call in calls(source, {"sentence"}):
        match call.args:
            case [first, ast.Constant(value=str() as template)]:
                values = frozenset(str(each.arg) for each in call.keywords)
                found.append(Said(code_of(first) or "", template, values))
    return found


def hidden_in(source: str) -> list[str]:
    """Calls whose code or words are put together, so that no tool finds them."""
    found = [
        ast.unparse(call)
        for call in calls(source, {"sentence"})
        if len(call.args) != 2
        or code_of(call.args[0]) is None
        or not isinstance(call.args[1], ast.Constant)
    ]
    return found + [ast.unparse(call) for call in calls(source, {"Sentence"})]


def error_names(kind: type[LightpenError] = LightpenError) -> set[str]:
    return {kind.__name__}.union(*map(error_names, kind.__subclasses__()))


def bare_words_in(source: str) -> list[str]:
    """Words that reach a user without a template: of errors, and among values."""
    handed = [call.args[0] for call in calls(source, error_names()) if call.args]
    handed += [each.value for c in calls(source, {"sentence"}) for each in c.keywords]
    return [
        ast.unparse(node)
        for node in handed
        if has_words(node) or any(map(WORDS.search, texts_in(node)))
    ]


def texts_in(node: ast.AST) -> Iterator[str]:
    """All texts of an expression, but those of sentences in it."""
    if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "sentence":
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
def all_said() -> dict[Path, list[Said]]:
    return {path: said_in(source) for path, source in SOURCES.items()}


def everything() -> list[Said]:
    return [said for found in all_said().values() for said in found]


def test_values_are_put_into_the_template() -> None:
    said = sentence("a.b", "{name} is {size:.1f} MB.", name="{x}.png", size=2.04)

    assert str(said) == "{x}.png is 2.0 MB."


def test_a_sentence_is_told_in_another_language_with_all_that_is_in_it() -> None:
    words = {
        "{what} of {whom}": "{whom}: {what}",
        "none": "keine",
        "some": "einige",
        ", ": "; ",
    }
    both = (sentence("a.none", "none"), sentence("a.some", "some"))
    said = sentence("a.of", "{what} of {whom}", what=both, whom="LEDs")

    assert str(said) == "none, some of LEDs"
    assert said.text(words.__getitem__) == "LEDs: keine; einige"
    assert [part.code for part in said.parts()] == ["a.of", "a.none", "a.some"]


def test_an_error_says_its_sentence() -> None:
    said = sentence("a.missing", "{name} is missing.", name="a.png")

    assert str(FileError(said)) == "a.png is missing."
    assert FileError(said).sentence == said


def test_every_sentence_is_written_where_tools_find_it() -> None:
    for path, source in SOURCES.items():
        if path.name != "sentences.py":
            assert hidden_in(source) == [], path.name


def test_a_sentence_that_is_put_together_is_noticed() -> None:
    assert hidden_in("sentence('a.b', f'{x} is damaged.')")
    assert hidden_in("sentence('a.b', TEXT)")
    assert hidden_in("sentence(f'a.{x}', 'It is damaged.')")
    assert hidden_in("Sentence('a.b', 'It is damaged.')")
    assert not hidden_in("sentence('a.b', 'It is damaged.')")


def test_a_code_names_one_template() -> None:
    assert len(everything()) > 250
    counts = Counter(said.code for said in everything())
    assert [code for code, count in counts.items() if count > 1] == []
    assert [code for code in counts if not re.fullmatch(CODE, code)] == []


def test_every_message_of_a_swing_is_said() -> None:
    assert {said.code for said in everything()} >= set(Code)


def test_every_field_of_a_template_has_a_value() -> None:
    assert [said for said in everything() if not said.fields <= said.values] == []


def test_a_field_without_a_value_is_noticed() -> None:
    (said,) = said_in("sentence('a.b', '{name} is {size:.1f} MB.', name=name)")

    assert said.fields - said.values == {"size"}


def test_no_words_reach_a_user_but_by_a_template() -> None:
    for path, source in SOURCES.items():
        assert bare_words_in(source) == [], path.name


def test_words_without_a_template_are_noticed() -> None:
    assert bare_words_in("raise FileError('It is damaged.')")
    assert bare_words_in("raise DeviceLost(f'{name} is damaged.')")
    assert bare_words_in("sentence('a.b', '{found}', found=f'{angle:.1f} degrees')")
    assert bare_words_in("sentence('a.b', '{found}', found='many' if n else 'few')")
    assert bare_words_in("raise StreamError(_not_open(place, 'it is taken'))")
    assert not bare_words_in("sentence('a.b', '{size}', size=f'{width}:{height}')")
    assert not bare_words_in("sentence('a.b', '{axis}', axis='xyz'[worst])")
    assert not bare_words_in("FileError(sentence('a.b', 'It is damaged.'))")


def test_only_the_command_line_names_its_options() -> None:
    named = [
        said.template
        for path, found in all_said().items()
        for said in found
        if path not in COMMAND_LINE and re.search(OF_THE_COMMAND_LINE, said.template)
    ]
    assert named == []


def test_a_template_that_names_an_option_is_noticed() -> None:
    for template in (
        "Name the units, such as --units mm.",
        "Put them into the pen frame: lightpen pen.",
        "Read RAW.csv again.",
    ):
        assert re.search(OF_THE_COMMAND_LINE, template)


def test_what_to_type_answers_something_that_is_said() -> None:
    assert set(ADVICE) <= {said.code for said in everything()}
