"""The step Camera: images come, well exposed, sharp, and with their intrinsics."""

import numpy as np
from PySide6.QtCore import Qt
from PySide6.QtWidgets import (
    QGridLayout,
    QHBoxLayout,
    QVBoxLayout,
    QWidget,
)
from typing_extensions import override

from lightpen.arrays import FloatArray
from lightpen.cameras.protocol import CameraSettings
from lightpen.cameras.source import FoundDevice
from lightpen.cameras.sources import absent_sources
from lightpen.cameras.worker_events import Connection
from lightpen.detection.auto_exposure import AutoExposure
from lightpen.detection.inspection import Exposure, Inspection, inspect
from lightpen.detection.mask import clicked, with_circle
from lightpen.live.looking import LiveImage
from lightpen.swing.preparation import Lack, SourceChoice, SourceKind
from lightpen_app.look.phrases import lack_text
from lightpen_app.look.signs import Sign
from lightpen_app.look.sounds import Sound, Sounds
from lightpen_app.look.theme import GRID, Tone
from lightpen_app.steps.camera.beside_control import BesideControl
from lightpen_app.steps.camera.exposure_panel import ExposurePanel, FocusPanel
from lightpen_app.steps.camera.intrinsics_control import IntrinsicsControl
from lightpen_app.steps.camera.intrinsics_panel import IntrinsicsPanel
from lightpen_app.steps.camera.live_panel import LivePanel
from lightpen_app.steps.camera.second_camera import SecondCameraChoice
from lightpen_app.steps.camera.settings_panel import SettingsPanel
from lightpen_app.steps.camera.source_panel import SourcePanel
from lightpen_app.steps.camera.stray_light_panel import StrayLightPanel
from lightpen_app.steps.page import MainAction, Page
from lightpen_app.widgets.live_markers import mask_markers, stray_markers
from lightpen_app.widgets.page_scroll import PageScroll
from lightpen_app.widgets.rearranged import Rearranged
from lightpen_app.widgets.sign_label import Remark, SignLabel
from lightpen_app.work.job import Job
from lightpen_app.work.live_view import Shown
from lightpen_app.work.workbench import Workbench

SIDE_WIDTH, NARROW_SIDE_WIDTH = 50 * GRID, 46 * GRID


