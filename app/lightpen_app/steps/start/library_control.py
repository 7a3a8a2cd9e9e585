"""The tip library at the step Start: lists, dialog, and tips typed or scanned."""

from datetime import datetime
from pathlib import Path

from PySide6.QtCore import QObject, Signal
from PySide6.QtWidgets import QWidget

from lightpen.model.names import Origin
from lightpen.record.library.library_changes import Author, add_item, change_item
from lightpen.record.library.tip_library import SWUNG, ItemKind, Library
from lightpen_app.look.words import shortened
from lightpen_app.steps.start.fields import ItemChoice
from lightpen_app.steps.start.form import NamesForm
from lightpen_app.steps.start.library_dialog import LibraryDialog, RequestedChange
from lightpen_app.widgets.bars import Question, QuestionBar
from lightpen_app.widgets.state_banner import status_message
from lightpen_app.work.workbench import Workbench


class LibraryControl(QObject):
    """Keeps the lists and the dialog of the library, and finds tips by their codes.

    The question asks whether to add an unknown one.
    """

    # ItemKind, str: an item was chosen, in the dialog or by its code
    chosen = Signal(object, str)

    def __init__(
        self,
        workbench: Workbench,
        names: NamesForm,
        question: QuestionBar,
        page: QWidget,
    ) -> None:
        super().__init__(page)
        self._page = page
        self._selection = workbench.selection
        self._notices = workbench.notifications
        self._folder, self._clock = workbench.folder, workbench.around.now
        self._watch = workbench.library
        self._names = names
        self._question = question
        self._dialog: LibraryDialog | None = None  # until it is opened first
        self._unknown = ""

        # Connections
        self._watch.changed.connect(self.refresh)
        names.library_requested.connect(self.open)
        question.agreed.connect(lambda: self.open().add(self._unknown, ItemKind.TIP))

        question.set_words(self._asking)

    def refresh(self) -> None:
        """Show the library for the selected pen."""
        statuses, pen = self._watch.statuses, self._selection.preparation.names.pen
        for kind in SWUNG:
            self._names.set_choices(kind, self._choices(kind, pen))
        if self._watch.library.tip(self._unknown) is not None:
            self._question.hide()
        is_guarded = self._selection.supervision.is_guarded
        if self._dialog is not None:
            self._dialog.set_value(statuses, pen, is_guarded=is_guarded)

    def open(self, kind: ItemKind = ItemKind.TIP) -> LibraryDialog:
        """Show the dialog."""
        dialog = self._dialog or self._made_dialog()
        self._dialog = dialog
        self.refresh()
        dialog.set_kind(kind)
        dialog.open()
        return dialog

    def _made_dialog(self) -> LibraryDialog:
        dialog = LibraryDialog(self._page)

        # Connections
        self._watch.change_kept.connect(dialog.show_kept)
        self._watch.change_failed.connect(self._on_change_failed)
        dialog.chosen.connect(self.chosen)
        dialog.change_asked.connect(self._on_change_asked)
        return dialog

    def _choices(self, kind: ItemKind, pen: str) -> tuple[ItemChoice, ...]:
        """Return the items that can be chosen; a simulated tip is never due."""
        found, statuses = [], self._watch.statuses
        is_simulated = self._selection.preparation.origin is Origin.SIMULATED
        for item in self._watch.library.items(kind).values():
            status = statuses.of_item(kind, item.id)
            if kind is ItemKind.TIP and not is_simulated:
                status = statuses.of_tip(pen, item.id) or status
            if not item.is_retired:
                found.append(ItemChoice(item.id, status_message(status)))
        return tuple(found)

    def take_code(self, code: str) -> None:
        """Choose the tip of a code; offer to add one that is not known."""
        tip = self._watch.library.tip(code)
        if tip is None:
            self._unknown = code
            self._question.refresh()
            self._question.ask()
            return
        self._question.hide()
        if tip.is_retired:
            self._notices.show_status(
                self.tr("Tip {0} is retired: {1}").format(
                    tip.id, tip.note or self.tr("choose another tip.")
                )
            )
            return
        self.chosen.emit(ItemKind.TIP, tip.id)

    def _asking(self) -> Question:
        words = self.tr("Tip {0} is not in the tip library. Add it?")
        asked = words.format(shortened(self._unknown))
        return Question(asked, self.tr("Add tip"), self.tr("Not now"))

    def _on_change_asked(self, asked: RequestedChange) -> None:
        names = self._selection.preparation.names
        by = Author(names.station, names.operator, asked.reason, asked.signature)
        folder, now = self._folder, self._clock
        self._watch.change(asked, lambda: _changed(folder, asked, by, now()))

    def _on_change_failed(self, asked: RequestedChange, why: str) -> None:
        """Show the fault in the dialog, or on the page if the dialog is closed."""
        if self._dialog is None or not self._dialog.show_refused(asked, why):
            self._notices.show_status(why)


def _changed(
    folder: Path, asked: RequestedChange, by: Author, now: datetime
) -> Library:
    if asked.is_new:
        return add_item(folder, asked.item, by, now)
    return change_item(folder, asked.item, by, now, asked.before)
