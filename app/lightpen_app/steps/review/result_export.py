"""Opens the folder of a result, copies the tip, exports and prints the result."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from PySide6.QtCore import QObject, Qt, Signal
from PySide6.QtWidgets import QApplication, QFileDialog, QWidget

from lightpen.archive.logbook.result_entry import with_entry
from lightpen.estimation.reports.methods import reported
from lightpen.local_time import local_now
from lightpen.model.laboratory import Laboratory
from lightpen.record.calibrations.calibrations import read_calibration
from lightpen.record.calibrations.export_status import with_status
from lightpen.record.exports.exports import copied_tip, exported_solution, save_new
from lightpen_app.print_report.control import PrintReportControl
from lightpen_app.steps.review.laboratory_dialog import LaboratoryDialog
from lightpen_app.steps.review.result_tools import Export, ResultTools
from lightpen_app.widgets.opened_folder import open_folder
from lightpen_app.work.job import Job, Report
from lightpen_app.work.save_place import SavePlace
from lightpen_app.work.swing_run import SwingRun

if TYPE_CHECKING:
    from lightpen_app.steps.review.plot_card import NamedPicture

DrawPlots: TypeAlias = "Callable[[], Sequence[NamedPicture]]"


class ResultExport(QObject):
    """Carries out requests of the result tools.

    ``draw_plots`` returns all plots as pictures; only the page can draw them.
    """

    message_sent = Signal(str)  # what was done
    failed = Signal(str)  # the sentence why something was not

    def __init__(
        self, run: SwingRun, place: SavePlace, draw_plots: DrawPlots, page: QWidget
    ) -> None:
        super().__init__(page)
        self._run = run
        self._place = place
        self._draw_plots = draw_plots
        self._page = page
        self._saving: Job | None = None
        self._print_report = PrintReportControl(place, page)

        # Connections
        self._print_report.saved.connect(lambda path: self._report_saved(path.parent))
        self._print_report.failed.connect(self.failed)

    def follow(self, tools: ResultTools) -> None:
        """Connect the requests of the buttons."""
        tools.folder_requested.connect(self._open_folder)
        tools.copy_requested.connect(self._copy_tip)
        tools.save_requested.connect(self._ask_laboratory)
        tools.report_requested.connect(self._show_report)

    def shut_down(self) -> None:
        """Disconnect from all signals."""
        self._print_report.shut_down()
        if self._saving is not None:
            self._saving.cancel()

    def _open_folder(self) -> None:
        folder = self._run.status.record_folder
        if folder is not None:
            self.message_sent.emit(open_folder(folder))

    def _copy_tip(self) -> None:
        status = self._run.status
        if status.solution is not None:
            tip = reported(status.solution.calibration).tip_pen
            line = copied_tip(tip, status.origin)
            QApplication.clipboard().setText(line)
            self.message_sent.emit(self.tr("Tip copied: x, y, z in mm."))

    def _ask_laboratory(self, export: Export) -> None:
        """Ask for the laboratory where a format names it, then for the folder."""
        if not any(each.needs_laboratory for each in export.formats):
            self._ask_folder(export, None)
            return
        dialog = LaboratoryDialog(self._place.settings.laboratory(), self._page)
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.given.connect(self._place.settings.set_laboratory)
        dialog.given.connect(lambda laboratory: self._ask_folder(export, laboratory))
        dialog.open()

    def _ask_folder(self, export: Export, laboratory: Laboratory | None) -> None:
        dialog = QFileDialog(self._page, self.tr("Folder for saving"))
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.setFileMode(QFileDialog.FileMode.Directory)
        dialog.setOption(QFileDialog.Option.ShowDirsOnly)
        dialog.setDirectory(str(self._place.folder()))
        dialog.fileSelected.connect(
            lambda path: self._save(export, laboratory, Path(path))
        )
        dialog.open()

    def _save(
        self, export: Export, laboratory: Laboratory | None, folder: Path
    ) -> None:
        """Save an export; accepted results from their file."""
        status, stem, archive = self._run.status, self._place.stem(), self._run.archive
        solution, names, result = status.solution, status.names, status.result
        if solution is None:
            return
        self._place.remember(folder)
        pictures = self._draw_plots() if export.has_plots else ()

        def write(_: Report) -> None:
            for picture in pictures:
                save_new(folder, f"{stem}_{picture.name}", picture.data)
            if not export.formats:
                return
            found = (
                exported_solution(solution, names)
                if result is None
                else with_entry(
                    with_status(read_calibration(archive.file_of(result)), local_now())
                )
            )
            for each in export.formats:
                save_new(folder, stem + each.suffix, each.content(found, laboratory))

        self._saving = job = Job(write, self)
        job.start(lambda _: self._report_saved(folder), self.failed)

    def _show_report(self) -> None:
        """Open the report of the stored result."""
        result, archive = self._run.status.result, self._run.archive
        if result is not None:
            self._print_report.show(lambda: archive.file_of(result))

    def _report_saved(self, folder: Path) -> None:
        self.message_sent.emit(self.tr("Saved in {0}").format(folder))
