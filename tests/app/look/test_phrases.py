"""What the operator is told, in few words and by his own sides."""

import math

import pytest

from lightpen.messages import Code, Message
from lightpen.model.posture import Posture
from lightpen.swing.state import Pause, Phase
from lightpen_app.look.phrases import lean_phrase, phase_text, phrase, sides_text

FAR, LITTLE = math.radians(28), math.radians(14)
RIGHT, AWAY, LEFT, TOWARDS = (quarter * math.pi / 2 for quarter in range(4))
LONGEST = 20  # letters that are read from 3 m on a screen of 1920 px
DURING_A_SWING = (
    *(Code.SHOW_PEN, Code.SEAT_TIP, Code.SWING_TO_SEAT, Code.HOLD_STILL),
    *(Code.STARTS_IN, Code.LEAN_TO_YOUR_RIGHT, Code.FOLLOW_ARROW, Code.FEW_LEDS),
    *(Code.TOO_FAST, Code.BAD_FIT, Code.TIP_SLIPPED, Code.PEN_LOST, Code.PEN_LIFTED),
    *(Code.TIP_ELSEWHERE, Code.PAUSED, Code.SOLVING),
)


@pytest.mark.parametrize(
    ("direction", "heading", "words"),
    [
        (RIGHT, 0.0, "Lean right"),
        (AWAY, 0.0, "Lean away"),
        (TOWARDS, 0.0, "Lean to you"),
        (RIGHT, math.pi, "Lean left"),  # an operator who faces the camera
        (AWAY, math.pi, "Lean to you"),
        (RIGHT, math.pi / 2, "Lean to you"),  # who has the camera at his left
        (AWAY, math.pi / 2, "Lean right"),
    ],
)
def test_a_posture_is_told_by_the_operators_own_sides(
    direction: float, heading: float, words: str
) -> None:
    told = lean_phrase(Posture(FAR, direction, 0.0), None, heading)

    assert told.short == words


def test_the_hint_tells_how_far_and_which_way_to_turn() -> None:
    here = Posture(0.0, 0.0, 0.0)

    assert lean_phrase(Posture(0.0, 2.0, 0.0), here, 0.0).short == "Upright"
    assert lean_phrase(Posture(LITTLE, RIGHT, 0.1), here, 0.0).hint.startswith("A litt")
    assert lean_phrase(Posture(FAR, RIGHT, 0.1), here, 0.0).hint.startswith("Far.")
    turned = lean_phrase(Posture(FAR, RIGHT, 0.4), here, 0.0)
    assert turned.hint == "Turn it counter-clockwise, seen from above."
    turned = lean_phrase(Posture(FAR, RIGHT, -0.4), here, 0.0)
    assert turned.hint == "Turn it clockwise, seen from above."


def test_some_missing_sides_are_named_and_many_are_not() -> None:
    assert sides_text([0, 2]) == "to the right, away from you"
    assert sides_text(range(7)) == "to most sides"


@pytest.mark.parametrize("code", DURING_A_SWING)
def test_instructions_are_short_enough_for_the_distance(code: Code) -> None:
    assert len(phrase(Message(code, (3, 6))).short) <= LONGEST


def test_every_state_and_pause_has_a_word_of_its_own() -> None:
    words = [phase_text(phase) for phase in Phase]
    words += [phase_text(Phase.PAUSED, pause) for pause in Pause][1:-1]

    assert len(set(words)) == len(words)
    assert phase_text(Phase.PAUSED, Pause.BY_USER) == phase_text(Phase.PAUSED)
