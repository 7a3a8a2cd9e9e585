"""The simulated camera with the faults of real ones."""

from dataclasses import replace
from math import inf
from typing import Any

from typing_extensions import override

from lightpen.cameras.protocol import Frame, FrameIncomplete, busy, lost, not_found
from lightpen.live.sources import SourceEnvironment
from lightpen.messages import message
from lightpen_extensions.simulator.camera import SimulatedCamera
from lightpen_extensions.simulator.scenes import Scene
from lightpen_extensions.simulator.simulator import SceneSimulator


def scene_of(around: SourceEnvironment) -> Scene:
    """Return what simulated cameras see."""
    assert isinstance(around.simulator, SceneSimulator)
    return around.simulator.scene


class FaultyCamera(SimulatedCamera):
    """Can be unplugged, stall, be busy, and damage images, from any thread.

    Images that are not read in time are lost.
    """

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self._busy_until = self._stalled_until = -inf  # by the clock, s
        self._n_to_spoil = 0
        self._is_plugged_in = True
        self._has_power = True  # since it was opened

    def unplug(self) -> None:
        """Pull the cable."""
        self._is_plugged_in = self._has_power = False

    def plug_in(self) -> None:
        """Put the cable back; the camera must be opened again."""
        self._is_plugged_in = True

    def stall(self, seconds: float) -> None:
        """Deliver no image for a time, though the device answers."""
        self._stalled_until = self._now + seconds

    def occupy(self, seconds: float) -> None:
        """Let another program have the device for a time."""
        self._busy_until = self._now + seconds

    def spoil_frames(self, n_frames: int) -> None:
        """Damage the next images on the way."""
        self._n_to_spoil = n_frames

    @override
    def open(self) -> None:
        if not self._is_open:
            if not self._is_plugged_in:
                raise not_found(self.serial)
            if self._now < self._busy_until:
                raise busy(self.serial)
            if not self._has_power:
                self._settings = self._usual_settings
                self._has_power = True
        super().open()

    @override
    def probe(self) -> None:
        super().probe()
        if not self._has_power:
            raise lost(self.serial, "unplugged")

    @override
    def _schedule_next(self) -> float:
        if not self._has_power:
            return inf
        if self._next_end < self._stalled_until:
            self._next_end = self._stalled_until + self._period
        return super()._schedule_next()

    @override
    def _leave_out(self, n_frames: int) -> None:
        super()._leave_out(n_frames)
        self._next_seq += n_frames
        self._stats = replace(self._stats, missed=self._stats.missed + n_frames)

    @override
    def _take_image(self) -> Frame:
        frame = super()._take_image()
        if self._n_to_spoil:
            self._n_to_spoil -= 1
            self._stats = replace(self._stats, incomplete=self._stats.incomplete + 1)
            reported = message("camera.incomplete", seq=frame.seq, serial=self.serial)
            raise FrameIncomplete(reported)
        return frame
