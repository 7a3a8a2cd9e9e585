"""Folders and file names of saved results."""

from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from PySide6.QtCore import QStandardPaths

from lightpen.model.origin import Origin
from lightpen.record.exports.exports import export_stem
from lightpen_app.look.phrases import origin_text
from lightpen_app.work.settings import Settings
from lightpen_app.work.swing_run import SwingRun


@dataclass(frozen=True)
class SavePlace:
    """The folder that was chosen last, and names by pen, tip and date."""

    # Remembers the folder, and the laboratory that a certificate names.
    settings: Settings
    run: SwingRun
    # Returns the date and time of a result that is not accepted yet.
    now: Callable[[], datetime]

    def folder(self) -> Path:
        """Return the last folder; at first the user's documents."""
        chosen = self.settings.export_folder()
        if chosen:
            return Path(chosen)
        documents = QStandardPaths.StandardLocation.DocumentsLocation
        return Path(QStandardPaths.writableLocation(documents))

    def remember(self, folder: Path) -> None:
        """Offer this folder from now on."""
        self.settings.set_export_folder(str(folder))

    def mark(self) -> str:
        """Return the mark on pictures; empty for a live camera."""
        origin = self.run.status.origin
        return "" if origin in (None, Origin.LIVE) else origin_text(origin)

    def stem(self) -> str:
        """Return the beginning of a file name."""
        status = self.run.status
        moment = self.now() if status.result is None else status.result.accepted
        return export_stem(status.names, moment, status.origin)