class CameraPage(Rearranged, Page):
    """The step Camera."""

    key = "camera"
    shows_images = True
    narrow_below = 120 * GRID  # px; then it has its panels all at the side

    def __init__(
        self, workbench: Workbench, sounds: Sounds, parent: QWidget | None = None
    ) -> None:
        super().__init__(parent)
        self._workbench, self._sounds = workbench, sounds
        self._live = workbench.live
        self._is_shown = False
        self._settings = CameraSettings()  # in force
        self._trouble = ""  # the last, of the camera or of a swing
        self._sentence = ""  # why no images come
        self._adjustment: AutoExposure | None = None

        # Widgets
        self._swing_remark = SignLabel()
        self._source = SourcePanel()
        self._second = SecondCameraChoice(workbench)
        self._more = SettingsPanel()
        self._intrinsics = IntrinsicsPanel()
        self._stray = StrayLightPanel()
        self._images = LivePanel()
        self._exposure = ExposurePanel()
        self._focus = FocusPanel()

        self._searching = self._source  # for whom cameras are looked for
        self._beside = BesideControl(workbench, self._source)
        self._files = IntrinsicsControl(workbench, self._intrinsics, self)

        # Layout
        self._arrange()

        # Connections
        self._source.value_changed.connect(self._on_source_chosen)
        self._source.retry_requested.connect(self._workbench.open_camera)
        self._source.search_requested.connect(self._on_search_requested)
        self._second.chosen.connect(self._forget_trouble)
        self._second.search_requested.connect(self._on_second_search_requested)
        self._images.camera_chosen.connect(self._on_camera_chosen)
        self._more.settings_changed.connect(self._live.configure)
        self._source.samples_requested.connect(self._on_samples_requested)
        self._stray.found_changed.connect(self._mark)
        self._stray.mask_requested.connect(self._on_mask_requested)
        self._stray.clear_requested.connect(self._on_clear_requested)
        self._stray.cover_requested.connect(self._on_cover_requested)
        self._stray.drawing_toggled.connect(self._images.view().set_draws_circles)
        self._images.view().pixel_clicked.connect(self._on_image_clicked)
        self._images.view().circle_drawn.connect(self._on_circle_drawn)
        self._exposure.exposure_changed.connect(self._on_exposure_asked)
        self._exposure.gain_changed.connect(self._on_gain_asked)
        self._exposure.adjustment_requested.connect(self._on_adjustment_requested)
        self._workbench.search.succeeded.connect(self._on_cameras_found)
        self._workbench.search.failed.connect(self._on_search_failed)
        self._workbench.changed.connect(self._on_workbench_changed)
        self._workbench.run.changed.connect(self._on_swing_changed)
        self._live.image_shown.connect(self._on_image_shown)
        self._live.connection_changed.connect(self._on_connection_changed)
        self._live.other_changed.connect(self._on_other_changed)
        self._live.settings_applied.connect(self._on_settings_applied)
        self._live.troubled.connect(self._on_troubled)
        self._live.failed.connect(self._on_failed)
        self._live.relieved.connect(self._on_relieved)

        self._retranslate()
        self._on_workbench_changed()
        self._look_for_libraries()

    @override
    def title(self) -> str:
        return self.tr("Camera")

    @override
    def lead(self) -> str:
        return self.tr(
            "See that the LEDs are bright and sharp, that the intrinsics are those of "
            "this camera, and that nothing else shines."
        )

    @override
    def is_complete(self) -> bool:
        return not self._workbench.preparation.camera_lacks()

    @override
    def why_closed(self) -> str:
        return _first_text(self._workbench.preparation.start_lacks())

    @override
    def main_action(self) -> MainAction:
        why_not = _first_text(self._workbench.preparation.camera_lacks())
        if not why_not and self._live.worst_connection is Connection.LOST:
            why_not = self.tr("The camera is lost. It is looked for until it is back.")
        return MainAction(self.tr("Continue to the LEDs"), why_not)

    @override
    def entered(self) -> None:
        self._is_shown = True
        if not self._live.is_open:
            self._workbench.open_camera()
        self._show_connection()
        self._show_pen()

    @override
    def left(self) -> None:
        self._is_shown = False
        self._end_adjustment()
        self._show_camera(0)
        self._stray.give_up()
        self._stray.end_drawing()
        self._stray.uncover()

    @override
    def shut_down(self) -> None:
        self._second.shut_down()
        self._files.shut_down()
        self._beside.shut_down()

    @override
    def _retranslate(self) -> None:
        self._remark_swing()
        self._show_connection()
        self.changed.emit()

    def _arrange(self) -> None:
        side = QWidget()
        self._panels = panels = QVBoxLayout(side)
        panels.setContentsMargins(0, 0, 0, 0)
        panels.setSpacing(2 * GRID)
        panels.addWidget(self._swing_remark)
        for panel in (
            *(self._source, self._more, self._intrinsics),
            *(self._second, self._stray),
        ):
            panels.addWidget(panel)
        panels.addStretch(1)
        self._side = scroll = PageScroll()
        scroll.setWidget(side)
        scroll.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)

        self._foot = foot = QHBoxLayout()
        foot.setSpacing(2 * GRID)
        self._layout = layout = QGridLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(self._images, 0, 0)
        layout.addLayout(foot, 1, 0)
        self._use_room()  # before the side: the order of the Tab key
        layout.addWidget(scroll, 0, 1, 2, 1)
        layout.setRowStretch(0, 1)
        layout.setColumnStretch(0, 1)

    @override
    def _use_room(self) -> None:
        """Put exposure and focus below the image, or at the side of a narrow page."""
        is_narrow = self._room.is_narrow
        if is_narrow:
            self._panels.insertWidget(0, self._exposure)
            self._panels.insertWidget(1, self._focus)
        else:
            self._foot.addWidget(self._exposure, 3)
            self._foot.addWidget(self._focus, 2)
        self._layout.setHorizontalSpacing(2 * GRID if is_narrow else 3 * GRID)
        # The layout spaces out an empty foot, too.
        self._layout.setVerticalSpacing(0 if is_narrow else 2 * GRID)
        self._side.setFixedWidth(NARROW_SIDE_WIDTH if is_narrow else SIDE_WIDTH)

    # What is chosen

    def _on_workbench_changed(self) -> None:
        now = self._workbench.preparation
        self._source.set_value(now.source)
        if self._beside.follow(now.source):
            self._show_connection()  # what was lacking is another thing now
        self._intrinsics.set_value(now.camera_file)
        self._intrinsics.set_image_size(now.image_size)
        self._intrinsics.setVisible(now.second is None)
        self._show_camera(self._live.chosen)
        self._show_connection()  # what is missing to open one may be another
        is_recorded = now.source.kind == SourceKind.RECORDED
        self._images.set_recorded(now.origin if is_recorded else None)
        self._focus.set_recorded(is_recorded)
        self._stray.set_n_masked(len(self._mask))
        self._mark()
        self.changed.emit()

    def _on_source_chosen(self, source: SourceChoice) -> None:
        self._forget_trouble()
        chosen = self._workbench.preparation.with_source(source)
        self._workbench.set_preparation(chosen)
        has_files = chosen.camera_file is not None or chosen.pen_file is not None
        if source.kind == SourceKind.SIMULATED and not has_files:
            self._workbench.use_sample_files()

    def _look_for_libraries(self) -> None:
        """Find out which libraries of cameras are installed, beside the window."""
        job = Job(lambda _: absent_sources(), self)

        # Connections
        job.succeeded.connect(self._source.set_absent)
        job.succeeded.connect(self._second.source().set_absent)
        job.start()

    def _on_search_requested(self) -> None:
        self._search_for(self._source)

    def _on_second_search_requested(self) -> None:
        self._search_for(self._second.source())

    def _search_for(self, panel: SourcePanel) -> None:
        self._searching.set_searching(False)
        self._searching, source = panel, panel.value()
        self._workbench.search.start(source.kind, source.producer)
        panel.set_searching(True)

    def _on_cameras_found(self, found: tuple[FoundDevice, ...]) -> None:
        if self._searching.is_searching:  # else another source is chosen by now
            self._searching.set_searching(False)
            self._searching.set_found(found)

    def _on_search_failed(self, why: str) -> None:
        if self._searching.is_searching:
            self._searching.set_searching(False)
            self._searching.set_search_problem(why)

    # Two cameras

    def _on_camera_chosen(self, camera: int) -> None:
        self._end_adjustment()
        self._stray.give_up()
        self._show_camera(camera)

    def _show_camera(self, camera: int) -> None:
        """Show one of the cameras there are, by its number from 0."""
        self._live.choose(camera)
        self._images.set_cameras(self._live.n_cameras, self._live.chosen)
        self._stray.set_n_masked(len(self._mask))
        self._mark()

    @property
    def _mask(self) -> FloatArray:
        """Stray light in the images that are shown, (M, 3), px."""
        return self._workbench.preparation.mask_of(self._live.chosen)

    def _on_other_changed(self, connection: Connection) -> None:
        self._images.set_cameras(self._live.n_cameras, self._live.chosen)
        if connection is Connection.LOST:
            self._on_lost()
        self.changed.emit()

    def _on_exposure_asked(self, exposure_us: float) -> None:
        self._end_adjustment()
        self._live.set_exposure(exposure_us)

    def _on_gain_asked(self, gain_db: float) -> None:
        self._end_adjustment()
        self._live.set_gain(gain_db)

    def _on_adjustment_requested(self, begins: bool) -> None:
        self._adjustment = AutoExposure.begun(self._settings) if begins else None
        self._exposure.set_adjustment(self._adjustment)

    def _end_adjustment(self) -> None:
        self._on_adjustment_requested(False)

    def _adjust(self, seen: LiveImage, inspection: Inspection) -> None:
        """Go on with the adjustment of the exposure, if one is under way."""
        before, caps = self._adjustment, self._live.caps
        if before is None or caps is None:
            return
        self._live.hurry()
        self._adjustment = now = before.after(seen.frame, seen.spots, inspection, caps)
        exposure_us, gain_db = now.asked.exposure_us, now.asked.gain_db
        if exposure_us is not None and exposure_us != before.asked.exposure_us:
            self._live.set_exposure(exposure_us)
        if gain_db is not None and gain_db != before.asked.gain_db:
            self._live.set_gain(gain_db)
        self._exposure.set_adjustment(now)

    def _on_samples_requested(self) -> None:
        self._workbench.use_sample_files()

    def _on_mask_requested(self, circles: FloatArray) -> None:
        mask = np.concatenate([self._mask, circles])
        self._set_mask(mask)

    def _on_clear_requested(self) -> None:
        self._set_mask(np.zeros((0, 3)))

    def _on_image_clicked(self, x: float, y: float) -> None:
        spots = self._images.spots()
        if self._stray.is_drawing and spots is not None:
            self._set_mask(clicked(self._mask, spots, np.array([x, y])))

    def _on_circle_drawn(self, x: float, y: float, radius: float) -> None:
        circle = np.array([x, y, radius])
        self._set_mask(with_circle(self._mask, circle))

    def _set_mask(self, mask: FloatArray) -> None:
        now = self._workbench.preparation
        self._workbench.set_preparation(now.with_mask(self._live.chosen, mask))

    # What the camera does

    def _on_image_shown(self, shown: Shown) -> None:
        is_live = self._live.connection is Connection.STREAMING
        if not (self._is_shown and is_live):  # the last image comes after the loss
            return
        seen = shown.seen
        labels = None if seen.sighting is None else seen.sighting.labels
        inspection = inspect(seen.spots, labels)
        self._images.set_image(shown, self._live.stats)
        self._more.set_stats(self._live.stats)
        self._second.tell_step(seen)
        self._exposure.set_value(inspection.exposure)
        self._focus.add(inspection)
        outcome = self._stray.outcome().value()
        self._stray.feed(seen)
        self._adjust(seen, inspection)
        if self._stray.outcome().value() != outcome:
            self._live.hurry()  # it searches
            self._side.reveal(self._stray)

    def _on_connection_changed(self, connection: Connection) -> None:
        is_lost = self._live.worst_connection is Connection.LOST  # the other may be
        if connection in (Connection.OPENING, Connection.STREAMING) and not is_lost:
            self._forget_trouble()
        if connection is Connection.LOST:
            self._on_lost()
        if connection is Connection.OPENING:
            self._stray.uncover()  # another operator holds the pen
        if connection is not Connection.STREAMING:
            self._end_adjustment()
            self._exposure.set_value(Exposure())
            self._second.forget_step()
            self._focus.clear()
        if connection is Connection.STREAMING:
            self._show_pen()
        self._show_connection()
        self.changed.emit()

    def _on_lost(self) -> None:
        if not self._workbench.run.status.is_capturing:  # else the swing does
            self._sounds.play(Sound.LOST)
        self._raise_trouble(self._trouble)

    def _on_settings_applied(self, settings: CameraSettings) -> None:
        self._settings = settings
        self._show_connection()

    def _on_troubled(self, sentence: str) -> None:
        self._trouble = sentence

    def _on_failed(self, sentence: str) -> None:
        self._sounds.play(Sound.FAILED)
        self._raise_trouble(sentence)
        self._show_connection()

    def _on_relieved(self, sentence: str) -> None:
        if sentence == self._sentence:
            self._forget_trouble()

    def _on_cover_requested(self, covers: bool) -> None:
        operator = self._live.operator
        if operator is None:
            return
        if covers:
            operator.cover()
        else:
            operator.uncover()

    def _raise_trouble(self, sentence: str) -> None:
        """Say why no images come, in a notice that goes once they do."""
        self._sentence = sentence
        self.notice_raised.emit(sentence)

    def _forget_trouble(self) -> None:
        """Take away what the camera's last trouble said: it is over."""
        if self._sentence:
            self._sentence = ""
            self.notice_raised.emit("")

    def _show_connection(self) -> None:
        connection = self._live.connection
        is_live = connection is Connection.STREAMING
        is_closed = connection is Connection.CLOSED
        self._images.set_connection(connection, self._sentence or self._why_closed())
        self._source.set_faulty(is_closed and bool(self._sentence))
        self._stray.set_live(is_live)
        self._stray.set_has_operator(self._live.operator is not None)
        caps = self._live.caps if is_live else None
        self._intrinsics.set_serial(self._live.serial if is_live else "")
        self._exposure.set_camera(caps, self._settings)
        self._more.set_camera(caps, self._settings)

    def _why_closed(self) -> str:
        """Return why no camera is open though none has failed."""
        for lack in self._workbench.preparation.camera_lacks():
            if lack in (Lack.SOURCE_PLACE, Lack.DEVICE):
                return lack_text(lack)
        return self.tr("No camera is open.")

    def _show_pen(self) -> None:
        if self._is_shown:
            self._live.show_pen()

    def _mark(self) -> None:
        """Mark what is masked, and what the search for stray light found."""
        masked = mask_markers(self._mask)
        found = stray_markers(self._stray.found(), self.tr("stray"))
        self._images.set_extra_markers((*masked, *found))

    def _on_swing_changed(self) -> None:
        self._remark_swing()
        self._intrinsics.set_swing(self._workbench.run.status.solution)

    def _remark_swing(self) -> None:
        remark = Remark()
        if self._workbench.run.status.is_capturing:
            words = self.tr(
                "A swing is under way. Another source ends it; other intrinsics and "
                "another mask count from the next swing on."
            )
            remark = Remark(words, Sign.WARNING, Tone.WARN)
        self._swing_remark.set_value(remark)


def _first_text(lacks: tuple[Lack, ...]) -> str:
    return lack_text(lacks[0]) if lacks else ""
