"""The step Camera: source, exposure, focus and intrinsics."""

from typing_extensions import override

from lightpen.cameras.protocol import Connection
from lightpen.detection.inspection import Exposure, inspect
from lightpen.swing.preparation import NO_SOURCE, MissingInput, SourceChoice, SourceKind
from lightpen_app.face import Services
from lightpen_app.look.layouts import vertical_layout
from lightpen_app.look.phrases import first_missing, missing_input_text
from lightpen_app.look.sounds import Sound, Sounds
from lightpen_app.steps.camera.view import CameraPanels
from lightpen_app.widgets.page import MainAction, Page
from lightpen_app.widgets.state_banner import StatusMessage
from lightpen_app.work.live_view import DisplayedImage
from lightpen_app.work.workbench import Workbench

_LACKS_SOURCE = MissingInput.SOURCE, MissingInput.SOURCE_PLACE, MissingInput.DEVICE


class CameraPage(Page):
    """The step Camera."""

    key = "camera"
    shows_images = True

    def __init__(
        self, workbench: Workbench, sounds: Sounds, services: Services = ()
    ) -> None:
        super().__init__()
        self._sounds = sounds
        self._selection, self._run = workbench.selection, workbench.run
        self._camera, self._live = workbench.camera, workbench.live
        self._chosen_files = workbench.files
        self._is_shown = False

        # Widgets
        self._view = view = CameraPanels(workbench, services)

        # Layout
        vertical_layout(self, view)

        # Connections
        view.source.value_changed.connect(self._on_source_chosen)
        view.source.retry_requested.connect(workbench.camera.open)
        view.source.samples_requested.connect(workbench.files.use_samples)
        view.images.camera_chosen.connect(self._on_camera_chosen)
        view.intrinsics.discovery_requested.connect(self.discovery_requested)
        view.settings.settings_changed.connect(self._live.configure)
        workbench.selection.changed.connect(self._on_workbench_changed)
        workbench.run.changed.connect(self._on_swing_changed)
        self._live.image_shown.connect(self._on_image_shown)
        self._live.connection_changed.connect(self._on_connection_changed)
        self._live.other_changed.connect(self._on_other_changed)
        self._live.settings_applied.connect(self._show_connection)
        self._live.failed.connect(self._on_failed)
        workbench.notifications.withdrawn.connect(self._show_connection)

        self._refresh()
        self._on_workbench_changed()

    @override
    def lead(self) -> str:
        return self.tr(
            "Check that the LEDs are bright and in focus, that the intrinsics match "
            "this camera, and that there is no stray light."
        )

    @override
    def is_complete(self) -> bool:
        return not self._selection.preparation.camera_missing_inputs()

    @override
    def why_closed(self) -> str:
        return first_missing(self._selection.preparation.start_missing_inputs())

    @override
    def main_action(self) -> MainAction:
        why_not = first_missing(self._selection.preparation.camera_missing_inputs())
        if not why_not and self._live.worst_connection is Connection.LOST:
            why_not = self.tr("Camera connection lost. Reconnecting automatically.")
        return MainAction(self.tr("Continue to the LEDs"), why_not)

    @override
    def entered(self) -> None:
        self._is_shown = True
        if not self._live.is_open:
            self._camera.open()
        if self._selection.preparation.source == NO_SOURCE:
            self._view.source.set_searching(True)
            self._camera.search_all()
        self._show_connection()
        self._live.show_pen()

    @override
    def left(self) -> None:
        self._is_shown = False
        self._view.exposure.end_adjustment()
        self._show_camera(0)
        self._view.stray_light.give_up()

    @override
    def shut_down(self) -> None:
        self._view.rig.shut_down()
        self._view.intrinsics.shut_down()
        self._view.beside.shut_down()

    @override
    def _refresh(self) -> None:
        self._on_swing_changed()
        self._show_connection()
        self.changed.emit()

    def _on_workbench_changed(self) -> None:
        now = self._selection.preparation
        self._view.source.set_value(now.source)
        self._view.beside.follow(now.source)
        self._view.intrinsics.set_value(now.camera_file)
        self._view.intrinsics.set_image_size(now.image_size)
        self._view.intrinsics.setVisible(now.second is None)
        self._show_camera(self._live.chosen)
        self._show_connection()  # the missing input may have changed
        is_recorded = now.source.kind == SourceKind.RECORDED
        self._view.images.set_recorded(now.origin if is_recorded else None)
        self._view.focus.set_recorded(is_recorded)
        self._view.stray_light.show_mask()
        self.changed.emit()

    def _on_source_chosen(self, source: SourceChoice) -> None:
        chosen = self._selection.preparation.with_source(source)
        self._selection.set_preparation(chosen)
        has_files = chosen.camera_file is not None or chosen.pen_file is not None
        if source.kind == SourceKind.SIMULATED and not has_files:
            self._chosen_files.use_samples()

    def _on_camera_chosen(self, camera: int) -> None:
        self._view.exposure.end_adjustment()
        self._view.stray_light.give_up()
        self._show_camera(camera)

    def _show_camera(self, camera: int) -> None:
        """Show one of the cameras there are, by its number from 0."""
        self._live.choose(camera)
        self._view.images.set_cameras(self._live.n_cameras, self._live.chosen)
        self._view.stray_light.show_mask()

    def _on_other_changed(self, connection: Connection) -> None:
        self._view.images.set_cameras(self._live.n_cameras, self._live.chosen)
        if connection is Connection.LOST:
            self._on_lost()
        self._show_connection()
        self.changed.emit()

    def _on_image_shown(self, shown: DisplayedImage) -> None:
        is_live = self._live.connection is Connection.STREAMING
        if not (self._is_shown and is_live):  # the last image comes after the loss
            return
        seen = shown.seen
        labels = None if seen.detection is None else seen.detection.labels
        inspection = inspect(seen.spots, labels)
        self._view.images.set_image(shown, self._live.stats)
        self._view.settings.set_stats(self._live.stats)
        self._view.rig.show_step(seen)
        self._view.exposure.set_value(inspection.exposure)
        self._view.focus.add(inspection)
        outcome = self._view.stray_light.outcome().value()
        self._view.stray_light.feed(seen)
        self._view.exposure.adjust(seen, inspection)
        if self._view.stray_light.outcome().value() != outcome:
            self._live.hurry()  # it searches
            self._view.reveal_stray_light()

    def _on_connection_changed(self, connection: Connection) -> None:
        if connection is Connection.LOST:
            self._on_lost()
        if connection is not Connection.STREAMING:
            self._view.exposure.end_adjustment()
            self._view.exposure.set_value(Exposure())
            self._view.rig.set_step(None, None)
            self._view.focus.clear()
        elif self._is_shown:
            self._live.show_pen()
        self._show_connection()
        self.changed.emit()

    def _on_lost(self) -> None:
        if not self._run.status.is_capturing:  # else the swing does
            self._sounds.play(Sound.LOST)

    def _on_failed(self) -> None:
        self._sounds.play(Sound.FAILED)
        self._show_connection()

    def _show_connection(self) -> None:
        connection, why = self._live.connection, self._live.why_no_images
        is_live = connection is Connection.STREAMING
        self._view.images.set_connection(connection, why or self._why_closed())
        for camera, panel in enumerate((self._view.source, self._view.second)):
            panel.set_faulty(self._live.has_failed(camera))
        self._view.stray_light.set_live(is_live)
        caps = self._live.caps if is_live else None
        source = self._selection.preparation.source
        is_camera = is_live and source.kind != SourceKind.RECORDED  # else a folder
        self._view.intrinsics.set_serial(self._live.serial if is_camera else "")
        self._view.exposure.set_camera(caps, self._live.settings)
        self._view.settings.set_camera(caps, self._live.settings)

    def _why_closed(self) -> str:
        """Return why no camera is open though none has failed."""
        for lack in self._selection.preparation.camera_missing_inputs():
            if lack in _LACKS_SOURCE:
                return missing_input_text(lack)
        return self.tr("No camera is open.")

    def _on_swing_changed(self) -> None:
        status, remark = self._run.status, StatusMessage()
        if status.is_capturing:
            words = self.tr(
                "A swing is in progress. Changing the source ends it; a change of "
                "intrinsics or mask applies from the next swing."
            )
            remark = StatusMessage.warning(words)
        self._view.swing_message.set_value(remark)
        self._view.intrinsics.set_swing(status.solution)
