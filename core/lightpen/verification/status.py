"""All there is to know of a verification at one moment, for whoever shows it."""

from dataclasses import dataclass
from datetime import datetime
from enum import StrEnum
from pathlib import Path
from typing import Protocol

from lightpen.detection.aim import Aim
from lightpen.sentences import Sentence
from lightpen.verification.assessment import Conformity
from lightpen.verification.choices import TaskKind
from lightpen.verification.session_state import SessionSetup, SessionState
from lightpen.verification.tip_in_force import TipInForce
from lightpen.verification.witness import LampWitness, judged_with


class Reading(StrEnum):
    """What is being read."""

    NOTHING = ""
    TIP = "tip"
    IMAGES = "images"


class SessionHappening(StrEnum):
    """What can happen, each with a sound and a sign of its own."""

    TAKEN = "taken"
    BROKEN_OFF = "broken off"
    KNOWN = "known"
    FINISHED = "finished"  # one task of several
    DONE = "done"
    FAILED = "failed"  # done, with something found against the tip


@dataclass(frozen=True, eq=False)
class VerificationStatus:
    """A verification from the tip in force to its verdict; nothing of it is changed.

    Attributes
    ----------
    setup, state
        None until the tip is read.
    aim : Aim or None
        What its images are looked at for.
    began : datetime or None
        When its first image came.
    files : tuple of Path
        Where what was found is kept.
    witness : LampWitness or None
        What fixed lamps in view tell, since the last task was done.
    is_here : bool
        Whether somebody is at it.
    accepted_by : str
        Who accepted the tip though something was found against it.
    refusal : Sentence or None
        Why nothing can be verified.
    """

    tip: TipInForce | None = None
    setup: SessionSetup | None = None
    state: SessionState | None = None
    aim: Aim | None = None
    began: datetime | None = None
    files: tuple[Path, ...] = ()
    reading: Reading = Reading.NOTHING
    witness: LampWitness | None = None
    is_here: bool = False
    is_paused: bool = False
    accepted_by: str = ""
    refusal: Sentence | None = None

    @property
    def task(self) -> TaskKind | None:
        """What is to be touched now; None when all is done, or nothing can be."""
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
        """Whether all that was chosen is found."""
        return self.state is not None and self.state.is_begun and self.task is None

    @property
    def assessment(self) -> Conformity | None:
        """The worst that was found so far."""
        found = None if self.state is None else self.state.assessment
        return None if found is None else judged_with(found, self.witness)


class VerificationListener(Protocol):
    """Who is told, on the threads of a runner; must return soon."""

    def on_verification(
        self, status: VerificationStatus, events: tuple[SessionHappening, ...]
    ) -> None:
        """Take the status after a change, and what happened."""

    def on_progress(self, fraction: float) -> None:
        """Take how much of the images is read, 0 to 1."""

    def on_trouble(self, sentence: Sentence) -> None:
        """Take a sentence to be read: something could not be done."""

    def on_relief(self, sentence: Sentence) -> None:
        """Take the sentence of a trouble whose cause is gone."""
