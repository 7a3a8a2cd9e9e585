"""The counts of a swing go on over sessions and cameras."""

from lightpen.cameras.protocol import Stats
from lightpen.swing.swing_recorder import FrameCounters


def test_what_came_before_the_swing_is_not_counted() -> None:
    counters = FrameCounters().after(Stats(100, 5, 3)).after(Stats(110, 6, 3, 2))

    assert counters.total == Stats(10, 1, 0, 2)


def test_another_camera_begins_with_none() -> None:
    counters = (
        FrameCounters().after(Stats(100)).after(Stats(110, 1)).after(Stats(4, 0, 2))
    )

    assert counters.total == Stats(14, 1, 2)


def test_a_swing_that_is_resumed_goes_on_from_its_record() -> None:
    counters = FrameCounters(Stats(40, 1, 1)).after(Stats(9)).after(Stats(12))

    assert counters.total == Stats(43, 1, 1)
