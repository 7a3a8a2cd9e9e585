"""Opens the report of a result file in its own window."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QCloseEvent
from PySide6.QtPrintSupport import QPrintDialog, QPrinter, QPrintPreviewWidget
from PySide6.QtWidgets import QDialog, QGraphicsView, QWidget
from typing_extensions import override

from lightpen.formats.files import write_whole
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
from lightpen_app_extensions.report.content import (
    ReportContent,
    print_report_of,
    read_content,
)
from lightpen_app_extensions.report.pages import A4, PrintReport, paint_on, pdf_of

PATIENCE_MS = 300  # before the progress of saving is shown


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
        laboratory = self._place.settings.last().laboratory
        read = partial(read_content, laboratory=laboratory)
        self._reading.start(lambda _: read(find()), self._open, self.failed)

    @override
    def show_verification(self, path: Path) -> None:
        self.show(lambda: path)

    @override
    def shut_down(self) -> None:
        self._reading.cancel()

    def _open(self, content: ReportContent) -> None:
        report = print_report_of(content)
        window = PrintReportWindow(report, self._place, content.stem, self._page)
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
        self._save = self.make_button(self.tr("Save as PDF..."), self._ask_file)
        self._print = self.make_button(self.tr("Print..."), self._ask_printer)
        self._close = self.make_button(self.tr("Close"))
        self._said, self._progress = SignLabel(), JobProgress(PATIENCE_MS)

        # Layout
        shown = (self._pages, 1), self._progress, self._said
        layout = vertical_layout(self, *shown, margins=GRID)
        horizontal_layout(layout, 1, self._print, self._save, self._close)

        # Connections
        self._pages.paintRequested.connect(partial(paint_on, report))
        self._close.clicked.connect(self.close)
        self.saved.connect(self._on_saved)
        self.failed.connect(self._on_failed)

        self._refresh()

    @override
    def closeEvent(self, event: QCloseEvent) -> None:
        super().closeEvent(event)
        if self._saving is None:  # else it reports it first
            self.deleteLater()

    def _refresh(self) -> None:
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
