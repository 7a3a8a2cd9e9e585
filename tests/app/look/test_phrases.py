"""What is shown to the operator, in few words and by his own sides."""

import math
from string import Formatter

import pytest

from lightpen.messages import (
    CATALOGUE,
    FOLLOW_ARROW,
    HOLD_STILL,
    LEAN_TO_YOUR_RIGHT,
    PAUSED,
    PEN_LIFTED,
    PEN_LOST,
    SEAT_TIP,
    SHOW_PEN,
    SOLVING,
    SWING_TO_SEAT,
    TOO_FAST,
    Code,
    Message,
    message,
    too_little_tilt,
)
from lightpen.model.rigid import Posture
from lightpen.swing.capture.state import Pause, Phase
from lightpen_app.look.phrases import lean_phrase, phase_text, phrase
from lightpen_app.look.words import phrases_whole

FAR, LITTLE = math.radians(28), math.radians(14)
RIGHT, AWAY, LEFT, TOWARDS = (quarter * math.pi / 2 for quarter in range(4))
LONGEST = 20  # letters that are read from 3 m on a screen of 1920 px
DURING_A_SWING = (
    *(SHOW_PEN, SEAT_TIP, SWING_TO_SEAT, HOLD_STILL, LEAN_TO_YOUR_RIGHT, FOLLOW_ARROW),
    *(TOO_FAST, PEN_LOST, PEN_LIFTED, PAUSED, SOLVING),
    message(Code.STARTS_IN, seconds=3),
    message(Code.FEW_LEDS, seen=3, needed=6),
    message(Code.BAD_FIT, noise=3, usual=6),
    message(Code.TIP_SLIPPED, n_dropped=3),
    message(Code.TIP_ELSEWHERE, distance=3),
)


@pytest.mark.parametrize(
    ("direction", "heading", "words"),
    [
        (RIGHT, 0.0, "Tilt right"),
        (AWAY, 0.0, "Tilt away"),
        (TOWARDS, 0.0, "Tilt towards you"),
        (RIGHT, math.pi, "Tilt left"),  # an operator who faces the camera
        (AWAY, math.pi, "Tilt towards you"),
        (RIGHT, math.pi / 2, "Tilt towards you"),  # who has the camera at his left
        (AWAY, math.pi / 2, "Tilt right"),
    ],
)
def test_a_posture_is_reported_by_the_operators_own_sides(
    direction: float, heading: float, words: str
) -> None:
    reported = lean_phrase(Posture(FAR, direction, 0.0), None, heading)

    assert reported.short == words


def test_the_hint_tells_how_far_and_which_way_to_turn() -> None:
    here = Posture(0.0, 0.0, 0.0)

    assert lean_phrase(Posture(0.0, 2.0, 0.0), here, 0.0).short == "Upright"
    assert lean_phrase(Posture(LITTLE, RIGHT, 0.1), here, 0.0).hint.startswith(
        "Slight tilt."
    )
    assert lean_phrase(Posture(FAR, RIGHT, 0.1), here, 0.0).hint.startswith(
        "Large tilt."
    )
    turned = lean_phrase(Posture(FAR, RIGHT, 0.4), here, 0.0)
    assert turned.hint == "Turn it counter-clockwise, seen from above."
    turned = lean_phrase(Posture(FAR, RIGHT, -0.4), here, 0.0)
    assert turned.hint == "Turn it clockwise, seen from above."


def test_some_missing_sides_are_named_and_many_are_not() -> None:
    seen_by_the_camera = phrase(too_little_tilt(4, [2, 0])).hint
    seen_by_an_operator_who_faces_it = phrase(too_little_tilt(4, [2, 0]), math.pi).hint

    assert "tilt to the right, away from the camera. Tilt" in seen_by_the_camera
    assert "tilt to the left, towards you. Tilt" in seen_by_an_operator_who_faces_it
    assert "tilt to most sides." in phrase(too_little_tilt(9, range(7)), math.pi).hint


def test_what_to_do_at_the_screen_is_reported_there_alone() -> None:
    dropped = message(Code.MANY_DROPPED, n_dropped=3, n_images=60)

    assert phrase(dropped).hint == f"{dropped} See the list in Review."
    assert phrase(PAUSED).hint == "Press Space to continue."


@pytest.mark.parametrize("code", list(Code))
def test_every_message_has_a_few_words_to_be_read_from_afar(code: Code) -> None:
    fields = {name for _, name, *_ in Formatter().parse(CATALOGUE[code]) if name}
    assert phrase(Message(code, dict.fromkeys({*fields, "seconds"}, 3))).short


@pytest.mark.parametrize("message", DURING_A_SWING, ids=lambda each: each.code)
def test_instructions_are_short_enough_for_the_distance(message: Message) -> None:
    assert len(phrase(message).short) <= LONGEST


def test_every_state_and_pause_has_a_word_of_its_own() -> None:
    words = [phase_text(phase) for phase in Phase]
    words += [phase_text(Phase.PAUSED, pause) for pause in Pause][1:-1]

    assert len(set(words)) == len(words)
    assert phase_text(Phase.PAUSED, Pause.BY_USER) == phase_text(Phase.PAUSED)


def test_no_line_ends_within_a_coverage_factor_or_the_number_of_a_standard() -> None:
    text = "guard band (ISO 14253-1), U (k = 2), simple acceptance (JCGM 106, 8.2)."

    assert phrases_whole(text).replace("\xa0", "_") == (
        "guard band (ISO_14253-1), U (k_=_2), simple acceptance (JCGM_106, 8.2)."
    )
