"""Who is at a swing: when one begins, waits and goes on without a key being pressed."""

from dataclasses import dataclass, replace
from typing import Self

from lightpen.sentences import Sentence
from lightpen.swing.preparation import Preparation


@dataclass(frozen=True, eq=False)
class Attendance:
    """Whether somebody is at the swing, and with what a new one would begin.

    Until somebody has come or left, a swing begins and pauses by commands alone.

    Attributes
    ----------
    is_here : bool
        Whether somebody waits for a swing: one begins as soon as all is there for it.
    is_away : bool
        Whether whoever was at it is elsewhere: what is captured is paused meanwhile.
    paused_by_leaving : bool
        Whether it is paused for that reason alone, and goes on when somebody comes.
    choices : Preparation or None
        What is chosen now.
    begun_with : Preparation or None
        What was chosen when the swing began, or kept since.
    refusal : Sentence or None
        Why no swing could begin; nothing is tried again until it is None.
    """

    is_here: bool = False
    is_away: bool = False
    paused_by_leaving: bool = False
    choices: Preparation | None = None
    begun_with: Preparation | None = None
    refusal: Sentence | None = None

    @property
    def is_due(self) -> bool:
        """Whether a swing is to begin, if there is none and images come."""
        is_wanted = self.is_here and self.refusal is None
        return is_wanted and self.choices is not None and not self.choices.lacks()

    @property
    def has_other_choices(self) -> bool:
        """Whether a swing that began now would be another one."""
        if self.choices is None or self.begun_with is None:
            return False
        return not self.begun_with.swings_like(self.choices)

    def come(self) -> Self:
        """Return it with somebody at the swing; what was refused is tried again."""
        return replace(
            self, is_here=True, is_away=False, paused_by_leaving=False, refusal=None
        )

    def left(self) -> Self:
        """Return it with nobody at the swing."""
        return replace(self, is_here=False, is_away=True)

    def begun(self) -> Self:
        """Return it with a swing that begins with what is chosen now."""
        return replace(
            self, begun_with=self.choices, paused_by_leaving=False, refusal=None
        )
