"""Takes a tip along: its folder, its numbers, files of it, and its record on paper."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from PySide6.QtCore import QObject, Qt, Signal
from PySide6.QtWidgets import QApplication, QFileDialog, QWidget

from lightpen.record.exports import export_json, export_tables, save_new, tip_text
from lightpen_app.paper.showing import PaperShowing
from lightpen_app.steps.review.result_tools import Export, ResultTools
from lightpen_app.widgets.opened_folder import open_folder
from lightpen_app.work.job import Job, Report
from lightpen_app.work.save_place import SavePlace
from lightpen_app.work.swing_run import SwingRun

if TYPE_CHECKING:
    from lightpen_app.steps.review.plot_card import NamedPicture

DrawPlots: TypeAlias = "Callable[[], Sequence[NamedPicture]]"


class TakingAlong(QObject):
    """Does what is asked for by the tools of a result.

    Parameters
    ----------
    run : SwingRun
        With the tip.
    place : SavePlace
    draw_plots : callable
        Returns all plots as pictures; only the page can draw them.
    page : QWidget
        Whose windows are opened.

    Signals
    -------
    told(str)
        What was done.
    failed(str)
        The sentence why something was not.
    """

    told = Signal(str)
    failed = Signal(str)

    def __init__(
        self, run: SwingRun, place: SavePlace, draw_plots: DrawPlots, page: QWidget
    ) -> None:
        super().__init__(page)
        self._run = run
        self._place = place
        self._draw_plots = draw_plots
        self._page = page
        self._saving: Job | None = None
        self._paper = PaperShowing(place, page)

        # Connections
        self._paper.saved.connect(lambda path: self._tell_saved(path.parent))
        self._paper.failed.connect(self.failed)

    def follow(self, tools: ResultTools) -> None:
        """Do what these ask for."""
        tools.folder_requested.connect(self._open_folder)
        tools.copy_requested.connect(self._copy_tip)
        tools.save_requested.connect(self._ask_folder)
        tools.paper_requested.connect(self._show_paper)

    def shut_down(self) -> None:
        """Tell of nothing any more."""
        self._paper.shut_down()
        if self._saving is not None:
            self._saving.cancel()

    def _open_folder(self) -> None:
        folder = self._run.status.record_folder
        if folder is not None:
            self.told.emit(open_folder(folder))

    def _copy_tip(self) -> None:
        status = self._run.status
        if status.solution is not None:
            line = tip_text(status.solution, status.origin)
            QApplication.clipboard().setText(line)
            self.told.emit(self.tr("The tip is copied: x, y, z in mm."))

    def _ask_folder(self, export: Export) -> None:
        dialog = QFileDialog(self._page, self.tr("Folder to save in"))
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.setFileMode(QFileDialog.FileMode.Directory)
        dialog.setOption(QFileDialog.Option.ShowDirsOnly)
        dialog.setDirectory(str(self._place.folder()))
        dialog.fileSelected.connect(lambda path: self._save(export, Path(path)))
        dialog.open()

    def _save(self, export: Export, folder: Path) -> None:
        """Save what is wanted."""
        status, stem = self._run.status, self._place.stem()
        solution, names = status.solution, status.names
        if solution is None:
            return
        self._place.remember(folder)
        draws = export in (Export.PLOTS, Export.ALL)
        pictures = self._draw_plots() if draws else ()

        def write(_: Report) -> None:
            for picture in pictures:
                save_new(folder, f"{stem}_{picture.name}", picture.data)
            if export in (Export.JSON, Export.ALL):
                export_json(solution, folder, stem)
            if export in (Export.CSV, Export.ALL):
                export_tables(solution, names, folder, stem)

        self._saving = job = Job(write, self)

        # Connections
        job.succeeded.connect(lambda _: self._tell_saved(folder))
        job.failed.connect(self.failed)
        job.start()

    def _show_paper(self) -> None:
        """Show the record on paper, of the result as it is on the disk."""
        result, archive = self._run.status.result, self._run.archive
        if result is not None:
            self._paper.show(lambda: archive.file_of(result))

    def _tell_saved(self, folder: Path) -> None:
        self.told.emit(self.tr("Saved in {0}").format(folder))
