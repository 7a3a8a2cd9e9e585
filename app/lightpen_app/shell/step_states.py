"""The steps of the wizard as values: which is done, now, to do, or closed."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum, auto


class StepState(Enum):
    """How far a step is."""

    DONE = auto()
    DOUBTFUL = auto()
    NOW = auto()
    TO_DO = auto()
    CLOSED = auto()


@dataclass(frozen=True)
class Status:
    """What a page says of itself.

    Attributes
    ----------
    complete : bool
        All that the step asks for is there.
    why_closed : str
        Why the step cannot be entered; empty when it can.
    doubtful : bool
        Whether what is complete was taken with doubts.
    """

    title: str
    complete: bool
    why_closed: str
    doubtful: bool = False


@dataclass(frozen=True)
class Step:
    """A step as the list shows it.

    Attributes
    ----------
    why_closed : str
        A sentence for a closed step, else empty.
    """

    title: str
    state: StepState
    why_closed: str = ""


def list_steps(statuses: Sequence[Status], now: int) -> tuple[Step, ...]:
    """Return the steps when the page of index `now` is shown.

    The page that is shown is never closed, and going back is always free: a step
    before it is closed only by its own reason.
    """
    return tuple(
        _step(status, is_now=index == now) for index, status in enumerate(statuses)
    )


def _step(status: Status, *, is_now: bool) -> Step:
    if is_now:
        return Step(status.title, StepState.NOW)
    if status.why_closed:
        return Step(status.title, StepState.CLOSED, status.why_closed)
    done = StepState.DOUBTFUL if status.doubtful else StepState.DONE
    state = done if status.complete else StepState.TO_DO
    return Step(status.title, state)
