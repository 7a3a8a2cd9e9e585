"""Blocks of a page: headings, paragraphs, tables and figures.

A block stands whole on one page. Lengths are in dots, ten to a point, so that text is
measured as printed.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import IntEnum
from functools import cache

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import (
    QColor,
    QFont,
    QFontMetricsF,
    QPainter,
    QPen,
    QTextLayout,
    QTextOption,
)

from lightpen_app.look.theme import LIGHT, font

DOTS_AN_INCH = 720
MM = DOTS_AN_INCH / 25.4  # in dots
WIDTH = 178 * MM  # of what is on a page
LEADING = 1.35  # times the size of the font
BASELINE = 1.05  # below the top of a line, times the size, whatever letters are in it
PADDING = 10.0  # above and below the words of a row
GUTTER = 60.0  # between columns
HAIRLINE = 5.0
LINE_END = "\u2028"  # within a paragraph
LEFT, RIGHT, CENTER = (
    Qt.AlignmentFlag.AlignLeft,
    Qt.AlignmentFlag.AlignRight,
    Qt.AlignmentFlag.AlignHCenter,
)


class PrintSize(IntEnum):
    """Sizes of letters, dots."""

    SMALL = 68
    BODY = 82
    HEADING = 108
    TITLE = 190


@dataclass(frozen=True)
class Block:
    """A part of a report that is not split across pages."""

    # Draws it with its upper left corner at the origin.
    paint: Callable[[QPainter], None]
    height: float  # dots
    space: float = 0.0  # above it, but for the first of a page, dots
    keeps: bool = False  # whether the next block is kept on the same page
    head: "Block | None" = None  # repeated at the top of each page


@dataclass(frozen=True)
class Column:
    """A column of a table."""

    title: str
    share: float = 1.0  # relative width of the column
    align: Qt.AlignmentFlag = LEFT


def print_font(size: float, *, bold: bool = False) -> QFont:
    """Return the program's font for printing, without screen hinting."""
    result = font(float(size), bold=bold)
    result.setHintingPreference(QFont.HintingPreference.PreferNoHinting)
    return result


def heading(text: str) -> Block:
    """Return the heading of a section, over a line; kept with the next block."""
    size = PrintSize.HEADING
    height = LEADING * size

    def paint(painter: QPainter) -> None:
        draw_text(painter, QRectF(0, 0, WIDTH, height), text, size, bold=True)
        painter.setPen(line_pen(LIGHT.accent, 2 * HAIRLINE))
        painter.drawLine(0, round(height + 10), round(WIDTH), round(height + 10))

    return Block(paint, height + 40, space=190, keeps=True)


def subheading(text: str) -> Block:
    """Return the heading of a subsection; kept with the next block."""
    return replace(paragraph(text, bold=True), space=110, keeps=True)


def paragraph(
    text: str,
    size: float = PrintSize.BODY,
    color: str = LIGHT.text,
    *,
    bold: bool = False,
) -> Block:
    """Return words in as many lines as they need."""
    height = text_height(text, size, WIDTH, bold=bold)

    def paint(painter: QPainter) -> None:
        area = QRectF(0, 0, WIDTH, height)
        draw_text(painter, area, text, size, color, bold=bold)

    return Block(paint, height, space=45)


def facts(rows: Sequence[tuple[str, str]], n_columns: int = 2) -> tuple[Block, ...]:
    """Return names with their values, side by side in columns."""
    width = (WIDTH - (n_columns - 1) * GUTTER) / n_columns
    name_width = min(0.44 * width, 1100.0)
    value_width = width - name_width - GUTTER / 2

    def line(cells: Sequence[tuple[str, str]]) -> Block:
        height = max(
            max(
                text_height(name, PrintSize.BODY, name_width),
                text_height(value, PrintSize.BODY, value_width),
            )
            for name, value in cells
        )

        def paint(painter: QPainter) -> None:
            for i, (name, value) in enumerate(cells):
                left = i * (width + GUTTER)
                area = QRectF(left, PADDING, name_width, height)
                draw_text(painter, area, name, PrintSize.BODY, LIGHT.muted)
                area = QRectF(
                    left + name_width + GUTTER / 2, PADDING, value_width, height
                )
                draw_text(painter, area, value, PrintSize.BODY)

        return Block(paint, height + 2 * PADDING)

    starts = range(0, len(rows), n_columns)
    return tuple(line(rows[i : i + n_columns]) for i in starts)


