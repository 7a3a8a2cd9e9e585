"""Buttons that copy, export and print a result, and open its folder."""

from functools import partial
from pathlib import Path

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QAction
from PySide6.QtWidgets import QApplication, QFileDialog, QMenu, QWidget

from lightpen.archive.logbook import with_entry
from lightpen.estimation.reports.report_warnings import reported
from lightpen.local_time import local_now
from lightpen.model.names import Laboratory
from lightpen.record.calibrations import read_calibration, with_status
from lightpen.record.exports import (
    TABLE_FORMATS,
    ExportFormat,
    copied_tip,
    exported_solution,
    save_new,
)
from lightpen_app.face import Services, report_printer
from lightpen_app.look.languages import listed, worded
from lightpen_app.look.layouts import horizontal_layout
from lightpen_app.look.words import set_tooltip
from lightpen_app.widgets.controls import open_folder
from lightpen_app.widgets.fields import Translated
from lightpen_app.work.chosen_files import SavePlace
from lightpen_app.work.job import Job, Report
from lightpen_app.work.swing_run import SwingRun

TABLES = TABLE_FORMATS[:3]  # without the text that is pasted


class ResultTools(Translated, QWidget):
    """Buttons that copy, save and print a result, and start the press test.

    The menu to save also has the formats of extensions.
    """

    press_requested = Signal()  # start the press test
    message_sent = Signal(str)  # what was done
    failed = Signal(str)  # the sentence why something was not

    def __init__(self, run: SwingRun, place: SavePlace, services: Services) -> None:
        super().__init__()
        self._run, self._place, self._services = run, place, services
        self._saving: Job | None = None
        self._print_report = report_printer(services, place, self)
        others_too = (form for each in services for form in each.export_formats())
        single = [(each,) for each in (*TABLE_FORMATS, *others_too)]

        # Widgets
        self._copy = self.make_button(self.tr("Copy tip"), self._copy_tip)
        self._save = self.make_button(self.tr("Save..."))
        self._save.setProperty("menu", True)
        menu = QMenu(self._save)
        menu.setToolTipsVisible(True)
        self._report = self.say(menu.addAction(""), self.tr("Calibration report..."))
        self._report.setVisible(self._print_report.is_here)
        usual = [each for each in single if each[0].name == "csv"]
        others = [each for each in single if each not in usual]
        self._actions: list[tuple[tuple[ExportFormat, ...], QAction]] = [
            (export, menu.addAction("")) for export in (*usual, TABLES)
        ]
        self._others = self.say(menu.addMenu(""), self.tr("Other formats"))
        self._others.setToolTipsVisible(True)
        self._actions += [(export, self._others.addAction("")) for export in others]
        menu.addSeparator()
        self._folder = self.say(
            menu.addAction(""),
            self.tr("Open folder"),
            tip=self.tr("Open the folder of the swing"),
        )
        self._save.setMenu(menu)
        self._press = self.make_button(self.tr("Press test"), self.press_requested)

        # Layout
        horizontal_layout(self, (self._copy, 1), (self._save, 1), (self._press, 1))

        # Connections
        for export, action in self._actions:
            action.triggered.connect(
                lambda _=False, export=export: self._ask_laboratory(export)
            )
        self._report.triggered.connect(self._show_report)
        self._folder.triggered.connect(self._open_folder)
        self._print_report.saved.connect(lambda path: self._report_saved(path.parent))
        self._print_report.failed.connect(self.failed)

        self._refresh()

    def set_why_not(self, why_not: str) -> None:
        """Disable all with a reason, or enable them."""
        words = self.tr("Copy x, y, z in mm, separated by tabs")
        self._copy.set_why_not(why_not, words)
        words = self.tr("Save results, named by pen, tip and date")
        self._save.set_why_not(why_not, words)

    def set_can_press(self, can_press: bool) -> None:
        """Show the press test if something can compare it."""
        self._press.setVisible(can_press)

    def set_report_why_not(self, why_not: str) -> None:
        """Disable the report with a reason, or enable it."""
        self._report.setEnabled(not why_not)
        tooltip = self.tr("Preview, save as PDF, or print")
        set_tooltip(self._report, why_not or tooltip)

    def set_press_why_not(self, why_not: str) -> None:
        """Disable the press test with a reason, or enable it."""
        tooltip = self.tr(
            "Swing again with firm pressure and compare: shows a stylus that gives way"
        )
        self._press.set_why_not(why_not, tooltip)

    def _refresh(self) -> None:
        for export, action in self._actions:
            action.setText(self._name(export) + "...")
            described = (worded(each.description) for each in export)
            set_tooltip(action, listed(described))

    def _name(self, export: tuple[ExportFormat, ...]) -> str:
        if export == TABLES:
            return self.tr("Record and tables")
        return worded(export[0].label)

    def shut_down(self) -> None:
        """Cancel running jobs."""
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

    def _ask_laboratory(self, export: tuple[ExportFormat, ...]) -> None:
        """Have the laboratory asked for where a format names it, then the folder."""
        if not any(each.needs_laboratory for each in export):
            self._ask_folder(export, None)
            return
        named = next(s for s in self._services if export[0] in s.export_formats())
        named.ask_laboratory(self, partial(self._ask_folder, export))

    def _ask_folder(
        self, export: tuple[ExportFormat, ...], laboratory: Laboratory | None
    ) -> None:
        dialog = QFileDialog(self, self.tr("Folder for saving"))
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.setFileMode(QFileDialog.FileMode.Directory)
        dialog.setOption(QFileDialog.Option.ShowDirsOnly)
        dialog.setDirectory(str(self._place.folder()))
        dialog.fileSelected.connect(
            lambda path: self._save_in(export, laboratory, Path(path))
        )
        dialog.open()

    def _save_in(
        self,
        export: tuple[ExportFormat, ...],
        laboratory: Laboratory | None,
        folder: Path,
    ) -> None:
        """Save an export; accepted results from their file."""
        status, stem, archive = self._run.status, self._place.stem(), self._run.archive
        solution, names, result = status.solution, status.names, status.result
        if solution is None:
            return
        self._place.remember(folder)

        def write(_: Report) -> None:
            found = (
                exported_solution(solution, names)
                if result is None
                else with_entry(
                    with_status(read_calibration(archive.file_of(result)), local_now())
                )
            )
            for each in export:
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
