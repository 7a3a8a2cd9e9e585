"""A simulated operator leans the pen where a swing asks for, as often as it must."""

from dataclasses import replace

import numpy as np
import pytest
from typing_extensions import override

from lightpen.messages import HOLD_STILL, SEAT_TIP, SWING_TO_SEAT
from lightpen.model.rigid import FIRST_LEAN, UPRIGHT, Posture
from lightpen.swing.capture.state import Phase, SwingSetup, SwingState, start_swing
from lightpen_extensions.simulator.camera import (
    GENTLE_LEANS,
    GuidedOperator,
    SkippingClock,
)
from lightpen_extensions.simulator.hand import SimulatedOperator
from lightpen_extensions.simulator.swings import paper_camera, paper_pen

ASKED = Posture(tilt=0.3, direction=2.0, turn=0.1)


class ToldOperator(SimulatedOperator):
    """Notes what is requested."""

    def __init__(self) -> None:
        self.clock = SkippingClock()
        super().__init__(self.clock, seated=True)
        self.requested: list[Posture] = []

    @override
    def lean_towards(self, tilt: float, direction: float, turn: float) -> None:
        self.requested.append(Posture(tilt, direction, turn))
        super().lean_towards(tilt, direction, turn)


@pytest.fixture
def operator() -> ToldOperator:
    return ToldOperator()


@pytest.fixture
def state() -> SwingState:
    """Return a swing that captures and knows the operator's right."""
    start = replace(start_swing(SwingSetup(paper_camera(), paper_pen())), heading=0.0)
    return replace(start, phase=Phase.CAPTURING, target=ASKED)


def test_the_pen_is_leant_to_the_target(
    operator: ToldOperator, state: SwingState
) -> None:
    GuidedOperator(operator).follow(state)
    for _ in range(60):
        operator.clock.wait(0.05)
        operator.held(np.array([operator.clock.now_ns() * 1e-9]))
    held = operator.held(np.array([operator.clock.now_ns() * 1e-9])).postures

    assert held.tilts[0] == pytest.approx(ASKED.tilt, abs=0.02)
    assert held.directions[0] == pytest.approx(ASKED.direction, abs=0.06)


def test_a_target_is_reported_once_and_the_next_one_anew(
    operator: ToldOperator, state: SwingState
) -> None:
    follower = GuidedOperator(operator)
    other = replace(ASKED, direction=-1.0)
    for target in (ASKED, ASKED, other, other):
        follower.follow(replace(state, target=target))

    assert operator.requested == [ASKED, other]


def test_the_first_lean_goes_to_the_operators_right(
    operator: ToldOperator, state: SwingState
) -> None:
    GuidedOperator(operator, heading=np.pi / 2).follow(
        replace(state, heading=None, was_upright=True)
    )

    assert operator.requested == [replace(FIRST_LEAN, direction=np.pi / 2)]


def test_after_the_verdict_the_pen_is_held_upright_as_asked(
    operator: ToldOperator, state: SwingState
) -> None:
    follower = GuidedOperator(operator)
    for phase in (Phase.CAPTURING, Phase.SOLVING, Phase.VERDICT, Phase.VERDICT):
        follower.follow(replace(state, phase=phase))

    assert operator.requested == [ASKED, UPRIGHT]


def test_without_a_target_the_hand_stays(
    operator: ToldOperator, state: SwingState
) -> None:
    GuidedOperator(operator).follow(replace(state, target=None))

    assert operator.requested == []


@pytest.mark.parametrize(
    "phase", [p for p in Phase if p not in (Phase.CAPTURING, Phase.VERDICT)]
)
def test_the_hand_is_led_only_while_images_are_captured(
    operator: ToldOperator, state: SwingState, phase: Phase
) -> None:
    GuidedOperator(operator).follow(replace(state, phase=phase))

    assert operator.requested == []


@pytest.fixture
def seeking(state: SwingState) -> SwingState:
    """Return a swing that asks for a gentle swing, to find where the tip rests."""
    return replace(state, phase=Phase.SEEN, message=SWING_TO_SEAT)


def test_asked_to_swing_gently_the_pen_goes_round_upright(
    operator: ToldOperator, seeking: SwingState
) -> None:
    follower = GuidedOperator(operator)
    for time in np.arange(0.0, 2.0, 0.05):
        follower.follow(replace(seeking, time=float(time)))

    assert operator.requested == [*GENTLE_LEANS, GENTLE_LEANS[0]]


def test_asked_to_put_the_tip_in_only_the_hand_stays(
    operator: ToldOperator, seeking: SwingState
) -> None:
    GuidedOperator(operator).follow(replace(seeking, message=SEAT_TIP))

    assert operator.requested == []


def test_after_the_gentle_swing_the_pen_is_held_upright_until_it_is_led(
    operator: ToldOperator, seeking: SwingState
) -> None:
    follower = GuidedOperator(operator)
    follower.follow(seeking)
    for phase in (Phase.SETTLED, Phase.COUNTDOWN, Phase.COUNTDOWN):
        follower.follow(replace(seeking, phase=phase, message=HOLD_STILL))
    follower.follow(replace(seeking, phase=Phase.CAPTURING))

    assert operator.requested == [GENTLE_LEANS[0], UPRIGHT, ASKED]


def test_after_a_pause_the_hand_is_led_anew(
    operator: ToldOperator, state: SwingState
) -> None:
    follower = GuidedOperator(operator)
    follower.follow(state)
    follower.follow(replace(state, phase=Phase.PAUSED))
    follower.follow(state)

    assert operator.requested == [ASKED, ASKED]
