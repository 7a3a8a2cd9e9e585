"""The simulated station: a plate with its plan, and an operator who probes it."""

import re
from functools import cache

from lightpen.messages import message
from lightpen_extensions.measure.measuring.plan import Plan
from lightpen_extensions.measure.measuring.plan_checks import parse_plan
from lightpen_extensions.measure.probing.probing import ProbingPhase
from lightpen_extensions.measure.session import SessionSetup, SessionState, is_at_rest
from lightpen_extensions.simulator.hand import HandActivity, SimulatedOperator
from lightpen_resources import RESOURCES


class ProbingOperator:
    """Moves the hand of a simulated operator by the states of a verification."""

    def __init__(self, operator: SimulatedOperator) -> None:
        self._operator = operator
        # Task, choices, run and step of the point that the operator was sent to
        self._wanted: tuple[object, ...] | None = None

    def follow(self, setup: SessionSetup, state: SessionState) -> None:
        """React to a state of the verification; reseat a lifted tip."""
        task, operator = state.task(setup), self._operator
        run, step = len(state.runs), len(state.touches)
        wanted = task, setup.choices, run, step
        is_lifted = operator.doing in (HandActivity.LIFTED, HandActivity.ABSENT)
        if wanted == self._wanted and not (is_lifted and task is not None):
            return
        if task is None:
            self._wanted = wanted
            operator.move_away()
            return
        if is_at_rest(state) and not is_lifted:
            operator.lift()
            return
        is_same_again = not any(task.newness)
        must_move_on = is_same_again and state.touching.phase is ProbingPhase.RECORDED
        if must_move_on and is_lifted:
            return
        before, self._wanted = self._wanted, wanted
        goal = task.hand(setup.choices, run, step)
        if must_move_on:
            operator.lift()
        elif goal.point is not None:
            radius = (setup.conditions.ball_diameter or 0.0) / 2
            operator.touch(goal.point + radius * goal.outwards)
        else:
            is_other = before is None or before[0] is not task
            if is_lifted or is_same_again or is_other:
                operator.seat()
            operator.lean_towards(goal.tilt, goal.direction, 0.0)


PLATE_WORDS = message("measuring.plate-words")  # of the names of its features


@cache
def plate_plan(words: str = PLATE_WORDS.template) -> Plan:
    """Return the measuring plan of the plate, its features named in some language."""
    named = dict(zip(PLATE_WORDS.template.split(), words.split(), strict=True))
    text = (RESOURCES / "plans" / "plate.yaml").read_text(encoding="utf-8")
    text = re.sub(rf"\b({'|'.join(named)})\b", lambda word: named[word[0]], text)
    return parse_plan(text, "plate.yaml")
