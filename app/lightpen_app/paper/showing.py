"""Shows the record on paper of a result on the disk, in a window of its own."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from PySide6.QtCore import QObject, Signal
from PySide6.QtWidgets import QWidget

from lightpen.archive.entered import entry_of_file
from lightpen.record.retraced import Retraced, retrace
from lightpen.record.statement import Entered, Statement, read_statement
from lightpen_app.work.job import Job
from lightpen_app.work.save_place import SavePlace


@dataclass(frozen=True)
class PutDown:
    """What is put on paper of a calibration.

    Attributes
    ----------
    retraced : Retraced or None
        Its images, where the file holds enough for that.
    entered : Entered or None
        Where in an archive it is entered, if it is.
    """

    statement: Statement
    retraced: Retraced | None
    entered: Entered | None


def read_calibration_file(file: Path) -> PutDown:
    """Return what a file has that is put on paper.

    Raises
    ------
    ArchiveError
        The archive beside it cannot be read.
    FileError
        The calibration cannot be read, or is not the one that was entered.
    UsageError
        The file holds no calibration, or not all that is put on paper.
    """
    statement = read_statement(file)
    retraced = retrace(statement.calibration)
    return PutDown(statement, retraced, entry_of_file(file, statement.sha256))


class PaperShowing(QObject):
    """Reads a file beside the window, and opens another one with its pages.

    Parameters
    ----------
    place : SavePlace
        Where PDFs are saved.
    page : QWidget
        Whose windows are opened.

    Signals
    -------
    saved(Path)
        The PDF that was written.
    failed(str)
        The sentence why something is not shown, or was not saved.
    """

    saved = Signal(object)
    failed = Signal(str)

    def __init__(self, place: SavePlace, page: QWidget) -> None:
        super().__init__(page)
        self._place = place
        self._page = page
        self._reading: Job | None = None

    def show(self, find: Callable[[], Path]) -> None:
        """Show the record on paper of the file that a function finds on the disk."""
        self.shut_down()
        self._reading = job = Job(lambda _: read_calibration_file(find()), self)

        # Connections
        job.succeeded.connect(self._show)
        job.failed.connect(self.failed)
        job.start()

    def shut_down(self) -> None:
        """Show nothing any more that is not shown yet."""
        if self._reading is not None:
            self._reading.cancel()

    def _show(self, found: PutDown) -> None:
        # Printing takes long to be imported, and few swings are printed.
        from lightpen_app.paper.preview import PaperWindow
        from lightpen_app.paper.printing import paper_of, paper_stem

        paper = paper_of(found.statement, found.retraced, found.entered)
        stem = paper_stem(found.statement)
        window = PaperWindow(paper, self._place, stem, self._page)
        window.saved.connect(self.saved)
        window.failed.connect(self.failed)
        window.show()
