"""Where parts stand on pages."""

from collections.abc import Iterator
from dataclasses import replace

import pytest
from PySide6.QtGui import QTextDocument

from lightpen_app.look.words import unbroken
from lightpen_app.widgets.figure import Axes
from lightpen_app.widgets.result_plots import BarPlot
from lightpen_app_extensions.report.pages import ROOM, lay_out
from lightpen_app_extensions.report.template import Piece, chart, paragraph, table

pytestmark = pytest.mark.usefixtures("qapp")
N_LINES = 44  # paragraphs of a line that fit on a page


def lines(n: int) -> tuple[Piece, ...]:
    return tuple(paragraph(f"line {i}") for i in range(n))


def pages_of(document: QTextDocument) -> Iterator[tuple[str, int]]:
    """Yield what stands in the document, and on which page, from 0."""
    block = document.begin()
    while block.isValid():
        place = document.documentLayout().blockBoundingRect(block)
        yield unbroken(block.text()), int((place.bottom() - 1) // ROOM)
        block = block.next()


def test_parts_go_on_on_the_next_page() -> None:
    found = dict(pages_of(lay_out(lines(2 * N_LINES))))

    assert found["line 0"] == 0
    assert found[f"line {2 * N_LINES - 1}"] > 0


@pytest.mark.parametrize("n_before", range(N_LINES - 6, N_LINES + 2))
def test_a_heading_is_on_the_page_of_what_follows(n_before: int) -> None:
    rows = [(str(i), "0.003") for i in range(9)]
    leds = table(["LED", "rms"], ["1", ">1"], rows)
    parts = (*lines(n_before), paragraph("LEDs", "# "), *leds, *lines(2))

    found = list(pages_of(lay_out(parts)))

    pages = dict(found)
    assert pages["LEDs"] == pages["LED"] == pages["0"]
    at = found.index(("LEDs", pages["LEDs"]))
    assert [text for text, _ in found[:at] if text][-1] == f"line {n_before - 1}"
    assert [page for _, page in found] == sorted(page for _, page in found)


def test_what_is_kept_stands_on_one_page() -> None:
    kept = [replace(paragraph(f"kept {i}"), keeps=True) for i in range(9)]

    found = dict(pages_of(lay_out([*lines(N_LINES - 4), *kept, paragraph("end")])))

    assert found["kept 0"] == found["kept 8"] == found["end"] == 1
    assert found[f"line {N_LINES - 5}"] == 0


def test_the_head_of_a_table_is_repeated_where_it_goes_on() -> None:
    rows = [(str(i),) for i in range(3 * N_LINES)]

    document = lay_out(table(["LED"], ["1"], rows))

    assert document.pageCount() > 1
    (frame,) = document.rootFrame().childFrames()
    assert frame.format().toTableFormat().headerRowCount() == 1


def test_plots_are_as_wide_and_high_as_stated() -> None:
    plot = BarPlot(Axes("tip"), ("x",))
    document = lay_out([chart("tip", plot, 1000.0)])

    assert document.documentLayout().documentSize().height() >= 1000
    assert document.pageCount() == 1
