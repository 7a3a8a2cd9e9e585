"""A change of the LED table that can be undone."""

from collections.abc import Callable

from PySide6.QtGui import QUndoCommand
from typing_extensions import override

from lightpen.pen_check.draft import PenDraft

NO_MERGING, DIAMETER, TIP = -1, 1, 2


class DraftEdit(QUndoCommand):
    """Puts a draft in place of another.

    What is typed into the same field, letter by letter, is one change.

    Parameters
    ----------
    put : callable
        Shows a draft.
    """

    def __init__(
        self, put: Callable[[PenDraft], object], before: PenDraft, after: PenDraft
    ) -> None:
        super().__init__()
        self._put = put
        self.before, self.after = before, after

    @override
    def id(self) -> int:
        """Return which field is typed into."""
        if self.before.rows != self.after.rows:
            return NO_MERGING
        return DIAMETER if self.before.tip == self.after.tip else TIP

    @override
    def mergeWith(self, other: QUndoCommand) -> bool:
        """Take a change that follows along."""
        assert isinstance(other, DraftEdit)
        self.after = other.after
        return True

    @override
    def redo(self) -> None:
        self._put(self.after)

    @override
    def undo(self) -> None:
        self._put(self.before)
