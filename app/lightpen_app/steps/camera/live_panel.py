"""The live image with the state of the camera above it."""

from collections import deque
from collections.abc import Sequence
from math import hypot

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QWidget

from lightpen.cameras.protocol import Connection, Stats
from lightpen.detection.reasons import Reason
from lightpen.live.pipeline import LiveImage
from lightpen.model.names import Origin
from lightpen_app.look.layouts import horizontal_layout, vertical_layout
from lightpen_app.look.phrases import reason_text
from lightpen_app.look.signs import Sign
from lightpen_app.look.theme import GRID, TextSize, Tone, text_label
from lightpen_app.look.words import PARTED
from lightpen_app.widgets.fields import Translated
from lightpen_app.widgets.image_view import ImageView, Marker
from lightpen_app.widgets.live_markers import (
    CameraSwitch,
    FrameRate,
    led_numbers,
    live_markers,
)
from lightpen_app.widgets.state_banner import SignLabel, StatusMessage, origin_message
from lightpen_app.work.live_view import DisplayedImage

HEAD_GAP = 3 * GRID  # px, between the words above the image
N_COUNTED = 40  # images of which the lost ones are counted
WITHOUT_IMAGES = (Connection.SILENT, Connection.LOST, Connection.CLOSED)


class LivePanel(Translated, QWidget):
    """Shows live images and the frame counters."""

    camera_chosen = Signal(int)  # index of the camera to show

    def __init__(self) -> None:
        super().__init__()
        self._connection = Connection.CLOSED
        self._sentence = ""
        self._recorded: Origin | None = None
        self._shown = 0  # of the cameras
        self._rate = FrameRate()
        self._seen: LiveImage | None = None
        self._n_lost: deque[int] = deque(maxlen=N_COUNTED)
        self._extra: tuple[Marker, ...] = ()

        # Widgets
        self._switch = CameraSwitch()
        self._state = SignLabel(wraps=False)
        self._figures = text_label(TextSize.SMALL, Tone.QUIET)
        self.view = self.say(
            ImageView(),
            tip=self.tr(
                "Wheel or + and - to zoom, arrow keys to move, 0 for the whole image."
            ),
        )

        # Layout
        layout = vertical_layout(self, (self._switch, 0, Qt.AlignmentFlag.AlignLeft))
        horizontal_layout(layout, self._state, (self._figures, 1), spacing=HEAD_GAP)
        layout.addWidget(self.view, 1)

        # Connections
        self._switch.value_changed.connect(self.camera_chosen)

        self.set_cameras(1, 0)
        self._refresh()

    def set_cameras(self, n_cameras: int, shown: int) -> None:
        """Set the number of cameras to choose from, and the one shown, from 0."""
        self._switch.setVisible(n_cameras > 1)
        if shown != self._shown:
            self._forget()
        self._shown = shown
        self._switch.set_value(shown)

    def set_image(self, shown: DisplayedImage, stats: Stats) -> None:
        """Show another image and the frame counters."""
        self._seen = shown.seen
        self._rate.add(shown.seen.frame)
        self._n_lost.append(stats.missed + stats.incomplete)
        rings = live_markers(shown.seen)
        free = (ring for ring in rings if not self._is_found(ring))
        markers = (*free, *self._extra)
        self.view.set_half(shown.half, shown.size, markers)
        self._show_figures()

    def set_extra_markers(self, markers: Sequence[Marker]) -> None:
        """Draw additional markers."""
        self._extra = tuple(markers)

    def set_connection(self, connection: Connection, sentence: str) -> None:
        """Show the connection; ``sentence`` says why no images are received."""
        if connection in WITHOUT_IMAGES or connection is Connection.OPENING:
            self._forget()
        self._connection, self._sentence = connection, sentence
        self._refresh()

    def set_recorded(self, origin: Origin | None) -> None:
        """Show the origin of replayed images; None for live ones."""
        if origin is not self._recorded:
            self._recorded = origin
            self._refresh()

    def _forget(self) -> None:
        """Clear the image until the next arrives."""
        self.view.clear()
        self._seen = None
        self._rate = FrameRate()
        self._n_lost.clear()
        self._figures.clear()

    def _refresh(self) -> None:
        self._state.set_value(self._remark())
        self.view.set_message(self._message())
        if self._seen is not None:
            self._show_figures()

    def _remark(self) -> StatusMessage:
        match self._connection:
            case Connection.OPENING:
                return StatusMessage(self.tr("Connecting"), Sign.WAIT, Tone.ACTIVE)
            case Connection.STREAMING if self._recorded is not None:
                return origin_message(self._recorded)
            case Connection.STREAMING:
                return StatusMessage(self.tr("Live"), Sign.PLAY, Tone.GOOD)
            case Connection.SILENT:
                return StatusMessage(self.tr("No images"), Sign.PAUSE, Tone.WARN)
            case Connection.LOST:
                words = self.tr("Lost, reconnecting")
                return StatusMessage(words, Sign.WARNING, Tone.BAD)
            case Connection.CLOSED:
                return StatusMessage(self.tr("Not connected"), Sign.CROSS, Tone.WARN)

    def _message(self) -> str:
        match self._connection:
            case Connection.OPENING:
                return self.tr("Opening the camera")
            case Connection.STREAMING:
                return self.tr("Waiting for the first image")
            case Connection.SILENT:
                return self.tr(
                    "The camera responds but sends no images. Check trigger and cable."
                )
            case Connection.LOST:
                words = self.tr("{0} Reconnecting automatically.")
                return words.format(self._sentence)
            case Connection.CLOSED:
                return self._sentence

    def _show_figures(self) -> None:
        """Describe the last image and the frame rate."""
        seen = self._seen
        assert seen is not None
        height, width = seen.frame.image.shape
        parts = [
            self._leds_text(seen),
            self.tr("{0} fps").format(f"{self._rate.value():.0f}"),
        ]
        n_lost = self._n_lost[-1] - self._n_lost[0]
        if n_lost > 0:
            parts.append(self.tr("Lost: {0}").format(n_lost))
        parts.append(self.tr("{0} x {1} px").format(width, height))
        self._figures.setText(PARTED.join(parts))

    def _leds_text(self, seen: LiveImage) -> str:
        detection = seen.detection
        if detection is None:
            return self.tr("Bright spots: {0}").format(len(seen.spots))
        if detection.reason is not Reason.NONE:
            return reason_text(detection.reason)
        n_labelled = len(led_numbers(seen))
        words = self.tr("{0} of {1} LEDs").format(n_labelled, len(detection.pixels))
        n_others = len(seen.spots) - n_labelled
        if n_others:
            words += self.tr(", other spots: {0}").format(n_others)
        return words

    def _is_found(self, ring: Marker) -> bool:
        """Return whether another marker stands for this ring."""
        return ring.tone is not Tone.GOOD and any(
            hypot(ring.x - mark.x, ring.y - mark.y) < mark.radius
            for mark in self._extra
        )
