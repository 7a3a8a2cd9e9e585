"""Searches for a source: cameras, libraries, files beside images."""

from functools import partial

from PySide6.QtCore import QObject

from lightpen.cameras.source import FoundDevice
from lightpen.cameras.sources import absent_sources
from lightpen.record.swings.recordings import FilesBeside, files_beside
from lightpen.swing.image_sources import SourceChoice, SourceKind
from lightpen_app.steps.camera.source_panel import SourcePanel
from lightpen_app.work.camera_setup import CameraSetup
from lightpen_app.work.chosen_files import ChosenFiles
from lightpen_app.work.job import Job, LatestJob
from lightpen_app.work.selection import Selection


class SourceSearch(QObject):
    """Searches cameras for the panel that asked last, and installed libraries."""

    def __init__(self, camera: CameraSetup, *panels: SourcePanel) -> None:
        super().__init__(panels[0])
        self._camera = camera
        self._asking = panels[0]
        job = Job(lambda _: absent_sources(), self)

        # Connections
        for panel in panels:
            panel.search_requested.connect(partial(self._start, panel))
            job.succeeded.connect(panel.set_absent)
        camera.cameras_found.connect(self._on_found)
        camera.search_failed.connect(self._on_failed)
        camera.all_found.connect(panels[0].set_offers)

        job.start()

    def _start(self, panel: SourcePanel) -> None:
        self._asking.set_searching(False)
        self._asking, source = panel, panel.value()
        self._camera.search(source.kind, source.producer)
        panel.set_searching(True)

    def _on_found(self, found: tuple[FoundDevice, ...]) -> None:
        if self._asking.is_searching:  # else another source is chosen by now
            self._asking.set_searching(False)
            self._asking.set_found(found)

    def _on_failed(self, why: str) -> None:
        if self._asking.is_searching:
            self._asking.set_searching(False)
            self._asking.set_search_problem(why)


class BesideControl(QObject):
    """Offers files beside recorded images unless they are in use."""

    def __init__(
        self, selection: Selection, files: ChosenFiles, panel: SourcePanel
    ) -> None:
        super().__init__(panel)
        self._selection = selection
        self._panel = panel
        self._looking = LatestJob(self)
        self._source = SourceChoice()
        self._found = FilesBeside()

        # Connections
        panel.files_requested.connect(files.use_files)

    def follow(self, source: SourceChoice) -> bool:
        """Offer the files of a source; return whether the source has changed."""
        is_other = source != self._source
        if is_other:
            self._look(source)
        self._offer()
        return is_other

    def shut_down(self) -> None:
        """Stop."""
        self._looking.cancel()

    def _look(self, source: SourceChoice) -> None:
        self._source, self._found = source, FilesBeside()
        self.shut_down()
        if source.kind != SourceKind.RECORDED or not source.place:
            return
        self._looking.start(lambda _: files_beside(source.place), self._on_found)

    def _on_found(self, files: FilesBeside) -> None:
        self._found = files
        self._offer()

    def _offer(self) -> None:
        now, beside = self._selection.preparation, self._found
        camera = None if now.camera_file is None else now.camera_file.path
        pen = None if now.pen_file is None else now.pen_file.path
        others = FilesBeside(
            None if beside.camera == camera else beside.camera,
            None if beside.pen == pen else beside.pen,
        )
        self._panel.set_beside(others)