def table(
    columns: Sequence[Column],
    rows: Sequence[Sequence[str]],
    *,
    strong: Sequence[int] = (),
    size: float = PrintSize.BODY,
) -> tuple[Block, ...]:
    """Return a table whose header is repeated on each page; strong rows are bold."""
    if not rows:
        return ()
    widths = _widths(columns)
    head = replace(
        _row(columns, widths, [each.title for each in columns], size, is_head=True),
        keeps=True,
        space=60,
    )
    lines = [
        replace(
            _row(columns, widths, cells, size, bold=i in strong),
            head=head,
            keeps=i + 1 < len(rows) and i in (0, len(rows) - 2),  # none stands alone
        )
        for i, cells in enumerate(rows)
    ]
    return (head, *lines)


def draw_text(
    painter: QPainter,
    area: QRectF,
    text: str,
    size: float,
    color: str = LIGHT.text,
    align: Qt.AlignmentFlag = LEFT,
    *,
    bold: bool = False,
) -> None:
    """Draw words from the top of an area on, in lines of its width."""
    painter.setPen(QColor(color))
    lines = _lines(text, size, area.width(), align, bold=bold)
    lines.draw(painter, area.topLeft())


def text_height(text: str, size: float, width: float, *, bold: bool = False) -> float:
    """Return the height of a text wrapped to a width, dots."""
    return LEADING * size * _lines(text, size, width, LEFT, bold=bold).lineCount()


def text_width(text: str, size: float, *, bold: bool = False) -> float:
    """Return the width of a text in one line, dots."""
    shown = printed_text(text)
    return QFontMetricsF(print_font(size, bold=bold)).horizontalAdvance(shown)


def printed_text(text: str) -> str:
    """Return a text with characters missing in all fonts replaced by their codes."""
    if text.isascii():
        return text
    return "".join(map(_printed, text))


@cache
def _printed(character: str) -> str:
    metrics = QFontMetricsF(print_font(PrintSize.BODY))
    if character.isspace() or metrics.inFontUcs4(ord(character)):
        return character
    return f"[U+{ord(character):04X}]"


def line_pen(color: str, width: float = HAIRLINE) -> QPen:
    """Return a pen for lines, dots wide."""
    pen = QPen(QColor(color), width)
    pen.setCapStyle(Qt.PenCapStyle.FlatCap)
    return pen


def _lines(
    text: str, size: float, width: float, align: Qt.AlignmentFlag, *, bold: bool
) -> QTextLayout:
    """Return words in lines; a word longer than a line is parted."""
    option = QTextOption(align)
    option.setWrapMode(QTextOption.WrapMode.WrapAtWordBoundaryOrAnywhere)
    words = printed_text(text).replace("\n", LINE_END)
    layout = QTextLayout(words, print_font(size, bold=bold))
    layout.setTextOption(option)
    layout.beginLayout()
    top = 0.0
    while (line := layout.createLine()).isValid():
        line.setLineWidth(width)
        line.setPosition(QPointF(0, top + BASELINE * size - line.ascent()))
        top += LEADING * size
    layout.endLayout()
    return layout


def _widths(columns: Sequence[Column]) -> list[float]:
    room = WIDTH - GUTTER * (len(columns) - 1)
    whole = sum(each.share for each in columns)
    return [room * each.share / whole for each in columns]


def _row(
    columns: Sequence[Column],
    widths: Sequence[float],
    cells: Sequence[str],
    size: float,
    *,
    is_head: bool = False,
    bold: bool = False,
) -> Block:
    color = LIGHT.muted if is_head else LIGHT.text
    heights = [
        text_height(text, size, width, bold=bold)
        for text, width in zip(cells, widths, strict=True)
    ]
    height = max(heights) + 2 * PADDING
    lefts = [0.0]
    for width in widths:
        lefts.append(lefts[-1] + width + GUTTER)

    def paint(painter: QPainter) -> None:
        for column, left, width, text in zip(
            columns, lefts[:-1], widths, cells, strict=True
        ):
            area = QRectF(left, PADDING, width, height)
            draw_text(painter, area, text, size, color, column.align, bold=bold)
        painter.setPen(line_pen(LIGHT.edge if is_head else LIGHT.line))
        painter.drawLine(0, round(height), round(WIDTH), round(height))

    return Block(paint, height)
