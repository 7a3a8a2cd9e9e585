"""Exposure of the displayed camera: manual, or automatic by the LEDs."""

from PySide6.QtCore import QObject

from lightpen.detection.auto_exposure import AutoExposure
from lightpen.detection.inspection import Inspection
from lightpen.live.pipeline import LiveImage
from lightpen_app.steps.camera.exposure_panel import ExposurePanel
from lightpen_app.work.live_view import LiveView


class ExposureControl(QObject):
    """Carries out requests of the exposure panel."""

    def __init__(self, live: LiveView, panel: ExposurePanel) -> None:
        super().__init__(panel)
        self._live, self._panel = live, panel
        self._adjustment: AutoExposure | None = None

        # Connections
        panel.exposure_changed.connect(self._on_exposure_asked)
        panel.gain_changed.connect(self._on_gain_asked)
        panel.adjustment_requested.connect(self._on_adjustment_requested)

    def end_adjustment(self) -> None:
        """Keep the present exposure."""
        self._on_adjustment_requested(False)

    def adjust(self, seen: LiveImage, inspection: Inspection) -> None:
        """Continue an adjustment in progress by one more image."""
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
        self._panel.set_adjustment(now)

    def _on_exposure_asked(self, exposure_us: float) -> None:
        self.end_adjustment()
        self._live.set_exposure(exposure_us)

    def _on_gain_asked(self, gain_db: float) -> None:
        self.end_adjustment()
        self._live.set_gain(gain_db)

    def _on_adjustment_requested(self, begins: bool) -> None:
        self._adjustment = AutoExposure.begun(self._live.settings) if begins else None
        self._panel.set_adjustment(self._adjustment)
