"""A button that plays all sounds, each with its meaning."""

from PySide6.QtCore import QTimer
from PySide6.QtWidgets import QSizePolicy, QWidget

from lightpen_app.look.layouts import horizontal_layout
from lightpen_app.look.signs import Sign
from lightpen_app.look.sounds import MutedSounds, Sound, Sounds
from lightpen_app.look.theme import GRID
from lightpen_app.look.tooltips import set_tooltip
from lightpen_app.widgets.push_button import PushButton
from lightpen_app.widgets.sign_label import SignLabel, StatusMessage
from lightpen_app.widgets.translated import Translated

FIXED = QSizePolicy.Policy.Fixed
STEP_MS = 1000  # from one sound to the next; none is longer


class SoundTest(Translated, QWidget):
    """Plays the sounds one after the other, or reports why audio is unavailable."""

    def __init__(self, sounds: Sounds, step_ms: int = STEP_MS) -> None:
        super().__init__()
        self._sounds = sounds
        self._waiting: list[Sound] = []
        self._is_silent = False  # as last reported

        # Widgets
        self._button = PushButton()
        self._button.setSizePolicy(FIXED, FIXED)
        self._words = SignLabel()
        self._timer = QTimer(self, singleShot=True, interval=step_ms)

        # Layout
        horizontal_layout(self, self._button, (self._words, 1), 0, spacing=2 * GRID)

        # Connections
        self._button.clicked.connect(self._on_clicked)
        self._timer.timeout.connect(self._play_next)

        self._retranslate()

    def words(self) -> str:
        """Return the text beside the button."""
        return self._words.value().text

    def stop(self) -> None:
        """Play no more sounds."""
        self._timer.stop()
        self._waiting.clear()
        self._is_silent = False
        self._words.set_value(StatusMessage())

    def _on_clicked(self) -> None:
        self.stop()
        self._is_silent = bool(self._silence())
        if self._is_silent:
            self._report_silence()
            return
        self._waiting = list(Sound)
        self._play_next()

    def _report_silence(self) -> None:
        """Report why audio is unavailable, as long as it is."""
        silence = self._silence()
        self._words.set_value(
            StatusMessage(silence, Sign.WARNING) if silence else StatusMessage()
        )
        self._is_silent = bool(silence)
        if silence:
            self._timer.start()

    def _play_next(self) -> None:
        if self._is_silent:
            self._report_silence()
            return
        if not self._waiting:
            self._words.set_value(StatusMessage())
            return
        sound = self._waiting.pop(0)
        self._words.set_value(StatusMessage(self._word(sound), Sign.PLAY))
        self._sounds.play(sound)
        self._timer.start()

    def _silence(self) -> str:
        reason = self._sounds.why_silent()
        if reason:
            return self.tr(
                "No sound available: {0}. All information is also shown as text and "
                "icons."
            ).format(reason)
        if isinstance(self._sounds, MutedSounds) and self._sounds.muted:
            return self.tr("Sounds are off. Press B to turn them on.")
        return ""

    def _word(self, sound: Sound) -> str:
        return {
            Sound.SEATED: self.tr("Tip seated"),
            Sound.KEPT: self.tr("Image captured"),
            Sound.FIELD_FULL: self.tr("Posture complete"),
            Sound.LOST: self.tr("Tip slipped or pen lost"),
            Sound.CAPTURED: self.tr("Capture complete"),
            Sound.DONE: self.tr("Done"),
            Sound.FAILED: self.tr("Failed"),
        }[sound]

    def _retranslate(self) -> None:
        self._button.setText(self.tr("Test the sounds"))
        set_tooltip(
            self._button, self.tr("Plays the sounds of a swing one after the other")
        )
