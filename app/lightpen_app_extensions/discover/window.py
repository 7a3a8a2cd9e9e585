"""The window of the self-calibration, shown on demand."""

import numpy as np
from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QCloseEvent
from PySide6.QtWidgets import QWidget
from typing_extensions import override

from lightpen.model.pen import DISC_DIAMETER
from lightpen_app.look.languages import worded
from lightpen_app.look.layouts import (
    fill,
    grid_layout,
    horizontal_layout,
    vertical_layout,
)
from lightpen_app.look.signs import Sign
from lightpen_app.look.theme import GRID, TextSize, Tone, text_label
from lightpen_app.widgets.bars import JobProgress
from lightpen_app.widgets.controls import PushButton
from lightpen_app.widgets.fields import Translated
from lightpen_app.widgets.fitting import FittedWindow, PageScroll
from lightpen_app.widgets.live_markers import live_markers
from lightpen_app.widgets.number_field import NumberField, is_refusing
from lightpen_app.widgets.pen_view import PenPicture, PenView
from lightpen_app.widgets.posture_dial import DialValue, PostureDial
from lightpen_app.widgets.state_banner import SignLabel, StatusMessage
from lightpen_app.work.live_view import DisplayedImage
from lightpen_app.work.workbench import Workbench
from lightpen_app_extensions.boards.view import BoardOverlay, BoardView
from lightpen_app_extensions.discover.discovery_run import (
    N_USUAL,
    DiscoveryRun,
    DiscoveryState,
)
from lightpen_extensions.boards.distortion import map_uncertainty
from lightpen_extensions.discover.found import TURNS_NEEDED, Discovery
from lightpen_extensions.discover.report import remarks_of
from lightpen_extensions.discover.scale import MeasuredLength, Request

SIDE_WIDTH = 52 * GRID
PICTURE_HEIGHT = 32 * GRID  # px, of the pen and of the dial
LONGEST, LARGEST_U, LARGEST_DISC = 2000.0, 10.0, 100.0  # mm
USUAL_U = 0.04  # mm, of a caliper
SIMULATED_U = 0.002  # mm, of the length of the simulated pen
UM = 1000.0


