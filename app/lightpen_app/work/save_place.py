"""Where results are saved for use elsewhere, and under which names."""

from pathlib import Path

from PySide6.QtCore import QObject, QStandardPaths

from lightpen.model.origin import Origin
from lightpen.record.exports import export_stem
from lightpen_app.look.phrases import origin_text
from lightpen_app.work.workbench import Workbench


class SavePlace(QObject):
    """The folder that was chosen last, and names by pen, tip and date."""

    def __init__(self, workbench: Workbench) -> None:
        super().__init__(workbench)
        self._workbench = workbench

    def folder(self) -> Path:
        """Return the folder chosen last; that of the user's documents at first."""
        chosen = self._workbench.export_folder()
        if chosen:
            return Path(chosen)
        documents = QStandardPaths.StandardLocation.DocumentsLocation
        return Path(QStandardPaths.writableLocation(documents))

    def remember(self, folder: Path) -> None:
        """Offer this folder from now on."""
        self._workbench.set_export_folder(str(folder))

    def mark(self) -> str:
        """Return what stands on a picture; nothing where a live camera took it."""
        origin = self._workbench.run.status.origin
        return "" if origin in (None, Origin.LIVE) else origin_text(origin)

    def stem(self) -> str:
        """Return what the name of a file begins with."""
        status = self._workbench.run.status
        now = self._workbench.around.now()
        moment = now if status.result is None else status.result.accepted
        return export_stem(status.names, moment, status.origin)
