"""Presence of the operator: automatic begin, pause and resumption of swings."""

from dataclasses import dataclass, replace
from typing import Self

from lightpen.messages import Message
from lightpen.runners import FaultReporter
from lightpen.swing.capture.state import SwingEvent
from lightpen.swing.preparation import Preparation
from lightpen.swing.status import SwingListener, SwingStatus, log_change


@dataclass(frozen=True, eq=False)
class OperatorPresence:
    """Presence of the operator, and the choices for the next swing.

    Until the operator has come or left, a swing begins and pauses by commands.
    """

    is_here: bool = False  # waits for a swing, which begins when nothing is missing
    is_away: bool = False  # the capture is paused
    paused_by_leaving: bool = False  # for that reason alone: it resumes automatically
    choices: Preparation | None = None
    begun_with: Preparation | None = None  # when the swing began, or confirmed since
    refusal: Message | None = None  # why no swing could begin; until it is cleared

    @property
    def is_due(self) -> bool:
        """Whether a swing begins with the next image."""
        is_wanted = self.is_here and self.refusal is None
        return (
            is_wanted and self.choices is not None and not self.choices.missing_inputs()
        )

    @property
    def has_other_choices(self) -> bool:
        """Return whether the choices differ from those of the current swing."""
        if self.choices is None or self.begun_with is None:
            return False
        return not self.begun_with.swings_like(self.choices)

    def choose(self, choices: Preparation) -> Self:
        """Return a copy with other choices.

        Files that were still being read when a swing was resumed are no change.
        """
        begun = self.begun_with
        if begun is not None:
            begun = replace(
                begun,
                camera_file=begun.camera_file or choices.camera_file,
                pen_file=begun.pen_file or choices.pen_file,
            )
        return replace(self, choices=choices, begun_with=begun)

    def arrived(self) -> Self:
        """Return a copy with the operator present and refusals cleared."""
        return replace(
            self, is_here=True, is_away=False, paused_by_leaving=False, refusal=None
        )

    def left(self) -> Self:
        """Return a copy with the operator absent."""
        return replace(self, is_here=False, is_away=True)

    def begun(self) -> Self:
        """Return a copy with a swing begun with the present choices."""
        return replace(
            self, begun_with=self.choices, paused_by_leaving=False, refusal=None
        )


class PublishedSwing:
    """Holds the status for the parts of the workflow, and notifies."""

    def __init__(self, listener: SwingListener) -> None:
        self._listener = listener
        self.faults = FaultReporter(listener)
        self.status = SwingStatus()
        self.presence = OperatorPresence()

    def publish(self, status: SwingStatus, *events: SwingEvent) -> None:
        """Set the status and notify."""
        is_open = status.is_capturing or (status.has_verdict and not status.result)
        before = self.status
        self.status = replace(
            status,
            refusal=self.presence.refusal,
            has_other_choices=is_open and self.presence.has_other_choices,
        )
        log_change(before, self.status, events)
        self._listener.on_swing(self.status, events)

    def republish(self) -> None:
        """Notify, after the presence has changed."""
        self.publish(self.status)
