"""Sounds that accompany the swing; each also has a picture and a word.

The program runs without any: what plays them is looked for when it starts, and if
there is nothing, the log says so.
"""

import io
import logging
import shutil
import sys
from collections.abc import Callable
from enum import StrEnum
from pathlib import Path

import numpy as np
from PySide6.QtCore import QProcess

from lightpen.arrays import FloatArray

_logger = logging.getLogger(__name__)

RATE = 44_100  # samples a second
FADE = 0.008  # s, so that a tone does not click
PLAYERS = (("pw-play",), ("paplay",), ("aplay", "-q"), ("afplay",))


class Sound(StrEnum):
    """A sound of the program."""

    SEATED = "seated"
    KEPT = "kept"
    FIELD_FULL = "field-full"
    LOST = "lost"
    CAPTURED = "captured"
    DONE = "done"
    FAILED = "failed"


# Frequency in Hz and duration in s of the tones that follow each other.
TONES: dict[Sound, tuple[tuple[float, float], ...]] = {
    Sound.SEATED: ((523.25, 0.12), (783.99, 0.18)),
    Sound.KEPT: ((1046.5, 0.03),),
    Sound.FIELD_FULL: ((1318.5, 0.10), (1568.0, 0.25)),
    Sound.LOST: ((196.0, 0.35),),
    Sound.CAPTURED: ((783.99, 0.10), (783.99, 0.10)),
    Sound.DONE: ((523.25, 0.14), (659.25, 0.14), (783.99, 0.30)),
    Sound.FAILED: ((392.0, 0.20), (261.63, 0.35)),
}
KEPT_STEPS = 12  # the tick rises by an octave in so many steps


class Sounds:
    """Plays sounds from WAV files, which are written to a folder when first needed.

    Without a function that plays files, and while it is muted, it plays nothing.
    """

    def __init__(
        self, folder: Path, play_file: Callable[[Path], object] | None = None
    ) -> None:
        self._folder = folder
        self._play_file = play_file
        self.muted = False

    def play(self, sound: Sound, progress: float = 0.0) -> None:
        """Begin to play and return at once; KEPT rises with progress, 0 to 1."""
        if self.muted or self._play_file is None:
            return
        step = round(KEPT_STEPS * min(max(progress, 0.0), 1.0))
        step = step if sound is Sound.KEPT else 0
        path = self._folder / f"{sound}-{step}.wav"
        if not path.exists():
            try:
                self._folder.mkdir(parents=True, exist_ok=True)
                path.write_bytes(sound_wav(sound, step))
            except OSError:
                return  # a sound is never worth an interruption
        self._play_file(path)


def find_sounds(folder: Path) -> Sounds:
    """Return the player of this system; sound files are written to a folder."""
    if sys.platform == "win32":
        return Sounds(folder, _play_on_windows)
    for program, *options in PLAYERS:
        path = shutil.which(program)
        if path is not None:
            return Sounds(folder, _player(path, options))
    programs = ", ".join(program for program, *_ in PLAYERS)
    _logger.warning("There are no sounds: none of %s is installed.", programs)
    return Sounds(folder)


def sound_wav(sound: Sound, step: int = 0) -> bytes:
    """Return a sound as a WAV file; KEPT is raised by twelfths of an octave."""
    import wave  # of no use at most starts, as the files are there

    tones = [_tone(pitch * 2 ** (step / 12), time) for pitch, time in TONES[sound]]
    samples = np.concatenate(tones)
    buffer = io.BytesIO()
    with wave.open(buffer, "wb") as file:
        file.setnchannels(1)
        file.setsampwidth(2)
        file.setframerate(RATE)
        file.writeframes((samples * 0.5 * 32767).astype("<i2").tobytes())
    return buffer.getvalue()


def _tone(frequency: float, duration: float) -> FloatArray:
    """Return a sine with its octave, faded in and out; amplitude 1 at most."""
    time = np.arange(round(RATE * duration)) / RATE
    sine = np.sin(2 * np.pi * frequency * time)
    octave = np.sin(4 * np.pi * frequency * time)
    fade = np.minimum(1, np.minimum(time, time[::-1]) / FADE)
    return (0.8 * sine + 0.2 * octave) * fade


def _player(program: str, options: list[str]) -> Callable[[Path], None]:
    def play_file(path: Path) -> None:
        QProcess.startDetached(program, [*options, str(path)])

    return play_file


def _play_on_windows(path: Path) -> None:
    import winsound

    winsound.PlaySound(str(path), winsound.SND_FILENAME | winsound.SND_ASYNC)  # type: ignore[attr-defined,unused-ignore]
