"""Short description of the live detection during a swing."""

from collections import deque

from PySide6.QtCore import QObject

from lightpen.live.pipeline import LiveImage
from lightpen_app.work.live_images import DisplayedImage
from lightpen_app.work.swing_run import SwingRun

RATE_S = 2.0  # over which the images are counted
N_LAST = 20  # images that decide whether the spots match the pen
MOST = 0.8  # of them
MISSED = 2  # LEDs, more than a finger and a stray light explain


class LiveDetectionView(QObject):
    """Shows the live detection beside its swing."""

    def __init__(self, run: SwingRun, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._run = run
        self._seen: LiveImage | None = None
        self._arrivals: deque[tuple[float, int]] = deque()  # time, number of the image
        self._unfit: deque[bool] = deque(maxlen=N_LAST)

    def take(self, shown: DisplayedImage) -> None:
        """Process one more image."""
        self._seen = shown.seen
        self._unfit.append(self._is_unfit(shown.seen))
        frame = shown.seen.frame
        time = frame.host_ts_ns * 1e-9
        if self._arrivals:
            before, number = self._arrivals[-1]
            if not 0 < time - before < RATE_S or frame.seq <= number:
                self._arrivals.clear()  # of another stream
        self._arrivals.append((time, frame.seq))
        while time - self._arrivals[0][0] > RATE_S:
            self._arrivals.popleft()

    def words(self) -> str:
        """Return the content of the last image in a few words; empty without one."""
        seen, setup = self._seen, self._run.status.setup
        if seen is None or setup is None:
            return ""
        if not setup.camera.fits(seen.frame.image):
            return self.tr("Image size does not match this swing.")
        if seen.detection is None or not seen.detection.has_pose:
            text = self.tr("Bright spots: {0}, {1} fps")
            return text.format(len(seen.spots), round(self.rate()))
        n_leds = seen.detection.n_leds
        text = self.tr("{0} of {1} LEDs, {2} fps")
        return text.format(n_leds, setup.pen.n_leds, round(self.rate()))

    def has_unfit_spots(self) -> bool:
        """Return whether enough spots are seen that do not match the pen."""
        return sum(self._unfit) >= MOST * N_LAST

    def _is_unfit(self, seen: LiveImage) -> bool:
        setup, found = self._run.status.setup, seen.detection
        if setup is None or found is None or len(seen.spots) < setup.pen.n_leds:
            return False
        return not found.has_pose or found.n_leds <= setup.pen.n_leds - MISSED

    def rate(self) -> float:
        """Return the frame rate, 1/s."""
        if len(self._arrivals) < 2:
            return 0.0
        (start, first), (end, last) = self._arrivals[0], self._arrivals[-1]
        return (last - first) / (end - start)
