"""How long a tip may be in force before it is calibrated again."""

from dataclasses import dataclass
from datetime import datetime, timedelta

USUAL_DAYS = 30
MOST_DAYS, MOST_SWINGS = 3650, 10_000  # that a rule is chosen with


@dataclass(frozen=True)
class DueRule:
    """How long a tip may be in force.

    Attributes
    ----------
    max_days : int
        Days since it was calibrated.
    max_swings : int
        Swings of its pen since, with whatever tip: each one that is screwed in and out
        wears the seat of all. 0 for any number.
    """

    max_days: int = USUAL_DAYS
    max_swings: int = 0

    def __post_init__(self) -> None:
        if self.max_days < 1 or self.max_swings < 0:
            raise ValueError(f"No tip can be due by {self}.")

    def due(self, accepted: datetime) -> datetime:
        """Return when a tip is due by its age."""
        return accepted + timedelta(days=self.max_days)
