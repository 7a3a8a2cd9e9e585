"""A record on paper, and the words on its pages."""

from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
from benchmarks.small_records import record_of
from PySide6.QtCore import QBuffer, QSize
from PySide6.QtGui import QPainter, QTextDocument
from PySide6.QtSvg import QSvgGenerator

from lightpen.estimation.reports.verdict import Grade
from lightpen.formats.files import write_whole
from lightpen.formats.own_json import StoredMessage
from lightpen.messages import Code, message
from lightpen.model.names import Laboratory, Origin
from lightpen.record.calibrations import TracedItem, read_calibration
from lightpen.record.library.entered_files import EntryPlace
from lightpen.record.results.results import Result, result_bytes
from lightpen.record.swings.header import Names
from lightpen_app.look.words import BREAK
from lightpen_app_extensions.report.content import ReportContent, print_report_of
from lightpen_app_extensions.report.pages import (
    PAGE_HEIGHT,
    PAGE_WIDTH,
    PrintReport,
    lay_out,
    paint_page,
)

SVG = "{http://www.w3.org/2000/svg}text"


def _words_on(paper: PrintReport, document: QTextDocument, number: int) -> list[str]:
    """Return what is written on a page, each line of it."""
    buffer = QBuffer()
    generator = QSvgGenerator()
    generator.setOutputDevice(buffer)
    generator.setSize(QSize(round(PAGE_WIDTH), round(PAGE_HEIGHT)))
    painter = QPainter(generator)
    paint_page(paper, document, number, painter)
    painter.end()
    tree = ElementTree.fromstring(buffer.data().data())
    texts = ["".join(each.itertext()).strip() for each in tree.iter(SVG)]
    return [text for text in texts if text != BREAK]


@pytest.fixture
def result(stated: dict[str, Any]) -> Result:
    """Return an accepted result of a live camera that passed."""
    return Result(
        names=Names("Hall 3", "Ann", "LP-04", "T-10", "C-1", 3.0005),
        accepted=datetime(2026, 1, 2, 12, tzinfo=UTC),
        grade=Grade.PASS,
        record=Path("records", "1"),
        images=(1, 2),
        calibration=record_of(stated),
        origin=Origin.LIVE,
    )


@pytest.fixture
def doubted(result: Result) -> Result:
    """Return one of a recording that was accepted with a reason."""
    reported = message(
        Code.TIP_CHANGED,
        distance=0.0312,
        date="2026-01-01",
        axis="y",
        difference=0.0301,
        uncertainty=0.0142,
    )
    return replace(
        result,
        grade=Grade.CHECK,
        origin=Origin.RECORDED,
        why=StoredMessage.of(reported),
        reason="New ball mounted.",
    )


@pytest.fixture
def printed(tmp_path: Path) -> Callable[..., PrintReport]:
    """Return a function that writes a result and puts what it states on paper."""

    def put_on_paper(
        result: Result,
        entered: EntryPlace | None = None,
        traced: tuple[TracedItem, ...] = (),
        laboratory: Laboratory | None = None,
        status: tuple[str, ...] = (),
    ) -> PrintReport:
        path = tmp_path / "000017.json"
        write_whole(path, result_bytes(result, "records/1"))
        calibration_file = replace(
            read_calibration(path), traced=traced, library_status=status
        )
        return print_report_of(ReportContent(calibration_file, entered, laboratory))

    return put_on_paper


@pytest.fixture
def words() -> Callable[[PrintReport], list[list[str]]]:
    """Return a function that reads what is written on each page, line by line."""

    def read(paper: PrintReport) -> list[list[str]]:
        document = lay_out(paper.parts)
        numbers = range(1, document.pageCount() + 1)
        return [_words_on(paper, document, number) for number in numbers]

    return read
