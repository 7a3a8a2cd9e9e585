"""Snapshot of a verification."""

from dataclasses import dataclass
from datetime import datetime
from enum import StrEnum
from pathlib import Path
from typing import Protocol

from lightpen.comparisons.assessment import VerificationAssessment
from lightpen.detection.region_of_interest import RegionOfInterest
from lightpen.estimation.reports.verdict import Grade
from lightpen.messages import Message
from lightpen_extensions.measure.probing.current_tip import CurrentTip
from lightpen_extensions.measure.probing.drift_reference import LampDrift, judged_with
from lightpen_extensions.measure.probing.probing import ProbingEventKind, ProbingPhase
from lightpen_extensions.measure.session.session import (
    SessionSetup,
    SessionState,
    SessionTransition,
)
from lightpen_extensions.measure.tasks.registry import AnyTask


def _is_known(state: SessionState) -> bool:
    return state.touching.phase is ProbingPhase.KNOWN


class ReadingState(StrEnum):
    """What is being read."""

    NOTHING = ""
    TIP = "tip"
    IMAGES = "images"


class SessionEventKind(StrEnum):
    """Kinds of events, each with its sound and sign."""

    RECORDED = "recorded"
    BROKEN_OFF = "broken off"
    KNOWN = "known"
    DONE = "done"
    FAILED = "failed"  # done, with something found against the tip


@dataclass(frozen=True, eq=False)
class VerificationStatus:
    """Immutable snapshot of a verification, from the current tip to its verdict."""

    tip: CurrentTip | None = None
    setup: SessionSetup | None = None  # None until the tip is read
    state: SessionState | None = None  # likewise
    region: RegionOfInterest | None = None
    began: datetime | None = None  # when its first image came
    files: tuple[Path, ...] = ()  # results
    reading: ReadingState = ReadingState.NOTHING
    lamp_drift: LampDrift | None = None  # up to the end of the task
    is_here: bool = False  # an operator is present
    is_paused: bool = False
    accepted_by: str = ""  # supervisor, despite findings
    refusal: Message | None = None  # why nothing can be verified

    @property
    def task(self) -> AnyTask | None:
        """Task to probe; None when it is complete or none is possible."""
        if self.setup is None or self.state is None:
            return None
        return self.state.task(self.setup)

    @property
    def is_touching(self) -> bool:
        """Whether images are taken."""
        is_wanted = self.is_here and not self.is_paused and self.refusal is None
        return is_wanted and not self.reading and self.task is not None

    @property
    def is_done(self) -> bool:
        """Whether the task is complete."""
        return self.state is not None and self.state.done is not None

    @property
    def assessment(self) -> VerificationAssessment | None:
        """What was found; a drift first, as it explains the rest."""
        found = None if self.state is None else self.state.found
        return None if found is None else judged_with(found.assessment, self.lamp_drift)


class VerificationListener(Protocol):
    """Listener, called on the threads of a runner; must return soon."""

    def on_verification(
        self, status: VerificationStatus, events: tuple[SessionEventKind, ...]
    ) -> None:
        """Take the status after a change, and what happened."""

    def on_progress(self, fraction: float) -> None:
        """Receive the fraction of images read, 0 to 1."""

    def on_fault(self, message: Message) -> None:
        """Take a sentence to be read: something could not be done."""

    def on_fault_cleared(self, message: Message) -> None:
        """Receive the end of a fault."""


_HAPPENED = {
    ProbingEventKind.RECORDED: SessionEventKind.RECORDED,
    ProbingEventKind.BROKEN_OFF: SessionEventKind.BROKEN_OFF,
}


def event_kinds(
    before: SessionState | None, transition: SessionTransition
) -> list[SessionEventKind]:
    """Return the events of the touches by one more image."""
    happened = [_HAPPENED[event.what] for event in transition.events]
    if before is not None and _is_known(transition.state) and not _is_known(before):
        happened.append(SessionEventKind.KNOWN)
    return happened


def ending(status: VerificationStatus) -> SessionEventKind:
    """Return the event of a completed task."""
    found = status.assessment
    is_refused = found is not None and found.grade is Grade.REPEAT
    return SessionEventKind.FAILED if is_refused else SessionEventKind.DONE
