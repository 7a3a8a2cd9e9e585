"""Page layout of a report: position of blocks, header and footer."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from PySide6.QtCore import QBuffer, QCoreApplication, QIODevice, QMarginsF, QRectF
from PySide6.QtGui import (
    QPagedPaintDevice,
    QPageLayout,
    QPageSize,
    QPainter,
    QPdfWriter,
)

from lightpen.estimation.reports.verdict import Grade
from lightpen.model.names import Laboratory, Origin
from lightpen.record.calibrations import CalibrationFile
from lightpen.record.exports import export_stem
from lightpen.record.library.entered_files import EntryPlace
from lightpen.record.recomputing import ReestimatedPoses
from lightpen_app.look.phrases import grade_text, origin_text
from lightpen_app.look.theme import LIGHT
from lightpen_app.print_report.blocks import (
    DOTS_AN_INCH,
    MM,
    RIGHT,
    WIDTH,
    Block,
    PrintSize,
    draw_text,
    line_pen,
    text_width,
)
from lightpen_app.print_report.calibration import calibration_blocks, status_words
from lightpen_app.print_report.template import record_number

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


# The calibration report as pages, as PDF, and on a printer.
#
# All three are drawn by the same strokes. The PDF is PDF/A-1b: fonts are in it, colours
# are defined, and nothing outside of it is needed to show it in decades. Qt writes it,
# as it draws the preview and reaches the printer; no other library is needed for it.


# Qt names it among the colours of each page and draws in none of it; PDF/A-1 has no
# place for it beside colours of a screen. Of equal length, as a PDF counts its bytes.
CMYK, IN_ITS_PLACE = b"/DeviceCMYK", b"/DeviceRGB "
A4 = QPageLayout(
    QPageSize(QPageSize.PageSizeId.A4),
    QPageLayout.Orientation.Portrait,
    QMarginsF(0, 0, 0, 0),
)


def print_report_of(
    calibration_file: CalibrationFile,
    reestimated: ReestimatedPoses | None,
    entered: EntryPlace | None = None,
    laboratory: Laboratory | None = None,
) -> PrintReport:
    """Return the pages of the report of a calibration, in the selected language.

    Without the reestimated images some plots are left out. ``entered`` is the archive
    entry of the calibration, the laboratory where it was made.
    """
    blocks = calibration_blocks(calibration_file, reestimated, entered, laboratory)
    return PrintReport(
        calibration_file.names.operator, _margins(calibration_file), lay_out(blocks)
    )


def pdf_of(
    report: PrintReport, progress: Callable[[float], None] = lambda fraction: None
) -> bytes:
    """Return pages as PDF/A-1b; ``progress`` is called as in `paint_on`."""
    buffer = QBuffer()
    buffer.open(QIODevice.OpenModeFlag.WriteOnly)
    writer = QPdfWriter(buffer)
    writer.setPdfVersion(QPagedPaintDevice.PdfVersion.PdfVersion_A1b)
    writer.setResolution(DOTS_AN_INCH)
    writer.setTitle(f"{report.margins.title}, {report.margins.subject}")
    writer.setAuthor(report.author)
    writer.setCreator("Lightpen")
    paint_on(report, writer, progress)
    buffer.close()
    return bytes(buffer.data().data()).replace(CMYK, IN_ITS_PLACE)


def paint_on(
    report: PrintReport,
    device: QPagedPaintDevice,
    progress: Callable[[float], None] = lambda fraction: None,
) -> None:
    """Draw all pages on a device that has pages, such as a printer.

    ``progress`` is called with the fraction done, 0 to 1; what it raises ends the work.
    """
    device.setPageLayout(A4)
    painter = QPainter(device)
    times = device.logicalDpiX() / DOTS_AN_INCH
    painter.scale(times, times)
    try:
        for number in range(1, report.n_pages + 1):
            if number > 1:
                device.newPage()
            paint_page(report, number, painter)
            progress(number / report.n_pages)
    finally:
        painter.end()


def report_stem(calibration_file: CalibrationFile) -> str:
    """Return the beginning of the default file name."""
    if calibration_file.accepted is None:
        return calibration_file.path.stem
    return export_stem(
        calibration_file.names, calibration_file.accepted, calibration_file.origin
    )


def _margins(calibration_file: CalibrationFile) -> Margins:
    names = calibration_file.names
    items = (each or "\u2013" for each in (names.pen, names.tip, names.cone))
    subject = translate("paper", "Pen {0}, tip {1}, cone {2}").format(*items)
    foot = translate("paper", "SHA-256 of the JSON file: {0}")
    return Margins(
        title=translate("paper", "Calibration report"),
        subject=subject,
        number=record_number(calibration_file.sha256),
        badges=_badges(calibration_file),
        foot=foot.format(calibration_file.sha256),
    )


def _badges(calibration_file: CalibrationFile) -> tuple[str, ...]:
    """Return the badges: origin, grade, acceptance, and status of pen and tip."""
    badges = []
    if calibration_file.origin is not Origin.LIVE:
        badges.append(origin_text(calibration_file.origin))
    if calibration_file.grade is not Grade.PASS:
        badges.append(grade_text(calibration_file.grade))
    if calibration_file.accepted is None:
        badges.append(translate("paper", "NOT ACCEPTED"))
    return (*badges, *status_words(calibration_file))
