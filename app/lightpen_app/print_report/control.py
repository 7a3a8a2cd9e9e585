"""Opens the report of a result file in its own window."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, TypeVar

from PySide6.QtCore import QObject, Signal
from PySide6.QtWidgets import QWidget

from lightpen.archive.logbook.result_entry import entry_of_file
from lightpen.formats.hashes import InputFile, with_content
from lightpen.local_time import local_now
from lightpen.record.calibrations.calibrations import CalibrationFile, read_calibration
from lightpen.record.calibrations.export_status import with_status
from lightpen.record.calibrations.reestimated_poses import (
    ReestimatedPoses,
    reestimate_poses,
)
from lightpen.record.calibrations.traceability import (
    TracedItem,
    certified_values,
    traced_items,
)
from lightpen.record.folder.verifications import (
    StoredVerification,
    data_folder_of_verification,
    read_verification,
)
from lightpen.record.library.entered_files import EntryPlace
from lightpen.record.library.tip_library import Library, read_library
from lightpen.record.swings.names import Names
from lightpen_app.work.job import LatestJob
from lightpen_app.work.save_place import SavePlace

if TYPE_CHECKING:
    from lightpen_app.print_report.pages import PrintReport

T = TypeVar("T")


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


class PrintReportControl(QObject):
    """Reads a file in the background and opens a window with its report."""

    saved = Signal(object)  # Path: the PDF that was written
    failed = Signal(str)  # the sentence why something is not shown, or was not saved

    def __init__(self, place: SavePlace, page: QWidget) -> None:
        super().__init__(page)
        self._place = place
        self._page = page
        self._reading = LatestJob(self)

    def show(self, find: Callable[[], Path]) -> None:
        """Show the report of the file that a function finds on the disk."""
        self._read(lambda: read_calibration_file(find()), self._show)

    def show_verification(self, path: Path) -> None:
        """Show the report of a verification."""
        self._read(lambda: read_kept_verification(path), self._show_verification)

    def _read(self, read: Callable[[], T], show: Callable[[T], None]) -> None:
        self._reading.start(lambda _: read(), show, self.failed)

    def shut_down(self) -> None:
        """Cancel previews that are not shown yet."""
        self._reading.cancel()

    def _show(self, found: ReportContent) -> None:
        # Printing takes long to be imported, and few swings are printed.
        from lightpen_app.print_report.printing import print_report_of, report_stem

        report = print_report_of(
            found.calibration_file,
            found.reestimated,
            found.entered,
            self._place.settings.laboratory(),
        )
        self._open(report, report_stem(found.calibration_file))

    def _show_verification(self, found: KeptVerification) -> None:
        from lightpen_app.print_report.verification import (
            verification_print_report,
            verification_stem,
        )

        stem = verification_stem(found.file.path, found.done)
        laboratory = self._place.settings.laboratory()
        self._open(verification_print_report(*found, laboratory), stem)

    def _open(self, report: "PrintReport", stem: str) -> None:
        from lightpen_app.print_report.preview import PrintReportWindow

        window = PrintReportWindow(report, self._place, stem, self._page)
        window.saved.connect(self.saved)
        window.failed.connect(self.failed)
        window.show()
