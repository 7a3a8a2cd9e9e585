"""A link that loses images, or carries fewer than are set, is reported once."""

import pytest

from lightpen.cameras.link_watch import WATCHED, LinkWatch
from lightpen.cameras.protocol import CameraFailure, CameraSettings, Stats, TriggerMode

AT_20 = CameraSettings(frame_rate=20.0, trigger=TriggerMode.FREE)


def reported(
    later: Stats, settings: CameraSettings = AT_20, seconds: float = WATCHED
) -> CameraFailure | None:
    """Return what is reported when the counts have come to this after a while."""
    watch, fault = LinkWatch().after(Stats(delivered=7), 100.0, settings)
    assert fault is None
    return watch.after(later, 100.0 + seconds, settings)[1]


def test_a_link_that_carries_all_is_not_reported() -> None:
    assert reported(Stats(delivered=67)) is None
    assert reported(Stats(delivered=66, missed=1)) is None


@pytest.mark.parametrize("lost", [Stats(57, 10), Stats(57, 0, 10), Stats(57, 4, 6)])
def test_images_that_get_lost_are_reported_with_what_to_do(lost: Stats) -> None:
    fault = reported(lost)

    assert "of 60 incomplete" in str(fault)
    assert "Lower the frame rate" in str(fault)


def test_a_frame_rate_that_is_not_reached_is_reported() -> None:
    assert "10.0 fps instead of 20.0 fps" in str(reported(Stats(37)))


def test_a_triggered_camera_need_not_reach_its_rate() -> None:
    assert reported(Stats(37), CameraSettings(None, None, 20.0, None, None)) is not None
    triggered = CameraSettings(frame_rate=20.0, trigger=TriggerMode.SOFTWARE)

    assert reported(Stats(37), triggered) is None


def test_nothing_is_reported_before_enough_was_seen() -> None:
    assert reported(Stats(7, 5), seconds=WATCHED / 2) is None


def test_a_fault_is_reported_once() -> None:
    watch, _ = LinkWatch().after(Stats(), 0.0, AT_20)
    watch, first = watch.after(Stats(50, 10), WATCHED, AT_20)
    watch, second = watch.after(Stats(100, 20), 2 * WATCHED, AT_20)

    assert first is not None
    assert second is None
