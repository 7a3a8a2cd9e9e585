"""The LED table as a draft: opened file, edits and undo."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

from PySide6.QtCore import QCoreApplication, QObject, Signal
from PySide6.QtGui import QUndoCommand, QUndoStack
from typing_extensions import override

from lightpen.formats.opened_files import PenFile
from lightpen.pen_check.draft import DraftCheck, PenDraft, check_draft
from lightpen.swing.preparation import Preparation
from lightpen_app.look.phrases import first_missing
from lightpen_app.steps.leds.table_panel import Changes
from lightpen_app.work.selection import Selection

translate = QCoreApplication.translate

NO_MERGING, DIAMETER, TIP = -1, 1, 2


class DraftEdit(QUndoCommand):
    """Puts a draft in place of another.

    What is typed into the same field, letter by letter, is one change. ``put`` shows a
    draft.
    """

    def __init__(
        self, put: Callable[[PenDraft], object], before: PenDraft, after: PenDraft
    ) -> None:
        super().__init__()
        self._put = put
        self.before, self.after = before, after

    @override
    def id(self) -> int:
        """Return the edited field."""
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


@dataclass(frozen=True)
class LedState:
    """Content of the table and the file in use."""

    draft: PenDraft = field(default_factory=PenDraft)
    opened: PenDraft = field(default_factory=PenDraft)  # the table without changes
    # The file that it was opened from, where that cannot be used.
    invalid_file: Path | None = None
    in_use: PenFile | None = None

    @property
    def is_edited(self) -> bool:
        """Whether there are changes that are not saved."""
        return self.draft != self.opened

    @property
    def is_pending(self) -> bool:
        """Whether the table shows something else than the file in use."""
        return self.is_edited or self.invalid_file is not None

    @property
    def changes(self) -> Changes:
        """Differences between the table and the file in use."""
        if self.is_edited:
            return Changes.EDITED
        return Changes.NONE if self.invalid_file is None else Changes.FOREIGN

    @property
    def path(self) -> str:
        """The file that is open; empty without one."""
        if self.invalid_file is not None:
            return str(self.invalid_file)
        return "" if self.in_use is None else str(self.in_use.path)

    @cached_property
    def check(self) -> DraftCheck:
        """Result of checking the draft."""
        in_use = None if self.is_pending else self.in_use
        return check_draft(self.draft, None if in_use is None else in_use.pen)


class LedDraft(QObject):
    """Holds the state of the LED table; changes of it can be undone."""

    changed = Signal()  # `state` is different

    def __init__(self, selection: Selection, parent: QObject) -> None:
        super().__init__(parent)
        self._selection = selection
        self._state = LedState()
        self.edits = QUndoStack(self)

    @property
    def state(self) -> LedState:
        """Current content of the table."""
        return self._state

    def follow_selection(self) -> None:
        """Open the file that is in use, if it is another; changes stay."""
        file, before = self._selection.preparation.pen_file, self._state
        if file is not before.in_use:
            self._state = replace(before, in_use=file)
            self.open_in_use()
            if before.is_edited:
                self.edit(before.draft)

    def use(self, file: PenFile, *, keeps_changes: bool = False) -> None:
        """Use a file and show it, optionally with later edits."""
        preparation = self._selection.preparation
        self._selection.set_preparation(replace(preparation, pen_file=file))
        if not keeps_changes:
            self.open_in_use()

    def open_in_use(self) -> None:
        """Show the file in use without changes."""
        file = self._state.in_use
        self.open(PenDraft() if file is None else PenDraft.of(file.pen), None)

    def open(self, draft: PenDraft, invalid_file: Path | None) -> None:
        """Show the draft of a newly opened or saved file."""
        if draft != self._state.draft:  # else it was just saved
            self.edits.clear()
        self._state = replace(self._state, opened=draft, invalid_file=invalid_file)
        self.show(draft)

    def edit(self, draft: PenDraft) -> None:
        """Show another draft; the change can be undone."""
        self.edits.push(DraftEdit(self.show, self._state.draft, draft))

    def show(self, draft: PenDraft) -> None:
        """Show another draft."""
        self._state = state = replace(self._state, draft=draft)
        preparation = self._selection.preparation
        if preparation.has_unsaved_leds is not state.is_pending:
            self._selection.set_preparation(
                replace(preparation, has_unsaved_leds=state.is_pending)
            )
        self.changed.emit()


def why_not_next(state: LedState, preparation: Preparation) -> str:
    """Return why no swing can be captured with these LEDs yet."""
    if not state.is_pending:
        return first_missing(preparation.leds_missing_inputs())
    if state.check.usable is None:
        return translate(
            "LedsPage", "Correct the LED table first (see the message above)."
        )
    return translate("LedsPage", "Save the LED table first; the record needs its file.")


def why_not_savable(state: LedState) -> str:
    """Return why the table cannot be saved."""
    if not state.draft.rows:
        return translate("LedsPage", "The table has no LEDs.")
    if state.check.usable is None:
        return translate(
            "LedsPage", "Correct the LEDs first; a file of these LEDs would be invalid."
        )
    return ""


def unsaved_leds_text(state: LedState) -> str:
    """Return the message on the changes that would be lost."""
    if not state.is_edited:
        return ""
    return translate("LedsPage", "The LED table has unsaved changes.")
