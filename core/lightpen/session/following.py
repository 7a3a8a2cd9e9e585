"""A simulated operator who does what the program asks for."""

from lightpen.cameras.hand import Operator
from lightpen.session.posture import Posture
from lightpen.session.swing_state import Phase, SwingState

FIRST_LEAN = Posture(tilt=0.35, direction=0.0, turn=0.0)


class Follower:
    """Leads the hand of a simulated operator by the states of a swing.

    Parameters
    ----------
    operator : Operator
    heading : float
        The operator's right as the camera sees it, rad.
    """

    def __init__(self, operator: Operator, heading: float = 0.0) -> None:
        self._operator = operator
        self._heading = heading
        self._wish: Posture | None = None

    def follow(self, state: SwingState) -> None:
        """Do what a state of the swing asks for."""
        if state.phase is not Phase.CAPTURING:
            self._wish = None  # a hand that was stopped must be led anew
            return
        wish = state.target
        if state.heading is None:
            wish = Posture(FIRST_LEAN.tilt, self._heading, FIRST_LEAN.turn)
        if wish is not None and wish != self._wish:
            self._wish = wish
            self._operator.lean_towards(wish.tilt, wish.direction, wish.turn)
