"""A camera that a library drives, when commands do not arrive."""

import pytest
from typing_extensions import override

from lightpen.cameras.pairing import MachineClock
from lightpen.cameras.protocol import CameraSettings, FrameTimeout, Region, TriggerMode
from lightpen.cameras.source import SourcePlace
from lightpen_extensions.drivers.aravis import ARAVIS, AravisFeatures

SMALL = Region(0, 0, 160, 120)  # fits into any receive buffer
TRIGGERED = CameraSettings(frame_rate=50, region=SMALL, trigger=TriggerMode.SOFTWARE)


class TickingClock(MachineClock):
    """A clock that goes on by a tenth of a second whenever it is looked at."""

    def __init__(self) -> None:
        self._now_ns = 0

    @override
    def now_ns(self) -> int:
        self._now_ns += 100_000_000
        return self._now_ns


def test_a_trigger_that_never_reached_the_camera_is_given_again(
    aravis: SourcePlace, monkeypatch: pytest.MonkeyPatch
) -> None:
    commands: list[str] = []
    execute = AravisFeatures.execute

    def lose_the_first(features: AravisFeatures, name: str) -> None:
        commands.append(name)
        if len(commands) > 1:
            execute(features, name)

    monkeypatch.setattr(AravisFeatures, "execute", lose_the_first)
    assert ARAVIS.camera is not None
    camera = ARAVIS.camera(aravis, TickingClock())
    camera.open()
    try:
        camera.configure(TRIGGERED)
        camera.start()
        with pytest.raises(FrameTimeout):
            camera.read(0.3)
        assert commands == ["TriggerSoftware"]

        assert camera.read(5.0).seq == 0
        assert commands == ["TriggerSoftware"] * 2
    finally:
        camera.close()