class DiscoveryWindow(FittedWindow, Translated, QWidget):
    """Guides a swing without files, asks for one length, and shows what is found."""

    continued = Signal()  # both files and the images of the swing are in use

    def __init__(self, workbench: Workbench, parent: QWidget | None = None) -> None:
        super().__init__(parent, Qt.WindowType.Window)
        self.say(self, self.tr("Find pen and camera"))
        self.setObjectName("discovery")
        self.resize(150 * GRID, 96 * GRID)
        self._workbench = workbench
        self._run = DiscoveryRun(workbench, self)

        # Widgets
        self._image = BoardView()
        self._instruction, self._progress = SignLabel(), JobProgress()
        self._count = text_label(TextSize.BODY)
        # Two buttons: a click on Stop as the capture ends by itself starts no other.
        self._begin = self.make_button(self.tr("Start"), self._run.start)
        self._stop = self.make_button(self.tr("Stop"), self._run.stop)
        self._dial = PostureDial()
        self._pen = PenView()
        self._how = text_label(TextSize.BODY)
        self._length = NumberField("mm", (0.0, LONGEST), 4)
        self._u = NumberField("mm", (0.0001, LARGEST_U), 4)
        self._disc = NumberField("mm", (0.1, LARGEST_DISC), 2)
        names = (
            self.tr("Distance of the LEDs"),
            self.tr("U (k = 2) of distance"),
            self.tr("Disc diameter"),
        )
        self._compute = PushButton()
        self._facts = text_label(TextSize.BODY)
        self._save = self.make_button(self.tr("Save both files and calibrate the tip"))
        self._u.set_value(USUAL_U)
        self._disc.set_value(DISC_DIAMETER)

        # Layout
        panel = QWidget()
        side = vertical_layout(panel, margins=None)
        horizontal_layout(side, (self._begin, 1), (self._stop, 1))
        fill(side, self._count, self._dial, self._pen, self._how)
        grid = grid_layout(side, spacing=(GRID, GRID // 2))
        fields = (self._length, self._u, self._disc)
        for row, (name, edit) in enumerate(zip(names, fields, strict=True)):
            label = self.say(text_label(TextSize.BODY), name)
            grid.addWidget(label, row, 0)
            grid.addWidget(edit, row, 1)
            label.setBuddy(edit)
        fill(side, self._facts, 1)
        for picture in (self._dial, self._pen):
            picture.setFixedHeight(PICTURE_HEIGHT)
        scroll = PageScroll()
        scroll.setWidget(panel)
        column = QWidget()
        column.setFixedWidth(SIDE_WIDTH)
        vertical_layout(column, (scroll, 1), self._compute, self._save)
        layout = horizontal_layout(self, spacing=2 * GRID, margins=2 * GRID)
        vertical_layout(
            layout,
            self._instruction,
            self._progress,
            (self._image, 1),
            stretch=1,
            spacing=-1,
        )
        layout.addWidget(column)

        # Connections
        workbench.live.image_shown.connect(self._on_image_shown)
        self._run.changed.connect(self._show_state)
        self._run.found_changed.connect(self._show_found)
        self._run.saved.connect(self._on_saved)
        self._compute.clicked.connect(self._on_compute_clicked)
        self._progress.cancelled.connect(self._run.cancel)
        self._save.clicked.connect(self._run.save)
        for edit in fields:
            edit.textEdited.connect(self._show_state)
            edit.value_changed.connect(self._show_state)

        self._refresh()

    def set_camera_known(self, is_known: bool) -> None:
        """Take the selected camera file as known, or find the camera as well."""
        self._run.keeps_camera = is_known

    @override
    def closeEvent(self, event: QCloseEvent) -> None:
        self._run.give_up()
        super().closeEvent(event)

    def _on_image_shown(self, shown: DisplayedImage) -> None:
        if self.isVisible() and not self._run.state.is_final:
            self._image.set_half(shown.half, shown.size, live_markers(shown.seen))

    def _on_compute_clicked(self) -> None:
        if is_refusing(self):
            return
        sigma = self._u.value() / 2
        length = MeasuredLength(None, self._length.value(), sigma)
        self._run.solve(Request((length,), self._disc.value()))

    def _on_saved(self) -> None:
        self.continued.emit()
        self.close()

    def _refresh(self) -> None:
        self._image.set_message(self.tr("No image"))
        self._length.set_empty_text(self.tr("Not specified"))
        self._show_found()

    def _show_state(self) -> None:
        state = self._run.state
        self._begin.setEnabled(not state.is_capturing)
        self._stop.setEnabled(state.is_capturing)
        n_wanted = max(N_USUAL, state.n_images)
        words = self.tr("Images: {0} of {1}").format(state.n_images, n_wanted)
        self._count.setText(words)
        self._instruction.set_value(self._instructed(state))
        self._dial.set_value(_dial_value(state))
        self._dial.setVisible(state.is_capturing or state.found is None)
        why_not = "" if state.found else self.tr("Swing the pen first.")
        if not why_not and not self._length.value():
            why_not = self.tr("Enter the distance of the LEDs.")
        self._progress.set_running(state.progress is not None)
        if state.progress is not None:
            self._progress.set_fraction(state.progress)
            why_not = self.tr("Computing")
        self._compute.set_why_not(why_not)
        self._compute.setText(self.tr("Find pen and camera"))
        nothing = self.tr("Find pen and camera first.")
        self._save.set_why_not("" if state.is_final else nothing)

    def _show_found(self) -> None:
        found, is_final = self._run.state.found, self._run.state.is_final
        self._pen.setVisible(found is not None)
        pair = _longest_pair(found)
        if pair and not self._length.value():
            self._enter_simulated_length()
        self._how.setText("" if is_final else self._how_to_measure(pair))
        self._how.setVisible(bool(self._how.text()))
        self._facts.setText(self._found_text(found) if is_final else "")
        overlay = BoardOverlay()
        if found is not None:
            self._pen.set_value(PenPicture(found.pen, found.tip_pen, frozenset(pair)))
        if found is not None and is_final and found.camera.covariance is not None:
            by_image = map_uncertainty(found.camera, found.camera.covariance)
            overlay = BoardOverlay(uncertainty=by_image)
            self._image.set_markers(())
        self._image.set_overlay(overlay)
        self._show_state()

    def _instructed(self, state: DiscoveryState) -> StatusMessage:
        if state.progress is not None:
            return StatusMessage(self.tr("Computing"), Sign.WAIT, Tone.QUIET)
        if state.fault:
            return StatusMessage.warning(state.fault)
        limit = self._workbench.selection.preparation.limits.max_uncertainty
        if state.found is not None and state.is_final:
            U = float(state.found.expanded_uncertainty.max())
            if limit < U:
                words = self.tr(
                    "U of the tip is {0:.3f} mm; the limit is {1:g} mm. Swing again "
                    "with more images and tilt, or measure the length better."
                )
                return StatusMessage.warning(words.format(U, limit))
            words = self.tr(
                "Pen and camera found. The image shows the projection uncertainty / px."
            )
            return StatusMessage.good(words)
        if not state.is_capturing and state.found is not None:
            words = self.tr("Enter the distance between the two marked LEDs.")
            if self._length.value():
                words = self.tr("Check the length, and compute pen and camera.")
        elif not state.is_capturing:
            words = self.tr(
                "Lock zoom, focus and exposure. Seat the tip in the cone, hold the "
                "LEDs towards the camera, and press Start."
            )
        elif state.guide is None:
            words = self.tr(
                "Swing the pen slowly: tilt it by 30 degrees in all directions, and "
                "turn it about its axis."
            )
        elif state.guide.is_complete:
            words = self.tr("All directions are covered. Keep swinging and turning.")
        else:
            words = self.tr("Tilt and turn the pen as the arrow shows.")
        return StatusMessage(words, Sign.NONE, Tone.PLAIN)

    def _how_to_measure(self, pair: tuple[int, ...]) -> str:
        if not pair:
            return ""
        words = self.tr(
            "Measure LEDs {0} and {1}, the marked ones, from centre to centre: with a "
            "caliper over the outer edges of both discs, minus one disc diameter. "
            "Measure at the temperature of the swing."
        )
        return words.format(*pair)

    def _enter_simulated_length(self) -> None:
        simulator = self._workbench.around.simulator
        if self._workbench.live.operator is None or simulator is None:
            return
        leds = simulator.pen.leds
        apart = np.linalg.norm(leds[:, None] - leds, axis=2)
        self._length.set_value(float(apart.max()))
        self._u.set_value(SIMULATED_U)

    def _found_text(self, found: Discovery | None) -> str:
        if found is None:
            return ""
        tip, u = found.tip_pen, found.expanded_uncertainty
        fx, u_fx = found.camera.fx, 2 * float(found.intrinsics_sigma[0])
        rows = [
            self.tr("Tip {0}: {1:.4f} \u00b1 {2:.4f} mm (k = 2)").format(
                axis, value, each
            )
            for axis, value, each in zip("xyz", tip.tolist(), u.tolist(), strict=True)
        ]
        calibration = found.calibration
        rows += [
            self.tr("LEDs: {0}, U (k = 2) up to {1:.1f} \u00b5m").format(
                found.pen.n_leds, UM * float(found.led_uncertainty.max())
            ),
            self.tr("Focal length: {0:.2f} \u00b1 {1:.2f} px (k = 2)").format(fx, u_fx),
            self.tr("Images used: {0} of {1}, noise {2:.3f} px").format(
                int(calibration.used.sum()),
                len(calibration.used),
                calibration.bundle.sigma,
            ),
            *map(worded, remarks_of(found)),
        ]
        return "\n".join(rows)


def _dial_value(state: DiscoveryState) -> DialValue:
    guide = state.guide
    if guide is None:
        return DialValue()
    return DialValue(
        counts=guide.counts[1:],
        needed=guide.needed[1:],
        posture=state.posture,
        target=guide.target if state.is_capturing else None,
        turns=guide.turns,
        turns_needed=TURNS_NEEDED,
    )


def _longest_pair(found: Discovery | None) -> tuple[int, ...]:
    """Return the numbers of the two LEDs that are farthest apart."""
    if found is None:
        return ()
    return found.lengths[0].first + 1, found.lengths[0].second + 1
