"""Live determination of a stylus axis: the pen is rotated in the cone."""

import numpy as np
from PySide6.QtCore import QObject, Signal

from lightpen.arrays import FloatArray
from lightpen.errors import CalibrationError
from lightpen.estimation.spin import SpinFit, fit_spin
from lightpen.model.posture import angles_between
from lightpen_app.look.sentences import worded
from lightpen_app.work.live_images import DisplayedImage
from lightpen_app.work.live_view import LiveView

STEP = np.radians(1.0)  # from one posture that is kept to the next
MOST = 500  # postures


class SpinRecorder(QObject):
    """Keeps the postures of the pen while it is spun."""

    message_sent = Signal(str)  # progress of the spin, or why it shows no axis yet

    def __init__(self, live: LiveView, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._live = live
        self._rotations: list[FloatArray] = []
        self._is_on = False

    def start(self) -> None:
        """Restart."""
        self.stop()
        self._rotations.clear()
        self._is_on = True
        self._live.image_shown.connect(self._on_image_shown)
        self.message_sent.emit(
            self.tr("Press the tip into the cone and turn the pen about its stylus.")
        )

    def stop(self) -> None:
        """Ignore further images."""
        if self._is_on:
            self._is_on = False
            self._live.image_shown.disconnect(self._on_image_shown)

    def fit(self) -> SpinFit:
        """Return the axis from the spin."""
        return fit_spin(np.array(self._rotations).reshape(-1, 3, 3))

    def _on_image_shown(self, shown: DisplayedImage) -> None:
        detection = shown.seen.detection
        is_seen = (
            detection is not None and detection.has_pose and not detection.is_blurred
        )
        if detection is not None and is_seen and shown.seen.camera == 0:
            self.keep(detection.rotation)

    def keep(self, rotation: FloatArray) -> None:
        """Keep a posture, (3, 3) of cam_from_pen, unless the pen has hardly moved."""
        kept = self._rotations
        if kept and angles_between(kept[-1][None], rotation[None])[0, 0] < STEP:
            return
        if len(kept) < MOST:
            kept.append(rotation)
        try:
            found = self.fit()
        except CalibrationError as error:
            self.message_sent.emit(worded(error.message))
        else:
            text = self.tr("Rotation {0}°; U (k = 2) of the axis {1}°")
            self.message_sent.emit(
                text.format(
                    f"{np.degrees(found.turn):.0f}",
                    f"{np.degrees(found.expanded_uncertainty):.2f}",
                )
            )
