"""The LEDs of the file, compared with the live or simulated images."""

from dataclasses import replace

import numpy as np
from PySide6.QtCore import QObject, QTimer, Signal

from lightpen.cameras.protocol import Connection
from lightpen.detection.spots import Spots
from lightpen.model.camera import Camera
from lightpen.model.pen import Pen
from lightpen.pen_check.match import PenMatch, add_view, match_pen
from lightpen_app.steps.leds.file_panel import LedFileControl
from lightpen_app.steps.leds.match_panel import MatchPanel
from lightpen_app.work.job import LatestJob
from lightpen_app.work.live_view import DisplayedImage, LiveView
from lightpen_app.work.selection import Selection
from lightpen_app.work.swing_run import SwingRun

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


class MatchControl(QObject):
    """Shows live images in its panel, and how the pen of the open file fits them."""

    def __init__(
        self,
        leds: LedFileControl,
        selection: Selection,
        run: SwingRun,
        live: LiveView,
        panel: MatchPanel,
    ) -> None:
        super().__init__(panel)
        self._leds, self._selection = leds, selection
        self._run, self._live, self._panel = run, live, panel
        self._is_shown = False
        self.watch = PenWatch(self)

        # Connections
        leds.changed.connect(self._on_file_changed)
        selection.changed.connect(self._region)
        live.image_shown.connect(self._on_image_shown)
        live.connection_changed.connect(self._on_connection_changed)
        live.other_changed.connect(self._on_connection_changed)

    def start(self) -> None:
        """Detect the pen of the open file from now on."""
        self._is_shown = True
        self._panel.clear()
        self.watch.start()
        self._live.show_pen()
        self._region()
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
        return self._panel.doubt_of(match)

    def retranslate(self) -> None:
        """Show the missing inputs of the pen detection."""
        preparation = self._selection.preparation
        if not self._live.is_open:
            why = self.tr("No camera is open. See the step Camera.")
        elif self._live.worst_connection is Connection.LOST:
            why = self.tr("Camera connection lost. Reconnecting automatically.")
        elif preparation.camera is None:
            why = self.tr("Intrinsics file missing. See the step Camera.")
        elif self._sought() is None:
            why = self.tr("Open the LED file first.")
        else:
            why = ""
        self._panel.set_why_unknown(why)

    def _sought(self) -> Pen | None:
        opened = self._leds.opened
        return None if opened is None else opened.sought

    def _on_file_changed(self) -> None:
        opened = self._leds.opened
        self._panel.set_has_frame(opened is None or not opened.problem)
        self._region()

    def _region(self) -> None:
        """Set the region of interest for the pen of the open file, if it is shown."""
        if not self._is_shown:
            return
        preparation = self._selection.preparation
        pen, status = self._sought(), self._run.status
        self.watch.set_pen(preparation.camera, pen)
        swung = status.setup if status.is_capturing else None
        self._panel.set_swung(swung is not None and _differ(swung.pen, pen))
        if not status.is_capturing:
            region = preparation.region
            if preparation.pen_file is None:
                region = replace(region, pen=pen)
            self._live.set_region(region)
        self.retranslate()

    def _on_image_shown(self, shown: DisplayedImage) -> None:
        is_live = self._live.worst_connection is Connection.STREAMING
        if self._is_shown and is_live:  # the last image comes after the loss
            self._panel.set_image(shown)
            self.watch.add(shown.seen.spots)

    def _on_connection_changed(self) -> None:
        self._turn_simulated_pen()
        if self._is_shown:
            self._live.show_pen()
            if self._live.worst_connection is not Connection.STREAMING:
                self._panel.clear()
            self.retranslate()


def _differ(swung: Pen, pen: Pen | None) -> bool:
    """Return whether the LEDs of a file differ from the LEDs of the swing."""
    return pen is None or not np.array_equal(swung.leds, pen.leds)
