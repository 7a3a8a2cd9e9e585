"""The pages of a report: a document with a header and a footer on each page.

Preview, PDF and printer show the same document. The PDF is PDF/A-1b: fonts are in it,
colours are defined, and nothing outside of it is needed to show it in decades.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cache
from itertools import pairwise
from string import Template

from PySide6.QtCore import (
    QBuffer,
    QCoreApplication,
    QIODevice,
    QMarginsF,
    QRect,
    QRectF,
    QSizeF,
    Qt,
)
from PySide6.QtGui import (
    QAbstractTextDocumentLayout,
    QColor,
    QPagedPaintDevice,
    QPageLayout,
    QPageSize,
    QPainter,
    QPdfWriter,
    QPen,
    QPyTextObject,
    QTextBlock,
    QTextBlockFormat,
    QTextCursor,
    QTextDocument,
    QTextFormat,
)
from typing_extensions import override

from lightpen_app.look.theme import LIGHT
from lightpen_app.look.words import BREAK
from lightpen_app_extensions.report.template import (
    ANCHOR,
    MM,
    REPORTS,
    WIDTH,
    Drawn,
    Piece,
    PrintSize,
    markup,
    print_font,
)

translate = QCoreApplication.translate

DOTS_AN_INCH = 720
PAGE_WIDTH, PAGE_HEIGHT = 210 * MM, 297 * MM  # A4
LEFT_MARGIN = (PAGE_WIDTH - WIDTH) / 2
TOP, BOTTOM = 30 * MM, 22 * MM  # from the edges of the paper to what is on a page
ROOM = PAGE_HEIGHT - TOP - BOTTOM
HEADER, FOOTER = 11 * MM, 18 * MM  # from the upper and the lower edge
LINE = 155.0  # between the lines of the header
KEEP, WITH = "keep", "with"  # first of what stands on one page, and the others


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
    """All that is on the pages."""

    author: str  # author in the properties of the file; may be empty
    margins: Margins
    parts: tuple[Piece, ...]


class _Plots(QPyTextObject):
    """Draws the plots of a document in the places of images."""

    def __init__(self, document: QTextDocument, plots: Mapping[str, Drawn]) -> None:
        super().__init__(document)
        self._plots = plots
        image = QTextFormat.ObjectTypes.ImageObject
        document.documentLayout().registerHandler(image, self)

    @override
    def intrinsicSize(
        self, doc: QTextDocument, posInDocument: int, format: QTextFormat
    ) -> QSizeF:
        image = format.toImageFormat()
        return QSizeF(image.width(), image.height())

    @override
    def drawObject(
        self,
        painter: QPainter,
        rect: QRectF | QRect,
        doc: QTextDocument,
        posInDocument: int,
        format: QTextFormat,
    ) -> None:
        painter.save()
        painter.translate(QRectF(rect).topLeft())
        self._plots[format.toImageFormat().name()].paint(painter, rect.width())
        painter.restore()


def lay_out(parts: Sequence[Piece]) -> QTextDocument:
    """Return parts as a document with pages of `WIDTH` and `ROOM`, in dots.

    Parts that belong together begin on a new page if they do not fit as a whole.
    """
    document = _document()
    _Plots(document, {n: plot for part in parts for n, plot in part.plots.items()})
    document.setHtml("".join(_anchored(parts)))
    document.setPageSize(QSizeF(WIDTH, ROOM))
    for first, last in list(_kept(document)):
        top, bottom = _place(document, first).top(), _place(document, last).bottom()
        if top // ROOM != (bottom - 1) // ROOM and bottom - top <= ROOM:
            begins = QTextBlockFormat()
            begins.setPageBreakPolicy(QTextFormat.PageBreakFlag.PageBreak_AlwaysBefore)
            QTextCursor(first).mergeBlockFormat(begins)
            document.setPageSize(QSizeF())  # else parts of the old pages remain
            document.setPageSize(QSizeF(WIDTH, ROOM))
    return document


def _document() -> QTextDocument:
    """Return a document without content, in the style of the reports."""
    document = QTextDocument()
    document.setUseDesignMetrics(True)
    document.setDocumentMargin(0)
    document.setDefaultFont(print_font(PrintSize.BODY))
    document.setDefaultStyleSheet(_style_sheet())
    return document


def paint_page(
    report: PrintReport, document: QTextDocument, number: int, painter: QPainter
) -> None:
    """Draw a page of the laid out report, in dots from the corner of the paper."""
    painter.save()
    painter.translate(LEFT_MARGIN, 0)
    _paint_margins(report.margins, number, document.pageCount(), painter)
    shown = QRectF(0, (number - 1) * ROOM, WIDTH, ROOM)
    painter.translate(0, TOP - shown.top())
    for block in _blocks(document):
        place = _place(document, block)
        is_shown = shown.top() < place.bottom() <= shown.bottom()
        if block.blockFormat().headingLevel() == 2 and is_shown:
            painter.setPen(_line_pen(LIGHT.accent, 10))
            line = round(place.bottom() + 10)
            painter.drawLine(0, line, round(WIDTH), line)
    context = QAbstractTextDocumentLayout.PaintContext()
    context.clip = shown
    painter.setClipRect(shown)
    document.documentLayout().draw(painter, context)
    painter.restore()


@cache
def _style_sheet() -> str:
    """Return the style sheet of resources, filled in."""
    template = Template((REPORTS / "report.css").read_text("utf-8"))
    sizes = {f"size_{each.name.lower()}": str(each.value) for each in PrintSize}
    return template.substitute(asdict(LIGHT), **sizes)


def _anchored(parts: Iterable[Piece]) -> Iterator[str]:
    """Yield the HTML of the parts, with anchors where they are kept together."""
    for before, part in pairwise((Piece(""), *parts)):
        name = WITH if before.keeps else KEEP if part.keeps else ""
        # An anchor parts its letter from a word, so it has one that is not seen.
        anchor = f'<a name="{name}"></a>{BREAK}' if name else ""
        yield part.html.replace(ANCHOR, anchor)


def _kept(document: QTextDocument) -> Iterator[tuple[QTextBlock, QTextBlock]]:
    """Yield the first and the last block of what is kept together."""
    first = last = None
    for block in _blocks(document):
        names = {n for each in block.textFormats() for n in each.format.anchorNames()}
        if KEEP in names:
            if first is not None and last is not None:
                yield first, last
            first, last = block, None
        elif WITH in names:
            last = block
    if first is not None and last is not None:
        yield first, last


def _blocks(document: QTextDocument) -> Iterator[QTextBlock]:
    block = document.begin()
    while block.isValid():
        yield block
        block = block.next()


def _place(document: QTextDocument, block: QTextBlock) -> QRectF:
    return document.documentLayout().blockBoundingRect(block)


def _line_pen(color: str, width: float = 5.0) -> QPen:
    pen = QPen(QColor(color), width)
    pen.setCapStyle(Qt.PenCapStyle.FlatCap)
    return pen


def _paint_margins(
    margins: Margins, number: int, n_pages: int, painter: QPainter
) -> None:
    """Draw header and footer, apart from the page by lines."""
    # Badges have a frame: their words do not depend on colour.
    badges = "".join(f'<td class="badge">{markup(e)}</td>' for e in margins.badges)
    pages = translate("paper", "Page {0} of {1}").format(number, n_pages)
    bottom = PAGE_HEIGHT - FOOTER
    for top, kind, left, right in (
        (HEADER, "title", markup(margins.title), markup(margins.number)),
        (HEADER + LINE, "subject", markup(margins.subject), ""),
        (bottom + LINE / 6, "foot", markup(margins.foot), markup(pages)),
    ):
        _paint_html(
            f'<table width="100%" cellspacing="0"><tr><td class="{kind}">{left}</td>'
            f'<td class="margin {kind}" align="right">{right}</td></tr></table>',
            *(top, painter),
        )
    frames = f'<table align="right" cellspacing="40"><tr>{badges}</tr></table>'
    _paint_html(frames, HEADER + 0.7 * LINE, painter)
    painter.setPen(_line_pen(LIGHT.edge))
    for line in (HEADER + 2.2 * LINE, bottom):
        painter.drawLine(0, round(line), round(WIDTH), round(line))


def _paint_html(html: str, top: float, painter: QPainter) -> None:
    document = _document()
    document.setHtml(html)
    document.setTextWidth(WIDTH)
    painter.save()
    painter.translate(0, top)
    document.drawContents(painter)
    painter.restore()


# Qt names it among the colours of each page and draws in none of it; PDF/A-1 has no
# place for it beside colours of a screen. Of equal length, as a PDF counts its bytes.
CMYK, IN_ITS_PLACE = b"/DeviceCMYK", b"/DeviceRGB "
A4 = QPageLayout(
    QPageSize(QPageSize.PageSizeId.A4),
    QPageLayout.Orientation.Portrait,
    QMarginsF(0, 0, 0, 0),
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
    document = lay_out(report.parts)
    painter = QPainter(device)
    times = device.logicalDpiX() / DOTS_AN_INCH
    painter.scale(times, times)
    try:
        for number in range(1, document.pageCount() + 1):
            if number > 1:
                device.newPage()
            paint_page(report, document, number, painter)
            progress(number / document.pageCount())
    finally:
        painter.end()
