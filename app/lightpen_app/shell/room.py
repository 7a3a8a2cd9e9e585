"""How much room a window has, and what has to be given up where that is little."""

from dataclasses import dataclass

from PySide6.QtCore import QSize

from lightpen_app.look.theme import GRID

NARROW, LOW = 150 * GRID, 80 * GRID  # px; smaller windows are short of room


@dataclass(frozen=True)
class Room:
    """Whether a window is short of room.

    Attributes
    ----------
    is_narrow, is_low : bool
        Of width and of height, as with a screen of 1920 x 1080 drawn at 200 %.
    """

    is_narrow: bool = False
    is_low: bool = False

    @classmethod
    def of(cls, size: QSize) -> "Room":
        """Return the room in a window of this size."""
        return cls(size.width() < NARROW, size.height() < LOW)

    @property
    def margin(self) -> int:
        """What is left free at the left and right of a page, px."""
        return 2 * GRID if self.is_narrow else 4 * GRID
