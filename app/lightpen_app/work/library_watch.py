"""The tip library and the status of tips, read and changed in the background."""

from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

from msgspec import structs
from PySide6.QtCore import QObject, QTimer, Signal

from lightpen.archive.lazy_logbook import LazyLogbook
from lightpen.errors import ArchiveError
from lightpen.formats.opened_files import PenFile
from lightpen.model.limits import Assumptions, DueRule
from lightpen.record.library.library_changes import Author, add_item, change_item
from lightpen.record.library.tip_library import (
    ItemKind,
    LedFile,
    Library,
    ListedPen,
    StationStatus,
    read_library,
)
from lightpen.record.results.result_folder import FolderArchive
from lightpen.swing.preparation import Preparation, SourceKind
from lightpen_app.look.words import moment_text
from lightpen_app.work.job import Job, LatestJob, Notifications, Report
from lightpen_app.work.selection import Selection

AGAIN_MS = 15 * 60 * 1000  # interval of checking for overdue tips

Change = Callable[[], Library]


class LibraryWatch(QObject):
    """Watches the library of a data folder and signals changes.

    ``rule`` is for tips without a rule of their own.
    """

    changed = Signal()  # `statuses` are different
    change_kept = Signal(object)  # the change
    # What was requested, and the sentence why it was not kept.
    change_failed = Signal(object, str)

    def __init__(
        self,
        folder: Path,
        logbook: LazyLogbook,
        rule: DueRule,
        now: Callable[[], datetime],
        notifications: Notifications,
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self._folder = folder
        self._logbook = logbook
        self._rule = rule
        self._now = now
        self._statuses = StationStatus()
        self._notifications = notifications
        self._reading = LatestJob(self)
        self._asked: deque[tuple[object, Change]] = deque()
        self._changing: Job | None = None
        self._is_over = False
        self._timer = QTimer(self, interval=AGAIN_MS)

        # Connections
        self._timer.timeout.connect(self.refresh)

    @property
    def statuses(self) -> StationStatus:
        """Status of all tips, with the library, as last read."""
        return self._statuses

    @property
    def library(self) -> Library:
        """The library as last read."""
        return self._statuses.library

    def set_rule(self, rule: DueRule) -> None:
        """Set the calibration interval."""
        if rule != self._rule:
            self._rule = rule
            self.refresh()

    def refresh(self) -> None:
        """Read it again; only the last request is answered."""
        if self._is_over:
            return
        self._timer.start()
        folder, logbook, rule, now = (
            self._folder,
            self._logbook,
            self._rule,
            self._now,
        )

        def read(_: Report) -> StationStatus:
            library = read_library(folder)
            if not FolderArchive(folder).all_files():  # without any accepted result
                return StationStatus(library, now=now())
            with suppress(ArchiveError):  # the runner reports it
                opened = logbook.opened()
                opened.enter_owed()
                # Imported here: it takes 0.2 s.
                from lightpen.archive.logbook import statuses

                return statuses(opened.database, opened.chain, rule, library, now())
            return StationStatus(library)

        self._reading.start(read, self._on_read, self._on_read_failed)

    def change(self, asked: object, change: Change) -> None:
        """Queue a change of the library, and enter it in the archive.

        ``asked`` identifies the request in the signals about its outcome.
        """
        self._asked.append((asked, change))
        if self._changing is None:
            self._change_next()

    def _change_next(self) -> None:
        asked, change = self._asked.popleft()
        logbook = self._logbook

        def make(_: Report) -> None:
            change()
            with suppress(ArchiveError):  # it stays owed
                logbook.opened().enter_owed()

        self._changing = job = Job(make, self)
        job.start(
            lambda _: self._on_changed(asked),
            lambda why: self.change_failed.emit(asked, why),
            crashed=lambda: self.change_failed.emit(asked, ""),
            ended=self._on_change_ended,
        )

    def shut_down(self) -> None:
        """Cancel reading."""
        self._is_over = True
        self._timer.stop()
        self._reading.cancel()

    def _on_changed(self, asked: object) -> None:
        self.change_kept.emit(asked)
        self.refresh()

    def _on_change_ended(self) -> None:
        self._changing = None
        if self._asked:
            self._change_next()

    def _on_read(self, found: StationStatus) -> None:
        self._notifications.withdraw(self)
        self._statuses = found
        self.changed.emit()

    def _on_read_failed(self, why: str) -> None:
        if why != self._notifications.text(self):
            self._notifications.notify(self, why)
        self._statuses = StationStatus()
        self.changed.emit()


class PenFiles(QObject):
    """Opens the file of the pen that is chosen, and stores which file a pen has.

    A simulated pen has its own files, independent of its name.
    """

    # `doubt` may have changed.
    changed = Signal()

    def __init__(
        self,
        selection: Selection,
        library: LibraryWatch,
        notifications: Notifications,
        folder: Path,
        now: Callable[[], datetime],
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self._selection, self._library = selection, library
        self._notifications = notifications
        self._folder, self._now = folder, now
        self._job = LatestJob(self)

        # Connections
        selection.changed.connect(self._on_selected)
        library.changed.connect(self._on_library_changed)

    def doubt(self) -> str:
        """Return a sentence if the file in use is for another pen, or nothing."""
        now = self._selection.preparation
        return "" if now.pen_file is None else self.doubt_about(now.pen_file)

    def doubt_about(self, file: PenFile) -> str:
        """Return a sentence if a file is for another pen, or nothing."""
        pen, library = self._selection.preparation.names.pen, self._library.library
        if _is_simulated(self._selection.preparation) or not file.sha256 or not pen:
            return ""
        own, other = self._own_file(pen), library.pen_of_leds(file.sha256)
        if own is not None and own.sha256 == file.sha256:
            return ""
        if other is not None and other.id != pen:
            words = self.tr("{0} is the LED file of pen {1}, not of pen {2}.")
            return words.format(file.path.name, other.id, pen)
        if own is not None:
            words = self.tr("{0} is not the LED file stored with pen {1} ({2}).")
            if file.path == Path(own.path):
                words = self.tr("{0} was changed since it was stored with pen {1}.")
            shown, stored = file.path.name, own.name
            if shown == stored:
                shown, stored = self._dated(file.path), self._dated(Path(own.path))
            return words.format(shown, pen, stored)
        return ""

    def _dated(self, path: Path) -> str:
        """Return a path with the moment of its last change, if it can be read."""
        with suppress(OSError):
            changed = datetime.fromtimestamp(path.stat().st_mtime, UTC)
            return self.tr("{0} of {1}").format(path, moment_text(changed))
        return str(path)

    def keep(self, file: PenFile) -> None:
        """Store a file with the pen that is chosen, unless a supervisor must do it."""
        now = self._selection.preparation
        names, library = now.names, self._library.library
        if _is_simulated(now) or not names.pen or not file.sha256:
            return
        if self._selection.supervision.is_guarded:
            return
        led_file = LedFile(str(file.path), file.sha256, file.units or "")
        found = library.item(ItemKind.PEN, names.pen)
        listed = found if isinstance(found, ListedPen) else None
        pen = structs.replace(listed or ListedPen(id=names.pen), led_file=led_file)
        if pen == listed:
            return
        by = Author(names.station, names.operator, self.tr("LED file"))
        change = add_item if listed is None else change_item
        folder, at = self._folder, self._now()

        def store() -> Library:
            return change(folder, pen, by, at)

        self._library.change(self, store)

    def shut_down(self) -> None:
        """Cancel opening."""
        self._job.cancel()

    def _own_file(self, pen: str) -> LedFile | None:
        listed = self._library.library.item(ItemKind.PEN, pen)
        return listed.led_file if isinstance(listed, ListedPen) else None

    def _on_selected(self, before: Preparation) -> None:
        now = self._selection.preparation
        is_same_station = now.names.station == before.names.station
        is_other = before.names.pen not in ("", now.names.pen)
        if is_other and is_same_station and not _is_simulated(now):
            self._open_own()
        if now.pen_file is not before.pen_file or now.names.pen != before.names.pen:
            self.changed.emit()

    def _on_library_changed(self) -> None:
        now = self._selection.preparation
        own = self._own_file(now.names.pen)
        if now.pen_file is None and own is not None and not _is_simulated(now):
            self._open_own()
        self.changed.emit()

    def _open_own(self) -> None:
        """Open the file of the pen that is chosen; without one, another is not used."""
        now = self._selection.preparation
        pen, own = now.names.pen, self._own_file(now.names.pen)
        self._notifications.withdraw(self)
        self._job.cancel()
        if now.pen_file is not None:
            self._selection.set_preparation(replace(now, pen_file=None))
        if own is None:
            return
        path, units = Path(own.path), own.units or None
        self._job.start(
            lambda _: PenFile.read(path, units),
            lambda file: self._on_read(pen, own, file),
            lambda why: self._notifications.notify(self, why),
        )

    def _on_read(self, pen: str, own: LedFile, file: PenFile) -> None:
        now = self._selection.preparation
        if now.names.pen != pen or now.pen_file is not None:
            return  # something else was chosen meanwhile
        if file.sha256 != own.sha256:
            words = self.tr(
                "{0} was changed since it was stored with pen {1}. Open the LED file "
                "of this pen."
            )
            self._notifications.notify(self, words.format(file.path, pen))
            return
        self._selection.set_preparation(
            replace(now, pen_file=file, assumptions=self._assumptions(pen, now))
        )

    def _assumptions(self, pen: str, now: Preparation) -> Assumptions:
        """Return the assumptions with the expansion of a pen, if it is stored."""
        listed = self._library.library.item(ItemKind.PEN, pen)
        if not isinstance(listed, ListedPen) or listed.expansion is None:
            return now.assumptions
        return replace(now.assumptions, expansion=listed.expansion)


def _is_simulated(preparation: Preparation) -> bool:
    return preparation.source.kind == SourceKind.SIMULATED
