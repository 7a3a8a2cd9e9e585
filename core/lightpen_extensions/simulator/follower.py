"""A simulated operator who follows the guidance of a swing."""

from math import pi

from lightpen.model.posture import FIRST_LEAN, UPRIGHT, Posture
from lightpen.swing.capture.state import Phase, SwingState
from lightpen.swing_messages import SWING_TO_SEAT
from lightpen_extensions.simulator.hand import Operator

GENTLE_LEANS = tuple(Posture(0.2, i * 2 * pi / 3, 0.0) for i in range(3))
LEAN_TIME = 0.6  # s until the next one


class GuidedOperator:
    """Moves the hand of a simulated operator by the states of a swing.

    The heading is the operator's right as the camera sees it, rad.
    """

    def __init__(self, operator: Operator, heading: float = 0.0) -> None:
        self._operator = operator
        self._heading = heading
        self._wish: Posture | None = None

    def follow(self, state: SwingState) -> None:
        """React to a state of the swing."""
        swings = state.phase is Phase.SEEN and state.message == SWING_TO_SEAT
        if swings:
            step = int((state.time - state.since) / LEAN_TIME)
            self._lean_towards(GENTLE_LEANS[step % len(GENTLE_LEANS)])
        elif state.phase is Phase.CAPTURING:
            self._lean_towards(self._wanted(state))
        elif self._wish in GENTLE_LEANS or state.phase is Phase.VERDICT:
            # So that the first tilt differs from these; and at the end as asked.
            self._lean_towards(UPRIGHT)
        elif self._wish != UPRIGHT:
            self._wish = None  # a hand that was stopped must be led again

    def _wanted(self, state: SwingState) -> Posture | None:
        if state.heading is None and not state.was_upright:
            return UPRIGHT
        if state.heading is None:
            return Posture(FIRST_LEAN.tilt, self._heading, FIRST_LEAN.turn)
        return state.target

    def _lean_towards(self, wish: Posture | None) -> None:
        if wish is not None and wish != self._wish:
            self._wish = wish
            self._operator.lean_towards(wish.tilt, wish.direction, wish.turn)
