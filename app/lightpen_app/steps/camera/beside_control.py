"""The files of camera and pen that stand beside recorded images, found and offered."""

from PySide6.QtCore import QObject

from lightpen.record.recordings import FilesBeside, files_beside
from lightpen.swing.preparation import SourceChoice, SourceKind
from lightpen_app.steps.camera.source_panel import SourcePanel
from lightpen_app.work.job import Job
from lightpen_app.work.workbench import Workbench


class BesideControl(QObject):
    """Offers the files beside recorded images, unless they are in use.

    Parameters
    ----------
    panel : SourcePanel
        Where they are offered.
    """

    def __init__(self, workbench: Workbench, panel: SourcePanel) -> None:
        super().__init__(panel)
        self._workbench = workbench
        self._panel = panel
        self._looking: Job | None = None
        self._source = SourceChoice()
        self._found = FilesBeside()

        # Connections
        panel.files_requested.connect(workbench.use_files)

    def follow(self, source: SourceChoice) -> bool:
        """Offer what goes with a source; return whether it is another than before."""
        is_other = source != self._source
        if is_other:
            self._look(source)
        self._offer()
        return is_other

    def shut_down(self) -> None:
        """Look no more."""
        if self._looking is not None:
            self._looking.cancel()

    def _look(self, source: SourceChoice) -> None:
        self._source, self._found = source, FilesBeside()
        self.shut_down()
        if source.kind != SourceKind.RECORDED or not source.place:
            return
        self._looking = job = Job(lambda _: files_beside(source.place), self)

        # Connections
        job.succeeded.connect(self._on_found)
        job.start()

    def _on_found(self, files: FilesBeside) -> None:
        self._found = files
        self._offer()

    def _offer(self) -> None:
        now, beside = self._workbench.preparation, self._found
        camera = None if now.camera_file is None else now.camera_file.path
        pen = None if now.pen_file is None else now.pen_file.path
        others = FilesBeside(
            None if beside.camera == camera else beside.camera,
            None if beside.pen == pen else beside.pen,
        )
        self._panel.set_beside(others)
