"""The LED file of each pen, kept with the pen in the library."""

from collections.abc import Callable
from dataclasses import replace
from datetime import datetime
from pathlib import Path

from msgspec import structs
from PySide6.QtCore import QObject, Signal

from lightpen.formats.opened_files import PenFile
from lightpen.model.assumptions import Assumptions
from lightpen.record.library.library_changes import Author, add_item, change_item
from lightpen.record.library.tip_library import ItemKind, LedFile, Library, ListedPen
from lightpen.swing.image_sources import SourceKind
from lightpen.swing.preparation import Preparation
from lightpen_app.work.job import LatestJob
from lightpen_app.work.library_watch import LibraryWatch
from lightpen_app.work.notifications import Notifications
from lightpen_app.work.selection import Selection


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
            is_alike = file.path.name == own.name
            shown, stored = (
                (file.path, own.path) if is_alike else (file.path.name, own.name)
            )
            return words.format(shown, pen, stored)
        return ""

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
