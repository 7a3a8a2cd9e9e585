"""The simulated station: a plate with its plan, and an operator who probes it."""

import re
from functools import cache

from lightpen.messages import message
from lightpen_extensions.measure.measuring.plan import Plan
from lightpen_extensions.measure.measuring.plan_checks import parse_plan
from lightpen_extensions.measure.probing.probing import ProbingPhase
from lightpen_extensions.measure.session import SessionSetup, SessionState, is_at_rest
from lightpen_extensions.simulator.hand import HandActivity, SimulatedOperator


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


# The part of the simulated station: a plate of ten features, and its measuring plan.
#
# Its frame has the origin in the middle of the upper face, x to the right, y away from
# the camera and z up. `verification.tasks.part` states where it lies.


PLATE = """
name: Simulated plate
features:
  - {name: top, kind: plane, touches: 6,
     nominal: {origin: [0, 0, 0], axis: [0, 0, 1], length: 120, width: 60}}
  - {name: front, kind: line, touches: 3, normal: [0, -1, 0],
     nominal: {origin: [0, -35, -5], axis: [1, 0, 0], length: 100}}
  - {name: hole 1, kind: circle, side: inside, touches: 4,
     nominal: {origin: [-50, -20, -4], axis: [0, 0, 1], diameter: 24}}
  - {name: hole 2, kind: circle, side: inside, touches: 4,
     nominal: {origin: [50, -20, -4], axis: [0, 0, 1], diameter: 24}}
  - {name: hole 3, kind: circle, side: inside, touches: 4,
     nominal: {origin: [50, 20, -4], axis: [0, 0, 1], diameter: 24}}
  - {name: hole 4, kind: circle, side: inside, touches: 4,
     nominal: {origin: [-50, 20, -4], axis: [0, 0, 1], diameter: 24}}
  - {name: bore, kind: cylinder, side: inside, touches: 8,
     nominal: {origin: [0, 0, -12], axis: [0, 0, 1], diameter: 30, length: 20}}
  - {name: dome, kind: sphere, side: outside, touches: 6,
     nominal: {origin: [-25, 0, 2], axis: [0, 0, 1], diameter: 20}}
  - {name: countersink, kind: cone, side: inside, touches: 8,
     nominal:
       {origin: [25, 0, -5], axis: [0, 0, 1], diameter: 24, angle: 90, length: 8}}
  - {name: pad, kind: point, surface: top,
     nominal: {origin: [0, 24, 0], axis: [0, 0, 1]}}
alignment: {plane: top, line: front, point: bore}
characteristics:
  - {quantity: flatness, of: [top], tolerance: 0.2}
  - {quantity: diameter, of: [hole 1], nominal: 24, tolerance: 0.2}
  - {quantity: diameter, of: [bore], nominal: 30, tolerance: 0.2}
  - {quantity: diameter, of: [dome], nominal: 20, tolerance: 0.2}
  - {quantity: cone angle, of: [countersink], nominal: 90, tolerance: 2}
  - {quantity: y, of: [front], nominal: -35, tolerance: 0.2}
  - {quantity: z, of: [pad], nominal: 0, tolerance: 0.2}
  - {quantity: distance, of: [hole 1, hole 2], nominal: 100, tolerance: 0.2}
  - {quantity: distance, of: [hole 1, hole 4], nominal: 40, tolerance: 0.2}
  - {quantity: position, of: [hole 3], tolerance: 0.4}
  - {quantity: perpendicularity, of: [bore], datum: top, tolerance: 0.3}
"""


PLATE_WORDS = message("measuring.plate-words")  # of the names of its features


@cache
def plate_plan(words: str = PLATE_WORDS.template) -> Plan:
    """Return the measuring plan of the plate, its features named in some language."""
    named = dict(zip(PLATE_WORDS.template.split(), words.split(), strict=True))
    text = re.sub(rf"\b({'|'.join(named)})\b", lambda word: named[word[0]], PLATE)
    return parse_plan(text, "plate.yaml")
