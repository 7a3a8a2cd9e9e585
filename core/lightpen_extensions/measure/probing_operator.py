"""A simulated operator who follows the guidance of a verification."""

from dataclasses import dataclass

import numpy as np

from lightpen.arrays import FloatArray
from lightpen_extensions.measure.probing.probing import ProbingPhase
from lightpen_extensions.measure.session.session import (
    SessionSetup,
    SessionState,
    is_at_rest,
)
from lightpen_extensions.measure.tasks.registry import AnyTask
from lightpen_extensions.measure.tasks.task import HandGoal, VerificationChoices
from lightpen_extensions.simulator.hand import HandActivity, Operator


@dataclass(frozen=True)
class _TouchGoal:
    """A point that the operator was sent to."""

    task: AnyTask | None
    choices: VerificationChoices
    run: int
    step: int


class ProbingOperator:
    """Moves the hand of a simulated operator by the states of a verification."""

    def __init__(self, operator: Operator) -> None:
        self._operator = operator
        self._wanted: _TouchGoal | None = None

    def follow(self, setup: SessionSetup, state: SessionState) -> None:
        """React to a state of the verification; reseat a lifted tip."""
        task, operator = state.task(setup), self._operator
        n_runs = len(state.runs)
        wanted = _TouchGoal(task, setup.choices, n_runs, len(state.touches))
        is_lifted = operator.doing in (HandActivity.LIFTED, HandActivity.ABSENT)
        if wanted == self._wanted and not (is_lifted and task is not None):
            return
        if task is None:
            self._wanted = wanted
            operator.leave()
            return
        if is_at_rest(state) and not is_lifted:
            operator.lift()
            return
        is_same_again = not any(task.newness)
        must_move_on = is_same_again and state.touching.phase is ProbingPhase.RECORDED
        if must_move_on and is_lifted:
            return
        before, self._wanted = self._wanted, wanted
        goal = task.hand(setup.choices, len(state.runs), wanted.step)
        if must_move_on:
            operator.lift()
        elif goal.point is not None:
            operator.touch(_ball_on(goal, goal.point, setup.ball_diameter or 0.0))
        else:
            is_other = before is None or before.task is not task
            if is_lifted or is_same_again or is_other:
                operator.seat()
            operator.lean_towards(goal.tilt, goal.direction, 0.0)


def _ball_on(goal: HandGoal, point: FloatArray, ball_diameter: float) -> FloatArray:
    """Return the target of the ball centre."""
    if goal.outwards is None:
        return point
    return np.asarray(point + ball_diameter / 2 * goal.outwards)
