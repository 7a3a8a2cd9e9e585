"""The template of a report decides what is shown, in each language the same."""

import math
import re
from collections.abc import Callable
from datetime import UTC, datetime
from typing import Any

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
        lines, first_lines = text.splitlines(), texts[0].splitlines()
        assert len(lines) == len(first_lines)
        for line, first in zip(lines, first_lines, strict=True):
            fields, of_first = (
                sorted((path, form) for path, form, _ in FIELD.findall(each))
                for each in (line, first)
            )
            assert fields == of_first
            assert line.count("|") == first.count("|")


def test_the_template_is_that_of_the_language_of_the_texts() -> None:
    english = template._sections(own_name("en"))

    assert template._sections(own_name("fr")) == english  # without texts of its own
    assert template._sections(own_name("zh_CN")) != english
    assert list(english) == SECTION.findall((REPORTS / "en.txt").read_text("utf-8"))


def test_a_line_with_a_value_that_is_not_there_is_left_out(fill_lines: Fill) -> None:
    lines = ":facts 1\n{is_old:=True}Age | {age}\nName | {name}"

    def n_rows(age: float | None, *, is_old: bool) -> int:
        values = {"age": age, "name": "", "is_old": is_old}
        return n_lines(fill_lines(lines, Content([values])))

    assert n_rows(9, is_old=True) == 2
    assert n_rows(None, is_old=True) == n_rows(9, is_old=False) == 1
    assert n_rows(math.nan, is_old=True) == 1
    assert fill_lines("Age {age}", Content([{"age": None}])) == ()


def test_a_table_without_rows_is_left_out(fill_lines: Fill) -> None:
    lines = ":table 1 >2\nName | Age\n@people {it.name} | {it.age}\nLast | {age}"
    people = [{"name": "Ann", "age": 9}, {"name": "Ben", "age": 8}]

    def n_rows(**values: Any) -> int:
        return n_lines(fill_lines(lines, Content([values])))

    assert n_rows(people=[], age=None) == 0
    assert n_rows(people=people, age=None) == 3
    assert n_rows(people=people, age=9) == 4


def html(parts: tuple[Piece, ...]) -> str:
    (part,) = parts
    return re.sub("<.*?>", " ", part.html)


def test_values_are_shown_as_stated(fill_lines: Fill) -> None:
    values = {
        "tip": [1.23456, -0.00001],
        "u": [0.012, 0.12],
        "length": 2.0,
        "unknown": None,
        "day": datetime(2026, 1, 2, 3, tzinfo=UTC),
    }

    def shown(line: str) -> list[str]:
        return html(fill_lines(line, Content([values]))).split()

    assert shown(":table 1 1 1\na | b | c\nTip | {tip:by u}")[4:] == ["1.235", "0.00"]
    assert shown("{length:.3f mm} {unknown:.1f?none}") == ["2.000", "mm", "none"]
    assert shown("{day:%d.%m.} {day}") == ["02.01.", "2026-01-02", "03:00:00+00:00"]


def test_a_row_is_bold_where_a_value_is_as_stated(fill_lines: Fill) -> None:
    lines = ":table 1\nName\n@people {it.grade:*bad}{it.name}"
    people = [{"name": "Ann", "grade": "bad"}, {"name": "Ben", "grade": "good"}]

    (part,) = fill_lines(lines, Content([{"people": people}]))

    strong = re.findall(r'class="strong[^>]*>(?:<a></a>)?(\w+)', part.html)
    assert (strong, "Ben" in part.html) == (["Ann"], True)


def test_what_is_kept_stands_on_one_page(fill_lines: Fill) -> None:
    parts = fill_lines("A\n\n:keep\n\nB\n\n:free\n\nC", Content(()))

    assert [part.keeps for part in parts] == [False, True, False]


def test_an_unknown_command_or_name_is_a_mistake(fill_lines: Fill) -> None:
    with pytest.raises(ValueError, match=":chart"):
        fill_lines(":charts 50 misfits", Content(()))
    with pytest.raises(KeyError, match="age"):
        fill_lines("Age {age}", Content(()))
