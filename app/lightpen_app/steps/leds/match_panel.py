"""The live image, and the match of its LEDs with the table."""

from collections import deque
from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from PySide6.QtCore import QObject, QTimer, Signal
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QGroupBox
from typing_extensions import override

from lightpen.cameras.protocol import Connection
from lightpen.detection.pen_detection import PenDetection
from lightpen.detection.reasons import Reason
from lightpen.detection.spots import Spots
from lightpen.estimation.contact.single_images import USUAL_SIGMA
from lightpen.model.camera import Camera
from lightpen.model.pen import Pen
from lightpen.pen_check.match import PenMatch, add_view, match_pen
from lightpen_app.look.languages import worded
from lightpen_app.look.layouts import vertical_layout
from lightpen_app.look.phrases import reason_text
from lightpen_app.look.signs import Sign
from lightpen_app.look.theme import TextSize, Tone
from lightpen_app.look.words import number_text
from lightpen_app.steps.leds.file_panel import LedFilePanel
from lightpen_app.widgets.fields import Translated
from lightpen_app.widgets.image_view import ImageView, Marker
from lightpen_app.widgets.live_markers import live_markers
from lightpen_app.widgets.state_banner import (
    SignLabel,
    State,
    StateBanner,
    StatusMessage,
)
from lightpen_app.work.job import LatestJob
from lightpen_app.work.live_view import DisplayedImage
from lightpen_app.work.workbench import Workbench

N_SMOOTHED = 20  # images that are reported together: one second
N_FINDINGS = 4
TALLEST = 0.9  # height of the image over its width; sensors are flatter
PERIOD_MS = 1000


class PenWatch(QObject):
    """Compares a pen with the detections, at most once a second."""

    value_changed = Signal(object)  # PenMatch of the views so far; None until computed

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._camera: Camera | None = None
        self._pen: Pen | None = None
        self._views: tuple[Spots, ...] = ()
        self._compared: tuple[Spots, ...] = ()
        self._last: PenMatch | None = None
        self._job = LatestJob(self)
        self._timer = QTimer(self, interval=PERIOD_MS)

        # Connections
        self._timer.timeout.connect(self._compare)

    def set_pen(self, camera: Camera | None, pen: Pen | None) -> None:
        """Compare with another pen; views of the same camera stay."""
        if camera is not self._camera:
            self._views = ()
        if camera is self._camera and pen is self._pen:
            return
        self._camera, self._pen, self._last = camera, pen, None
        self._forget()
        self._compare()

    def last_match(self, camera: Camera | None, pen: Pen | None) -> PenMatch | None:
        """Return the last comparison of the pen; None without one."""
        is_same = camera is self._camera and pen is self._pen
        return self._last if is_same else None

    def add(self, spots: Spots) -> None:
        """Add the detection in an image."""
        self._views = add_view(self._views, spots)

    def start(self) -> None:
        """Begin with no views."""
        self._views = ()
        self._forget()
        self._timer.start()

    def stop(self) -> None:
        """Compare no more."""
        self._timer.stop()
        self._job.cancel()

    def _forget(self) -> None:
        self._compared = ()
        self._job.cancel()
        self.value_changed.emit(None)

    def _compare(self) -> None:
        camera, pen, views = self._camera, self._pen, self._views
        if camera is None or pen is None or not views or self._job.is_running:
            return
        if views is self._compared:
            return
        self._compared = views
        self._job.start(
            lambda report: match_pen(camera, pen, views),
            self._on_compared,
            # The views after these are compared again.
            crashed=lambda: self.value_changed.emit(None),
        )

    def _on_compared(self, match: PenMatch) -> None:
        self._last = match
        self.value_changed.emit(match)


