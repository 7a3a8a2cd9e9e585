"""What the list of steps says of each step."""

from lightpen_app.shell.sidebar import Status, Step, StepState, list_steps

STATUSES = (
    Status("Start", complete=True, why_closed=""),
    Status("Camera", complete=False, why_closed=""),
    Status("LEDs", complete=False, why_closed=""),
    Status("Swing", complete=False, why_closed="Needs a camera."),
)


def test_each_step_is_done_now_to_do_or_closed() -> None:
    states = [step.state for step in list_steps(STATUSES, now=1)]

    assert states == [StepState.DONE, StepState.NOW, StepState.TO_DO, StepState.CLOSED]


def test_a_closed_step_says_why_and_no_other_does() -> None:
    reasons = [step.why_closed for step in list_steps(STATUSES, now=1)]

    assert reasons == ["", "", "", "Needs a camera."]


def test_several_closed_steps_show_one_common_reason() -> None:
    closed = Status("Review", complete=False, why_closed="Swing the pen first.")

    shown = [step.shows_reason for step in list_steps((*STATUSES, closed), now=1)]

    assert shown == [False, False, False, True, False]


def test_no_reason_is_shown_where_the_page_says_what_is_missing() -> None:
    steps = list_steps(STATUSES, now=1, is_reason_said=True)

    assert not any(step.shows_reason for step in steps)
    assert steps[3].why_closed == "Needs a camera."  # for who asks the step


def test_going_back_keeps_what_is_done() -> None:
    complete = Status("Camera", complete=True, why_closed="")

    steps = list_steps((STATUSES[0], complete), now=0)

    assert steps == (Step("Start", StepState.NOW), Step("Camera", StepState.DONE))


def test_the_step_that_is_shown_is_never_closed() -> None:
    assert list_steps(STATUSES, now=3)[3] == Step("Swing", StepState.NOW)


def test_a_step_that_was_taken_with_doubts_says_so() -> None:
    doubtful = Status("Review", complete=True, why_closed="", doubtful=True)
    undone = Status("Review", complete=False, why_closed="", doubtful=True)

    assert list_steps([doubtful, undone], 2)[0].state is StepState.DOUBTFUL
    assert list_steps([doubtful, undone], 2)[1].state is StepState.TO_DO
    assert list_steps([doubtful], 0)[0].state is StepState.NOW
