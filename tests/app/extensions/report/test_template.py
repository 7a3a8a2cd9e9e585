"""The template of a report decides what is shown, in each language the same."""

import re
from collections.abc import Callable

import pytest
from PySide6.QtWidgets import QApplication

from lightpen_app.look.languages import own_name
from lightpen_app_extensions.report import template
from lightpen_app_extensions.report.template import (
    FIELD,
    REPORTS,
    SECTION,
    Content,
    Piece,
    condition,
    fill_template,
)
from lightpen_resources import languages

SHOWN = re.compile(r"^(:.*|\[.*\])$", re.MULTILINE)
Fill = Callable[[str, Content], tuple[Piece, ...]]


@pytest.fixture
def fill_lines(monkeypatch: pytest.MonkeyPatch, qapp: QApplication) -> Fill:
    """Return a function that fills lines of a template."""

    def filled(lines: str, content: Content) -> tuple[Piece, ...]:
        monkeypatch.setattr(template, "_sections", lambda _: {"lines": lines})
        return fill_template("lines", content)

    return filled


def n_lines(parts: tuple[Piece, ...]) -> int:
    return sum(part.html.count("<tr>") for part in parts)


def test_each_language_has_all_that_is_shown_in_the_same_order() -> None:
    texts = [(REPORTS / f"{each}.txt").read_text("utf-8") for each in languages()]

    assert len(texts) > 1
    for text in texts:
        assert SHOWN.findall(text) == SHOWN.findall(texts[0])
        lines, of_first = text.splitlines(), texts[0].splitlines()
        assert len(lines) == len(of_first)
        for line, first in zip(lines, of_first, strict=True):
            assert sorted(FIELD.findall(line)) == sorted(FIELD.findall(first))
            assert line.count("|") == first.count("|")


def test_the_template_is_that_of_the_language_of_the_texts() -> None:
    english = template._sections(own_name("en"))

    assert template._sections(own_name("fr")) == english  # without texts of its own
    assert template._sections(own_name("zh_CN")) != english
    assert list(english) == SECTION.findall((REPORTS / "en.txt").read_text("utf-8"))


def test_a_line_with_a_value_that_is_not_there_is_left_out(fill_lines: Fill) -> None:
    lines = ":facts 1\n{is_old}Age | {age}\nName | {name}"

    def n_rows(age: str | None, *, is_old: bool) -> int:
        texts = {"age": age, "name": "", "is_old": condition(is_old)}
        return n_lines(fill_lines(lines, Content(texts)))

    assert n_rows("9", is_old=True) == 2
    assert n_rows(None, is_old=True) == n_rows("9", is_old=False) == 1
    assert fill_lines("Age {age}", Content({"age": None})) == ()


def test_a_table_without_rows_is_left_out(fill_lines: Fill) -> None:
    lines = ":table ages 1 >2\nName | Age\n{last}Last | {age}"
    texts = {"last": None, "age": "9"}

    assert fill_lines(lines, Content(texts)) == ()
    rows = {"ages": [("Ann", "9"), ("Ben", "8")]}
    assert n_lines(fill_lines(lines, Content(texts, rows))) == 3
    assert n_lines(fill_lines(lines, Content({**texts, "last": ""}, rows))) == 4


def test_what_is_kept_stands_on_one_page(fill_lines: Fill) -> None:
    parts = fill_lines("A\n\n:keep\n\nB\n\n:free\n\nC", Content({}))

    assert [part.keeps for part in parts] == [False, True, False]


def test_an_unknown_command_or_name_is_a_mistake(fill_lines: Fill) -> None:
    with pytest.raises(ValueError, match=":chart"):
        fill_lines(":chart 50 misfits", Content({}))
    with pytest.raises(KeyError, match="age"):
        fill_lines("Age {age}", Content({}))
