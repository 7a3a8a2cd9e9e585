"""Sounds are the right tones, can be muted, and are never needed."""

import io
import subprocess
import sys
import wave
from pathlib import Path

import numpy as np
import pytest

from lightpen.arrays import FloatArray
from lightpen_app.look.sounds import (
    KEPT_STEPS,
    RATE,
    TONES,
    Sound,
    Sounds,
    find_sounds,
    sound_wav,
)


def samples_of(data: bytes) -> FloatArray:
    with wave.open(io.BytesIO(data)) as file:
        assert file.getframerate() == RATE
        frames = file.readframes(file.getnframes())
    return np.frombuffer(frames, "<i2").astype(np.float64) / 32767


def pitch_of(samples: FloatArray) -> float:
    n = 1 << 18
    spectrum = np.abs(np.fft.rfft(samples * np.hanning(len(samples)), n))
    return float(np.argmax(spectrum) * RATE / n)


@pytest.mark.parametrize("sound", list(Sound))
def test_every_sound_has_its_tones(sound: Sound) -> None:
    samples = samples_of(sound_wav(sound))
    begin = 0
    for frequency, duration in TONES[sound]:
        end = begin + round(RATE * duration)
        # A tone of T seconds has its peak within 1/T of its pitch.
        pitch = pitch_of(samples[begin:end])
        assert pitch == pytest.approx(frequency, abs=0.2 / duration)
        begin = end
    assert begin == len(samples)


def test_a_tick_rises_by_an_octave_while_the_swing_goes_on() -> None:
    first = pitch_of(samples_of(sound_wav(Sound.KEPT, 0)))
    last = pitch_of(samples_of(sound_wav(Sound.KEPT, KEPT_STEPS)))

    assert last / first == pytest.approx(2, rel=0.01)


def test_sounds_neither_clip_nor_click() -> None:
    for sound in Sound:
        samples = samples_of(sound_wav(sound))
        assert np.abs(samples).max() < 0.6
        assert abs(samples[0]) < 0.01
        assert abs(samples[-1]) < 0.01


def test_a_file_is_written_once_and_played(tmp_path: Path) -> None:
    played: list[Path] = []
    sounds = Sounds(tmp_path / "sounds", played.append)

    sounds.play(Sound.KEPT, 0.5)
    sounds.play(Sound.KEPT, 0.51)

    assert len(set(played)) == 1
    assert played[0].read_bytes() == sound_wav(Sound.KEPT, 6)


def test_a_full_disk_silences_but_stops_nothing(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("not a folder")
    played: list[Path] = []

    Sounds(tmp_path / "file", played.append).play(Sound.DONE)

    assert played == []


def test_mute_lets_nothing_through_until_it_is_lifted(tmp_path: Path) -> None:
    played: list[Path] = []
    sounds = Sounds(tmp_path, played.append)

    sounds.muted = True
    sounds.play(Sound.SEATED)
    sounds.muted = False
    sounds.play(Sound.DONE)

    assert [path.name for path in played] == ["done-0.wav"]


def test_a_machine_without_a_player_says_why_it_is_silent(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.setattr("shutil.which", lambda program: None)

    sounds = find_sounds(tmp_path)

    sounds.play(Sound.DONE)
    assert "aplay" in caplog.text
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_the_program_never_imports_qt_multimedia() -> None:
    code = (
        "import sys, lightpen_app.application;"
        "sys.exit('PySide6.QtMultimedia' in sys.modules)"
    )

    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
