"""Opens the report of a result file in its own window."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import NamedTuple, TypeVar

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QCloseEvent
from PySide6.QtPrintSupport import QPrintDialog, QPrinter, QPrintPreviewWidget
from PySide6.QtWidgets import QDialog, QGraphicsView, QWidget
from typing_extensions import override

from lightpen.archive.logbook import entry_of_file
from lightpen.formats.files import write_whole
from lightpen.formats.opened_files import InputFile, with_content
from lightpen.local_time import local_now
from lightpen.record.calibrations import (
    CalibrationFile,
    TracedItem,
    certified_values,
    read_calibration,
    traced_items,
    with_status,
)
from lightpen.record.folder import (
    StoredVerification,
    data_folder_of_verification,
    read_verification,
)
from lightpen.record.library.entered_files import EntryPlace
from lightpen.record.library.tip_library import Library, read_library
from lightpen.record.swings.header import Names
from lightpen_app.face import ReportPrinter
from lightpen_app.look.layouts import horizontal_layout, vertical_layout
from lightpen_app.look.theme import GRID
from lightpen_app.widgets.bars import JobProgress
from lightpen_app.widgets.controls import ask_file
from lightpen_app.widgets.fields import Translated
from lightpen_app.widgets.fitting import FittedWindow
from lightpen_app.widgets.state_banner import SignLabel, StatusMessage
from lightpen_app.work.chosen_files import SavePlace
from lightpen_app.work.job import Job, LatestJob, Report
from lightpen_app_extensions.report.pages import A4, PrintReport, paint_on, pdf_of
from lightpen_app_extensions.report.reestimated import (
    ReestimatedPoses,
    reestimate_poses,
)

T = TypeVar("T")
PATIENCE_MS = 300  # before the progress of saving is shown


@dataclass(frozen=True)
class ReportContent:
    """Content of the report of a calibration."""

    calibration_file: CalibrationFile
    # Its images, where the file holds enough for that.
    reestimated: ReestimatedPoses | None
    entered: EntryPlace | None  # archive entry of the calibration


def read_calibration_file(file: Path) -> ReportContent:
    """Read the content of the report of a calibration.

    Raises `FileError` if the calibration is not the one that was entered, `UsageError`
    if the file holds none, or lacks content of the report.
    """
    calibration_file = with_status(read_calibration(file), local_now())
    reestimated = reestimate_poses(calibration_file.calibration)
    return ReportContent(
        calibration_file, reestimated, entry_of_file(file, calibration_file.sha256)
    )


class KeptVerification(NamedTuple):
    """A verification on the disk: its file with the content, and its archive entry."""

    file: InputFile
    done: StoredVerification
    entered: EntryPlace | None
    traced: tuple[TracedItem, ...] = ()


def read_kept_verification(path: Path) -> KeptVerification:
    """Read the content of the report of an archived verification."""
    file = with_content(path)
    done = read_verification(file.content or b"", path)
    data = data_folder_of_verification(path)
    library = Library() if data is None else read_library(data)
    names = Names(done.station, done.operator, done.pen, done.tip)
    certified = certified_values(json.loads(file.content or b"{}"))
    return KeptVerification(
        file,
        done,
        entry_of_file(path, file.sha256),
        traced_items(library, names, done.camera_serials, certified),
    )


class PrintReportControl(ReportPrinter):
    """Reads a file in the background and opens a window with its report."""

    is_here = True

    def __init__(self, place: SavePlace, page: QWidget) -> None:
        super().__init__(page)
        self._place = place
        self._page = page
        self._reading = LatestJob(self)

    @override
    def show(self, find: Callable[[], Path]) -> None:
        self._read(lambda: read_calibration_file(find()), self._show)

    @override
    def show_verification(self, path: Path) -> None:
        self._read(lambda: read_kept_verification(path), self._show_verification)

    def _read(self, read: Callable[[], T], show: Callable[[T], None]) -> None:
        self._reading.start(lambda _: read(), show, self.failed)

    @override
    def shut_down(self) -> None:
        self._reading.cancel()

    def _show(self, found: ReportContent) -> None:
        # Printing takes long to be imported, and few swings are printed.
        from lightpen_app_extensions.report.pages import print_report_of, report_stem

        report = print_report_of(
            found.calibration_file,
            found.reestimated,
            found.entered,
            self._place.settings.laboratory(),
        )
        self._open(report, report_stem(found.calibration_file))

    def _show_verification(self, found: KeptVerification) -> None:
        from lightpen_app_extensions.report.verification import (
            verification_print_report,
            verification_stem,
        )

        stem = verification_stem(found.file.path, found.done)
        laboratory = self._place.settings.laboratory()
        self._open(verification_print_report(*found, laboratory), stem)

    def _open(self, report: "PrintReport", stem: str) -> None:

        window = PrintReportWindow(report, self._place, stem, self._page)
        window.saved.connect(self.saved)
        window.failed.connect(self.failed)
        window.show()


class PrintReportWindow(FittedWindow, Translated, QWidget):
    """Shows the pages, drawn as they are saved and printed.

    ``stem`` begins the default name of a saved file.
    """

    saved = Signal(object)  # Path: the PDF that was written
    failed = Signal(str)  # a sentence on why it was not

    CLOSING_KEYS = (Qt.Key.Key_Escape,)

    def __init__(
        self,
        report: PrintReport,
        place: SavePlace,
        stem: str,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent, Qt.WindowType.Window)
        self.setObjectName("paper")
        self.resize(100 * GRID, 110 * GRID)
        self._report = report
        self._place = place
        self._stem = stem
        self._saving: Job | None = None

        # Widgets
        self._printer = QPrinter(QPrinter.PrinterMode.HighResolution)
        self._printer.setPageLayout(A4)
        self._pages = self.say(QPrintPreviewWidget(self._printer), self.tr("Pages"))
        self._pages.setZoomMode(QPrintPreviewWidget.ZoomMode.FitToWidth)
        pages = self._pages.findChild(QGraphicsView)
        assert pages is not None  # else the width changes as the bar comes
        pages.setVerticalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOn)
        self._smaller = self.make_button(self.tr("Smaller"))
        self._larger = self.make_button(self.tr("Larger"))
        self._save = self.make_button(self.tr("Save as PDF..."), self._ask_file)
        self._print = self.make_button(self.tr("Print..."), self._ask_printer)
        self._close = self.make_button(self.tr("Close"))
        self._said, self._progress = SignLabel(), JobProgress(PATIENCE_MS)

        # Layout
        shown = (self._pages, 1), self._progress, self._said
        layout = vertical_layout(self, *shown, margins=GRID)
        zoom = self._smaller, self._larger
        horizontal_layout(layout, *zoom, 1, self._print, self._save, self._close)

        # Connections
        self._pages.paintRequested.connect(partial(paint_on, report))
        self._smaller.clicked.connect(self._pages.zoomOut)
        self._larger.clicked.connect(self._pages.zoomIn)
        self._close.clicked.connect(self.close)
        self.saved.connect(self._on_saved)
        self.failed.connect(self._on_failed)

        self._retranslate()

    @override
    def closeEvent(self, event: QCloseEvent) -> None:
        super().closeEvent(event)
        if self._saving is None:  # else it reports it first
            self.deleteLater()

    def n_pages(self) -> int:
        """Return the number of pages."""
        return self._pages.pageCount()

    def _retranslate(self) -> None:
        self.setWindowTitle(self._report.margins.title)

    def _ask_file(self) -> None:
        path = self._place.folder() / f"{self._stem}.pdf"
        ask_file(self, self.tr("Save report"), path, self.write)

    def write(self, path: Path) -> None:
        """Save it as PDF in a file."""
        report = self._report
        self._place.remember(path.parent)

        def save(progress: Report) -> None:
            write_whole(path, pdf_of(report, progress))

        self._saving = job = Job(save, self)
        self._progress.cancelled.connect(job.cancel)
        self._progress.begin()
        self._save.setEnabled(False)
        job.start(
            lambda _: self.saved.emit(path),
            self.failed,
            progressed=self._progress.set_fraction,
            ended=self._on_saving_ended,
        )

    def _on_saved(self, path: Path) -> None:
        text = self.tr("Saved as {0}").format(path)
        self._said.set_value(StatusMessage.good(text))

    def _on_failed(self, why: str) -> None:
        self._said.set_value(StatusMessage.fault(why))

    def _on_saving_ended(self) -> None:
        self._saving = None
        self._progress.end()
        self._save.setEnabled(True)
        if self.isHidden():
            self.deleteLater()

    def _ask_printer(self) -> None:
        dialog = QPrintDialog(self._printer, self)
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.finished.connect(self._on_printer_chosen)
        QDialog.open(dialog)  # its own wants a slot by name

    def _on_printer_chosen(self, answer: int) -> None:
        if answer == QDialog.DialogCode.Accepted:
            paint_on(self._report, self._printer)
