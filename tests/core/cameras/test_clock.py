"""Clocks: how they wait."""

from threading import Event

import pytest

from lightpen.cameras.pairing import Clock, MachineClock
from lightpen_extensions.simulator.camera import SkippingClock


@pytest.fixture(params=[MachineClock, SkippingClock])
def clock(request: pytest.FixtureRequest) -> Clock:
    made: Clock = request.param()
    return made


def test_a_wait_takes_its_time(clock: Clock) -> None:
    before = clock.now_ns()
    assert not clock.wait(0.01)
    assert clock.now_ns() - before >= 10_000_000


@pytest.mark.parametrize("wake", [None, Event()])
def test_a_time_that_is_over_is_not_waited_for(
    clock: Clock, wake: Event | None
) -> None:
    before = clock.now_ns()
    assert not clock.wait(-600.0, wake)
    assert 0 <= clock.now_ns() - before < 60_000_000_000


def test_a_wait_ends_when_woken(clock: Clock) -> None:
    wake = Event()
    wake.set()
    assert clock.wait(60.0, wake)
