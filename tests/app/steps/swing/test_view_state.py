"""What is shown to the operator, moment by moment."""

from dataclasses import replace

import numpy as np
import pytest
from PySide6.QtWidgets import QApplication

from lightpen.detection.reasons import Reason
from lightpen.estimation.reports.verdict import Grade, Verdict
from lightpen.messages import PEN_LOST, Code, message
from lightpen.model.limits import SwingLimits
from lightpen.swing.capture.guidance import measure_shortfall
from lightpen.swing.capture.state import (
    Pause,
    Phase,
    Progress,
    SwingSetup,
    SwingState,
    start_swing,
)
from lightpen_app.steps.swing.view_state import SwingViewState, n_in_all_about
from lightpen_app.steps.swing.words import SwingWords
from lightpen_app.widgets.state_banner import StatusMessage
from lightpen_extensions.simulator.swings import paper_camera, paper_pen

SETUP = SwingSetup(paper_camera(binning=2), paper_pen())
PASSED = Verdict(Grade.PASS, message(Code.GOOD, uncertainty=0.001))


@pytest.fixture
def words(qapp: QApplication) -> SwingWords:
    return SwingWords()


def moment(state: SwingState, **more: object) -> SwingViewState:
    short = measure_shortfall(SETUP, state)
    # Which names there are is known to the class alone.
    return replace(SwingViewState(SETUP, state, short), **more)  # type: ignore[arg-type]


def at_verdict(**more: object) -> SwingViewState:
    state = replace(start_swing(SETUP), phase=Phase.VERDICT, message=PASSED.reason)
    return moment(state, verdict=PASSED, **more)


def test_after_the_verdict_the_dial_shows_how_far_from_upright_the_pen_is(
    words: SwingWords,
) -> None:
    value = words.operator_value(at_verdict())

    assert "upright and still" in value.hint
    assert value.dial is not None
    assert value.dial.target is not None
    assert value.dial.target.tilt == 0.0
    assert value.keys == "Enter: review"


RECORDING = replace(SETUP, is_recording=True)


@pytest.mark.parametrize(
    "why", [{"setup": RECORDING}, {"is_away": True}, {"is_accepted": True}]
)
def test_nobody_is_asked_to_hold_the_pen_upright_who_need_not(
    words: SwingWords, why: dict[str, object]
) -> None:
    value = words.operator_value(at_verdict(stillness=0.5, **why))

    assert "upright" not in value.hint
    assert value.state.fraction is None
    assert value.dial is not None
    assert value.dial.target is None


def test_at_the_end_of_a_recording_it_is_reported_how_much_of_it_was_read(
    words: SwingWords,
) -> None:
    done = at_verdict(setup=RECORDING)
    state = replace(done.state, progress=Progress(60, 60))

    assert words.note(replace(done, state=state)) == "60 of 60 images loaded"


def test_away_from_the_swing_it_is_not_shown_that_the_review_is_open(
    words: SwingWords,
) -> None:
    hint = words.operator_value(at_verdict(is_away=True)).hint

    assert hint == "Put the pen down. Continue at the computer."


def test_without_a_swing_nothing_is_wrong_on_the_other_steps(words: SwingWords) -> None:
    value = words.resting_value()

    assert value.instruction == "No swing yet"
    assert value.state.word == "WAITING"


def test_a_lost_pen_is_not_said_to_show_its_leds(words: SwingWords) -> None:
    paused = replace(
        start_swing(SETUP), phase=Phase.PAUSED, pause=Pause.LOST, message=PEN_LOST
    )

    lost = words.operator_value(moment(paused, seen="10 of 10 LEDs"))
    lifted = replace(paused, pause=Pause.LIFTED)

    assert (lost.state.word, lost.state.detail) == ("PEN LOST", "")
    shown = words.operator_value(moment(lifted, seen="10 of 10 LEDs"))
    assert shown.state.detail == "10 of 10 LEDs"


def test_images_are_reported_in_steps_as_true_as_the_estimate() -> None:
    more = (0, 1, 9, 10, 11, 16, 30, 31, 47, 240)

    reported = [n_in_all_about(50, n_more) for n_more in more]

    assert reported == [50, 51, 59, 60, 65, 70, 80, 90, 100, 290]


def test_what_the_files_leave_open_is_reported_during_the_swing(
    words: SwingWords,
) -> None:
    state = start_swing(SETUP)
    vague = replace(state.kept.predicted, uncertainty=0.02, floor=0.0042)
    state = replace(state, kept=replace(state.kept, predicted=vague))
    setup = replace(SETUP, limits=SwingLimits(max_uncertainty=0.002))

    early = replace(moment(state), setup=setup)
    short = replace(early.short, fields=np.zeros_like(early.short.fields))
    late = replace(early, short=short)

    reported = words.warning(late)

    assert "With this LED file the lowest achievable U (k =" in reported.text
    assert words.warning(early) == StatusMessage()
    assert words.warning(replace(late, setup=SETUP)) == StatusMessage()
    is_read = replace(setup, is_recording=True)
    assert words.warning(replace(late, setup=is_read)) == StatusMessage()


def test_spots_that_do_not_match_the_pen_point_to_its_file_before_the_swing(
    words: SwingWords,
) -> None:
    waiting = moment(start_swing(SETUP))
    assert words.warning(waiting) == StatusMessage()

    reported = words.warning(replace(waiting, has_unfit_spots=True))

    assert reported.text.endswith(
        "Check that the LED file belongs to this pen and the intrinsics file to these "
        "images."
    )
    assert words.warning(replace(at_verdict(), has_unfit_spots=True)) == StatusMessage()


def test_after_the_capture_no_limit_is_named_but_what_was_rejected(
    words: SwingWords,
) -> None:
    done = replace(start_swing(SETUP), phase=Phase.VERDICT)
    dropped = replace(done, n_dropped={next(iter(Reason)): 12})

    assert words.note(moment(done)) == ""
    assert words.note(moment(dropped)) == "12 rejected"
