"""What follows from a card of the first view: a trial, or the set-up of a station."""

from PySide6.QtCore import QObject, Signal

from lightpen.swing.image_sources import SourceChoice, SourceKind
from lightpen_app.steps.start.welcome_view import WelcomeView
from lightpen_app.work.selection import TRIAL, is_trial_ready
from lightpen_app.work.workbench import Workbench


class WelcomeControl(QObject):
    """Begins a trial or a station."""

    trial_ready = Signal()
    trial_awaited = Signal()  # until its camera delivers an image
    station_begun = Signal()

    def __init__(
        self, workbench: Workbench, view: WelcomeView, parent: QObject
    ) -> None:
        super().__init__(parent)
        self._selection, self._run = workbench.selection, workbench.run
        self._camera, self._view = workbench.camera, view

        # Connections
        view.trial_requested.connect(
            lambda: workbench.files.use_trial(self._begin_trial)
        )
        view.images_chosen.connect(self._begin_station)
        view.station_requested.connect(self._begin_station)
        workbench.run.changed.connect(self.refresh)

    def refresh(self) -> None:
        """Show whether a trial can begin."""
        is_on = self._run.status.state is not None
        why_not = self.tr("A swing is in progress.") if is_on else ""
        self._view.trial.set_why_not(why_not)

    def _begin_trial(self) -> None:
        if not self._camera.live.is_open:
            self.trial_awaited.emit()
            self._camera.open()
        elif is_trial_ready(self._selection.preparation) and self._view.isVisible():
            self.trial_ready.emit()

    def _begin_station(self, images: str = "") -> None:
        """Set up a station, with recorded images or without a source."""
        names = self._selection.preparation.names
        if names.station in ("", TRIAL.station):
            self._selection.begin_station()
        if images:
            source = SourceChoice(SourceKind.RECORDED, images)
            chosen = self._selection.preparation.with_source(source)
            self._selection.set_preparation(chosen)
        self.station_begun.emit()
