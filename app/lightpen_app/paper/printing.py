"""The record of a calibration as pages, as PDF, and on a printer.

All three are drawn by the same strokes. The PDF is PDF/A-1b: fonts are in it, colours
are defined, and nothing outside of it is needed to show it in decades. Qt writes it, as
it draws the preview and reaches the printer; no other library is needed for it.
"""

from pathlib import Path

from PySide6.QtCore import QBuffer, QIODevice, QMarginsF
from PySide6.QtGui import (
    QPagedPaintDevice,
    QPageLayout,
    QPageSize,
    QPainter,
    QPdfWriter,
)

from lightpen.estimation.verdict import Grade
from lightpen.model.origin import Origin
from lightpen.record.exports import export_stem
from lightpen.record.retraced import Retraced
from lightpen.record.statement import Entered, Statement
from lightpen_app.look.phrases import grade_text, origin_text
from lightpen_app.paper.pages import Margins, Paper, lay_out, paint_page
from lightpen_app.paper.pieces import DOTS_AN_INCH
from lightpen_app.paper.sections import all_sections, title_text, translate

# Qt names it among the colours of each page and draws in none of it; PDF/A-1 has no
# place for it beside colours of a screen. Of equal length, as a PDF counts its bytes.
CMYK, IN_ITS_PLACE = b"/DeviceCMYK", b"/DeviceRGB "
NUMBER_LENGTH = 12  # digits of the SHA-256 that name a record
A4 = QPageLayout(
    QPageSize(QPageSize.PageSizeId.A4),
    QPageLayout.Orientation.Portrait,
    QMarginsF(0, 0, 0, 0),
)


def paper_of(
    statement: Statement, retraced: Retraced | None, entered: Entered | None = None
) -> Paper:
    """Return the pages of a record, in the language that is chosen.

    Parameters
    ----------
    retraced : Retraced or None
        The images of the statement; some plots are left out without.
    entered : Entered, optional
        Where in an archive the calibration is entered, if it is.
    """
    pieces = all_sections(statement, retraced, entered)
    return Paper(statement.names.operator, _margins(statement), lay_out(pieces))


def pdf_of(paper: Paper) -> bytes:
    """Return pages as PDF/A-1b."""
    buffer = QBuffer()
    buffer.open(QIODevice.OpenModeFlag.WriteOnly)
    writer = QPdfWriter(buffer)
    writer.setPdfVersion(QPagedPaintDevice.PdfVersion.PdfVersion_A1b)
    writer.setResolution(DOTS_AN_INCH)
    writer.setTitle(f"{paper.margins.title}, {paper.margins.subject}")
    writer.setAuthor(paper.author)
    writer.setCreator("Lightpen")
    paint_on(paper, writer)
    buffer.close()
    return bytes(buffer.data().data()).replace(CMYK, IN_ITS_PLACE)


def paint_on(paper: Paper, device: QPagedPaintDevice) -> None:
    """Draw all pages on a device that has pages, such as a printer."""
    device.setPageLayout(A4)
    painter = QPainter(device)
    times = device.logicalDpiX() / DOTS_AN_INCH
    painter.scale(times, times)
    for number in range(1, paper.n_pages + 1):
        if number > 1:
            device.newPage()
        paint_page(paper, number, painter)
    painter.end()


def paper_stem(statement: Statement) -> str:
    """Return what the name of its PDF begins with."""
    if statement.accepted is None:
        return Path(statement.file).stem
    return export_stem(statement.names, statement.accepted, statement.origin)


def _margins(statement: Statement) -> Margins:
    names = statement.names
    items = (each or "\u2013" for each in (names.pen, names.tip, names.cone))
    subject = translate("paper", "Pen {0}, tip {1}, cone {2}").format(*items)
    digits = statement.sha256[:NUMBER_LENGTH]
    number = " ".join(digits[i : i + 4] for i in range(0, NUMBER_LENGTH, 4))
    foot = translate("paper", "SHA-256 of the JSON file: {0}")
    return Margins(
        title=title_text(),
        subject=subject,
        number=translate("paper", "No. {0}").format(number),
        badges=_badges(statement),
        foot=foot.format(statement.sha256),
    )


def _badges(statement: Statement) -> tuple[str, ...]:
    """Return what nobody may miss: of what it is, its grade, whether it counts."""
    badges = []
    if statement.origin is not Origin.LIVE:
        badges.append(origin_text(statement.origin))
    if statement.grade is not Grade.PASS:
        badges.append(grade_text(statement.grade))
    if statement.accepted is None:
        badges.append(translate("paper", "NOT ACCEPTED"))
    return tuple(badges)
