"""What a status says of its swing in one word."""

from dataclasses import replace

import pytest

from lightpen.swing.capture.rules import pause
from lightpen.swing.capture.state import Pause, Phase, SwingState, start_swing
from lightpen.swing.preparation import Preparation
from lightpen.swing.status import Activity, SwingStatus


@pytest.fixture
def state(prepared: Preparation) -> SwingState:
    return start_swing(prepared.swing_setup())


@pytest.mark.parametrize("phase", list(Phase))
def test_a_swing_is_captured_until_it_is_solved(
    state: SwingState, phase: Phase
) -> None:
    status = SwingStatus(state=replace(state, phase=phase))

    assert status.is_capturing == (phase not in (Phase.SOLVING, Phase.VERDICT))


def test_nothing_is_captured_without_a_swing() -> None:
    assert not SwingStatus().is_capturing
    assert not SwingStatus().is_paused_by_user


def test_only_a_pause_of_the_user_waits_for_him(state: SwingState) -> None:
    lost = replace(state, phase=Phase.PAUSED, pause=Pause.LOST)

    assert SwingStatus(state=pause(state)).is_paused_by_user
    assert not SwingStatus(state=lost).is_paused_by_user
    assert not SwingStatus(state=state).is_paused_by_user


@pytest.mark.parametrize("activity", list(Activity))
def test_what_is_under_way_beside_the_images_is_one_thing(activity: Activity) -> None:
    status = SwingStatus(activity=activity)

    assert status.is_solving == (activity is Activity.SOLVING)
    assert status.is_reading == (activity is Activity.READING)
