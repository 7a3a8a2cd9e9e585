"""A record on paper, and the words on its pages."""

from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
from PySide6.QtCore import QBuffer, QSize
from PySide6.QtGui import QPainter
from PySide6.QtSvg import QSvgGenerator

from lightpen.formats.files import write_whole
from lightpen.model.origin import Origin
from lightpen.record.names import Names
from lightpen.record.results import Result, Why, result_bytes
from lightpen.record.retraced import retrace
from lightpen.record.statement import Entered, read_statement
from lightpen_app.paper.pages import PAGE_HEIGHT, PAGE_WIDTH, Paper, paint_page
from lightpen_app.paper.printing import paper_of

SVG = "{http://www.w3.org/2000/svg}text"


def _words_on(paper: Paper, number: int) -> list[str]:
    """Return what is written on a page, each line of it."""
    buffer = QBuffer()
    generator = QSvgGenerator()
    generator.setOutputDevice(buffer)
    generator.setSize(QSize(round(PAGE_WIDTH), round(PAGE_HEIGHT)))
    painter = QPainter(generator)
    paint_page(paper, number, painter)
    painter.end()
    tree = ElementTree.fromstring(buffer.data().data())
    return ["".join(each.itertext()).strip() for each in tree.iter(SVG)]


@pytest.fixture
def result(stated: dict[str, Any]) -> Result:
    """Return an accepted result of a live camera that passed."""
    return Result(
        names=Names("Hall 3", "Ann", "LP-04", "T-10", "C-1", 3.0005),
        accepted=datetime(2026, 1, 2, 12, tzinfo=UTC),
        grade="pass",
        record=Path("records", "1"),
        images=(1, 2),
        calibration=stated,
        origin=Origin.LIVE,
    )


@pytest.fixture
def doubted(result: Result) -> Result:
    """Return one of a recording that was accepted with a reason."""
    text = (
        "The tip lies 0.0312 mm from that of 2026-01-01: along y 0.0301 mm, where U "
        "(k = 2) of both explains 0.0142 mm. Was it exchanged, bent, or mounted anew?"
    )
    return replace(
        result,
        grade="check",
        origin=Origin.RECORDED,
        why=Why("verdict.tip-changed", text),
        reason="New ball mounted.",
    )


@pytest.fixture
def printed(tmp_path: Path) -> Callable[..., Paper]:
    """Return a function that writes a result and puts what it states on paper."""

    def put_on_paper(result: Result, entered: Entered | None = None) -> Paper:
        path = tmp_path / "000017.json"
        write_whole(path, result_bytes(result, "records/1"))
        statement = read_statement(path)
        return paper_of(statement, retrace(statement.calibration), entered)

    return put_on_paper


@pytest.fixture
def words() -> Callable[[Paper], list[list[str]]]:
    """Return a function that reads what is written on each page, line by line."""

    def read(paper: Paper) -> list[list[str]]:
        return [_words_on(paper, number) for number in range(1, paper.n_pages + 1)]

    return read