class MatchPanel(Translated, QGroupBox):
    """Shows live images with numbered LEDs, and how the pen of the open file fits."""

    def __init__(self, workbench: Workbench, leds: LedFilePanel) -> None:
        super().__init__()
        self.say(self, self.tr("Live match"))
        self._leds, self._selection = leds, workbench.selection
        self._run, self._live = workbench.run, workbench.live
        self._is_shown = False
        self.watch = PenWatch(self)
        self._match: PenMatch | None = None
        self._detection: PenDetection | None = None
        self._sigmas: deque[float] = deque(maxlen=N_SMOOTHED)
        self._counts: deque[int] = deque(maxlen=N_SMOOTHED)
        self._why_none = ""
        self._has_frame = True
        self._is_swung = False

        # Widgets
        self.view = self.say(
            ImageView(),
            tip=self.tr(
                "Wheel or + and - to zoom, arrow keys to move, 0 for the whole image."
            ),
        )
        self._banner = StateBanner(TextSize.TITLE)
        self._messages = tuple(SignLabel() for _ in range(N_FINDINGS))

        # Layout
        vertical_layout(self, (self.view, 1), self._banner, *self._messages, 0)

        # Connections
        leds.changed.connect(self._on_file_changed)
        self._selection.changed.connect(self._set_region)
        self._live.image_shown.connect(self._on_image_shown)
        self._live.connection_changed.connect(self._on_connection_changed)
        self._live.other_changed.connect(self._on_connection_changed)

        self._refresh()

    def set_image(self, shown: DisplayedImage) -> None:
        """Show another image."""
        detection = shown.seen.detection
        if detection is None or not detection.has_pose:
            self._forget()
        else:
            self._sigmas.append(detection.sigma)
            self._counts.append(detection.n_leds)
        self._detection = detection
        markers = self._toned(live_markers(shown.seen))
        self.view.set_half(shown.half, shown.size, tuple(markers))
        self._refresh_state()

    def clear(self) -> None:
        """Clear the image."""
        self._detection = None
        self._forget()
        self.view.clear()
        self._refresh_state()

    def start(self) -> None:
        """Detect the pen of the open file from now on."""
        self._is_shown = True
        self.clear()
        self.watch.start()
        self._live.show_pen()
        self._set_region()
        self._turn_simulated_pen()

    def stop(self) -> None:
        """Stop; detect the pen in use again."""
        self._is_shown = False
        self.watch.stop()
        if not self._run.status.is_capturing:
            self._live.set_region(self._selection.preparation.region)
            if self._live.operator is not None:
                self._live.operator.hold()

    def _turn_simulated_pen(self) -> None:
        """Show a simulated pen from all sides, as an operator turns a real one."""
        if self._is_shown and self._live.operator is not None:
            self._live.operator.swing()

    def doubt(self) -> str:
        """Return why the file may belong to another pen; empty if it fits."""
        camera = self._selection.preparation.camera
        match = self.watch.last_match(camera, self._sought())
        if match is None or not match.findings:
            return ""
        return worded(match.findings[0].message)

    def _why_unknown(self) -> str:
        """Return the missing inputs of the pen detection."""
        preparation = self._selection.preparation
        if not self._live.is_open:
            return self.tr("No camera is open. See the step Camera.")
        if self._live.worst_connection is Connection.LOST:
            return self.tr("Camera connection lost. Reconnecting automatically.")
        if preparation.camera is None:
            return self.tr("Intrinsics file missing. See the step Camera.")
        if self._sought() is None:
            return self.tr("Open the LED file first.")
        return ""

    def _sought(self) -> Pen | None:
        opened = self._leds.opened
        return None if opened is None else opened.sought

    def _on_file_changed(self) -> None:
        opened = self._leds.opened
        self._has_frame = opened is None or not opened.problem
        self._set_region()
        self._refresh()

    def _set_region(self) -> None:
        """Set the region of interest for the pen of the open file, if it is shown."""
        if not self._is_shown:
            return
        preparation = self._selection.preparation
        pen, status = self._sought(), self._run.status
        self.watch.set_pen(preparation.camera, pen)
        swung = status.setup if status.is_capturing else None
        self._is_swung = swung is not None and _differ(swung.pen, pen)
        if not status.is_capturing:
            region = preparation.region
            if preparation.pen_file is None:
                region = replace(region, pen=pen)
            self._live.set_region(region)
        self._refresh()

    def _on_image_shown(self, shown: DisplayedImage) -> None:
        is_live = self._live.worst_connection is Connection.STREAMING
        if self._is_shown and is_live:  # the last image comes after the loss
            self.set_image(shown)
            self.watch.add(shown.seen.spots)

    def _on_connection_changed(self) -> None:
        self._turn_simulated_pen()
        if self._is_shown:
            self._live.show_pen()
            if self._live.worst_connection is not Connection.STREAMING:
                self.clear()
            self._refresh()

    def set_value(self, value: PenMatch | None) -> None:
        """Show how the pen fits the views; None while unknown."""
        self._match = value
        self._refresh()

    def reasons(self) -> dict[int, str]:
        """Return the findings on LEDs, by number."""
        findings = () if self._match is None else self._match.findings
        return {led: worded(each.message) for each in findings for led in each.leds}

    @override
    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        width = self.contentsRect().width()
        self.view.setMaximumHeight(round(TALLEST * width))

    def _forget(self) -> None:
        self._sigmas.clear()
        self._counts.clear()

    def _refresh(self) -> None:
        self.view.set_message(self.tr("No image yet"))
        self._why_none = self._why_unknown()
        found = self._found()
        for i, remark in enumerate(self._messages):
            remark.set_value(found[i] if i < len(found) else StatusMessage())
            remark.setVisible(i < len(found))
        self._refresh_state()

    def _refresh_state(self) -> None:
        self._banner.set_value(self._state())

    def _toned(self, markers: Iterable[Marker]) -> Iterable[Marker]:
        """Yield the rings; mismatched LEDs have another tone."""
        marked = {str(led) for led in self.reasons()}
        for marker in markers:
            if marker.label in marked:
                tone = Tone.WARN
                yield Marker(marker.x, marker.y, marker.radius, marker.label, tone)
            else:
                yield marker

    def _state(self) -> State:
        detection = self._detection
        if detection is None or self._why_none:
            return State(self.tr("No match yet"), "", Sign.WAIT, Tone.QUIET)
        if self._is_swung:
            word = self.tr("Swing in progress")
            text = self.tr("Rings: expected from the LED file")
            return State(word, text, Sign.WAIT, Tone.QUIET)
        if detection.reason is not Reason.NONE:
            word = self.tr("Pen not found")
            text = reason_text(detection.reason)
            return State(word, text[:1].upper() + text[1:], Sign.WARNING, Tone.WARN)
        n_leds = len(detection.pixels)
        sigma = float(np.median(self._sigmas))
        n_seen = max(self._counts)  # LEDs that merge in one image do not matter
        word = self.tr("{0} of {1} LEDs").format(n_seen, n_leds)
        detail = self.tr("RMS residual {0} px").format(_pixels(sigma))
        good = n_seen == n_leds and sigma <= USUAL_SIGMA
        is_doubtful = self._match is not None and bool(self._match.findings)
        if good and self._has_frame and not is_doubtful:
            return State(word, detail, Sign.CHECK, Tone.GOOD)
        return State(word, detail, Sign.WARNING, Tone.WARN)

    def _found(self) -> list[StatusMessage]:
        match = self._match
        if self._why_none:
            return [StatusMessage.warning(self._why_none)]
        if match is None:
            return []
        if match.findings:
            remarks = [
                StatusMessage.warning(worded(each.message))
                for each in match.findings[:N_FINDINGS]
            ]
        elif not match.fits:
            words = self.tr("Tilt and turn the pen so that it is seen from all sides.")
            remarks = [StatusMessage(words, Sign.WAIT, Tone.QUIET)]
        elif not self._has_frame:
            words = self.tr(
                "The LEDs agree with the images but not with the pen frame. See the "
                "message about the file."
            )
            remarks = [StatusMessage.warning(words)]
        else:
            words = self.tr("All LEDs fit their table positions, in {0} views.")
            remarks = [StatusMessage.good(words.format(match.n_views))]
        return remarks


def _pixels(sigma: float) -> str:
    return number_text(sigma, 2 if sigma >= USUAL_SIGMA else 3)


def _differ(swung: Pen, pen: Pen | None) -> bool:
    """Return whether the LEDs of a file differ from the LEDs of the swing."""
    return pen is None or not np.array_equal(swung.leds, pen.leds)
