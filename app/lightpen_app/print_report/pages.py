"""Page layout of a report: position of blocks, header and footer."""

from collections.abc import Sequence
from dataclasses import dataclass

from PySide6.QtCore import QCoreApplication, QRectF
from PySide6.QtGui import QPainter

from lightpen_app.look.theme import LIGHT
from lightpen_app.print_report.blocks import (
    MM,
    RIGHT,
    WIDTH,
    Block,
    PrintSize,
    draw_text,
    line_pen,
    text_width,
)

translate = QCoreApplication.translate

PAGE_WIDTH, PAGE_HEIGHT = 210 * MM, 297 * MM  # A4
LEFT_MARGIN = (PAGE_WIDTH - WIDTH) / 2
TOP, BOTTOM = 30 * MM, 22 * MM  # from the edges of the paper to what is on a page
ROOM = PAGE_HEIGHT - TOP - BOTTOM
HEADER, FOOTER = 11 * MM, 18 * MM  # from the upper and the lower edge
BADGE_PADDING = 40.0


@dataclass(frozen=True)
class PlacedBlock:
    """A block and its position below the top of the page, dots."""

    block: Block
    top: float


@dataclass(frozen=True)
class Margins:
    """Header and footer of every page."""

    title: str  # of the report
    subject: str
    number: str  # of the report
    badges: tuple[str, ...]  # prominent labels in capitals, such as SIMULATED
    foot: str


@dataclass(frozen=True)
class PrintReport:
    """All pages, ready to be drawn."""

    author: str  # author in the properties of the file; may be empty
    margins: Margins
    pages: tuple[tuple[PlacedBlock, ...], ...]

    @property
    def n_pages(self) -> int:
        """Number of pages."""
        return len(self.pages)


def lay_out(
    blocks: Sequence[Block], room: float = ROOM
) -> tuple[tuple[PlacedBlock, ...], ...]:
    """Return pieces on pages, in their order.

    Blocks that belong together begin on a new page if they do not fit as a whole. A
    piece higher than a page has one to itself.
    """
    pages: list[list[PlacedBlock]] = [[]]
    top = 0.0
    for group in _groups(blocks):
        height = sum(each.height + each.space for each in group)
        if pages[-1] and top + height > room:
            pages.append([])
            top = 0.0
            if group[0].head is not None:
                group = (group[0].head, *group)
        for block in group:
            top += block.space if pages[-1] else 0.0
            pages[-1].append(PlacedBlock(block, top))
            top += block.height
    return tuple(map(tuple, pages))


def paint_page(report: PrintReport, number: int, painter: QPainter) -> None:
    """Draw a page in dots, from the corner of the paper."""
    painter.save()
    painter.translate(LEFT_MARGIN, 0)
    _paint_header(report.margins, painter)
    _paint_footer(report, number, painter)
    for placed in report.pages[number - 1]:
        painter.save()
        painter.translate(0, TOP + placed.top)
        placed.block.paint(painter)
        painter.restore()
    painter.restore()


def _groups(blocks: Sequence[Block]) -> list[tuple[Block, ...]]:
    groups: list[tuple[Block, ...]] = []
    group: list[Block] = []
    for block in blocks:
        group.append(block)
        if not block.keeps:
            groups.append(tuple(group))
            group = []
    return [*groups, tuple(group)] if group else groups


def _paint_header(margins: Margins, painter: QPainter) -> None:
    title = QRectF(0, HEADER, WIDTH / 2, PrintSize.BODY)
    draw_text(painter, title, margins.title, PrintSize.BODY, bold=True)
    below = title.translated(0, 1.7 * PrintSize.BODY)
    draw_text(painter, below, margins.subject, PrintSize.BODY, LIGHT.muted)
    right = QRectF(WIDTH / 2, HEADER, WIDTH / 2, PrintSize.BODY)
    draw_text(painter, right, margins.number, PrintSize.BODY, LIGHT.muted, RIGHT)
    _paint_badges(margins.badges, painter)
    painter.setPen(line_pen(LIGHT.edge))
    line = round(HEADER + 3.6 * PrintSize.BODY)
    painter.drawLine(0, line, round(WIDTH), line)


def _paint_badges(badges: Sequence[str], painter: QPainter) -> None:
    """Draw framed badges from the right; their words do not depend on colour."""
    right, top = WIDTH, HEADER + 1.6 * PrintSize.BODY
    for text in reversed(badges):
        width = text_width(text, PrintSize.BODY, bold=True) + 2 * BADGE_PADDING
        frame = QRectF(right - width, top, width, 1.55 * PrintSize.BODY)
        painter.setPen(line_pen(LIGHT.bad, 10))
        painter.drawRect(frame)
        inner = frame.adjusted(BADGE_PADDING, 6, BADGE_PADDING, 0)
        draw_text(painter, inner, text, PrintSize.BODY, LIGHT.bad, bold=True)
        right -= width + BADGE_PADDING


def _paint_footer(report: PrintReport, number: int, painter: QPainter) -> None:
    top = PAGE_HEIGHT - FOOTER
    painter.setPen(line_pen(LIGHT.edge))
    painter.drawLine(0, round(top), round(WIDTH), round(top))
    area = QRectF(0, top + 25, WIDTH, PrintSize.SMALL)
    draw_text(painter, area, report.margins.foot, PrintSize.SMALL, LIGHT.muted)
    text = translate("paper", "Page {0} of {1}").format(number, report.n_pages)
    draw_text(painter, area, text, PrintSize.SMALL, LIGHT.text, RIGHT)
