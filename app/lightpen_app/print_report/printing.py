"""The calibration report as pages, as PDF, and on a printer.

All three are drawn by the same strokes. The PDF is PDF/A-1b: fonts are in it, colours
are defined, and nothing outside of it is needed to show it in decades. Qt writes it, as
it draws the preview and reaches the printer; no other library is needed for it.
"""

from PySide6.QtCore import QBuffer, QCoreApplication, QIODevice, QMarginsF
from PySide6.QtGui import (
    QPagedPaintDevice,
    QPageLayout,
    QPageSize,
    QPainter,
    QPdfWriter,
)

from lightpen.estimation.reports.verdict import Grade
from lightpen.model.laboratory import Laboratory
from lightpen.model.origin import Origin
from lightpen.record.calibrations.calibrations import CalibrationFile
from lightpen.record.calibrations.reestimated_poses import ReestimatedPoses
from lightpen.record.exports.exports import export_stem
from lightpen.record.library.entered_files import EntryPlace
from lightpen_app.look.phrases import grade_text, origin_text
from lightpen_app.print_report.blocks import DOTS_AN_INCH
from lightpen_app.print_report.calibration import calibration_blocks, status_words
from lightpen_app.print_report.common import record_number
from lightpen_app.print_report.pages import Margins, PrintReport, lay_out, paint_page

translate = QCoreApplication.translate

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


def pdf_of(report: PrintReport) -> bytes:
    """Return pages as PDF/A-1b."""
    buffer = QBuffer()
    buffer.open(QIODevice.OpenModeFlag.WriteOnly)
    writer = QPdfWriter(buffer)
    writer.setPdfVersion(QPagedPaintDevice.PdfVersion.PdfVersion_A1b)
    writer.setResolution(DOTS_AN_INCH)
    writer.setTitle(f"{report.margins.title}, {report.margins.subject}")
    writer.setAuthor(report.author)
    writer.setCreator("Lightpen")
    paint_on(report, writer)
    buffer.close()
    return bytes(buffer.data().data()).replace(CMYK, IN_ITS_PLACE)


def paint_on(report: PrintReport, device: QPagedPaintDevice) -> None:
    """Draw all pages on a device that has pages, such as a printer."""
    device.setPageLayout(A4)
    painter = QPainter(device)
    times = device.logicalDpiX() / DOTS_AN_INCH
    painter.scale(times, times)
    for number in range(1, report.n_pages + 1):
        if number > 1:
            device.newPage()
        paint_page(report, number, painter)
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
