"""The tip library at the step Start: lists, dialog and barcodes."""

from datetime import datetime
from pathlib import Path

from msgspec import structs
from PySide6.QtCore import QObject, Signal
from PySide6.QtWidgets import QWidget

from lightpen.model.origin import Origin
from lightpen.record.library.library_changes import (
    Author,
    add_item,
    change_item,
    keep_picture,
)
from lightpen.record.library.tip_library import (
    SWUNG,
    AnyItem,
    ItemKind,
    Library,
    ListedTip,
)
from lightpen_app.look.words import shortened
from lightpen_app.steps.start.barcode import BarcodeListener
from lightpen_app.steps.start.fields import ItemChoice
from lightpen_app.steps.start.form import NamesForm
from lightpen_app.steps.start.library_dialog import LibraryDialog, RequestedChange
from lightpen_app.widgets.question_bar import Question, QuestionBar
from lightpen_app.widgets.status_mark import status_message
from lightpen_app.work.workbench import Workbench


class LibraryControl(QObject):
    """Keeps the lists and the dialog of the library, and answers barcodes.

    The question asks whether to add an unknown barcode.
    """

    # ItemKind, str: an item was chosen, in a list, in the dialog or by its barcode
    chosen = Signal(object, str)
    unknown_declined = Signal()  # barcode of an unknown tip that is not to be added

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
        self.barcodes = BarcodeListener(self)

        # Connections
        self._watch.changed.connect(self.refresh)
        self.barcodes.scanned.connect(self.take_code)
        names.item_chosen.connect(self.chosen)
        names.library_requested.connect(self.open)
        question.agreed.connect(self._on_agreed)
        question.declined.connect(self.unknown_declined)

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

    def tip(self, name: str) -> ListedTip | None:
        """Return a tip of the library."""
        return self._watch.library.tip(name)

    def _made_dialog(self) -> LibraryDialog:
        dialog = LibraryDialog(self._folder, self._page)

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
        """Choose the tip of a barcode; offer to add one that is not known."""
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
        self._notices.show_status(
            self.tr("Tip {0} selected by barcode.").format(tip.id)
        )

    def _asking(self) -> Question:
        words = self.tr("Tip {0} is not in the tip library. Add it?")
        asked = words.format(shortened(self._unknown))
        return Question(asked, self.tr("Add tip"), self.tr("Not now"))

    def _on_agreed(self) -> None:
        self.open().add(self._unknown, ItemKind.TIP)

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
    """Make a change; its picture first."""
    item: AnyItem = asked.item
    if asked.picture and isinstance(item, ListedTip):
        item = structs.replace(item, picture=keep_picture(folder, Path(asked.picture)))
    if asked.is_new:
        return add_item(folder, item, by, now)
    return change_item(folder, item, by, now, asked.before)
