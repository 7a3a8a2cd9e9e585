"""The tip library at the step Start: lists, dialog, and tips typed or scanned."""

from dataclasses import replace
from datetime import datetime
from pathlib import Path

from PySide6.QtCore import QCoreApplication, QObject, QTimer, Signal
from PySide6.QtWidgets import QWidget

from lightpen.arrays import FloatArray
from lightpen.model.names import Origin
from lightpen.record.library.library_changes import Author, add_item, change_item
from lightpen.record.library.tip_library import SWUNG, ItemKind, Library, ListedTip
from lightpen.swing.preparation import NO_SOURCE, Preparation, SourceKind
from lightpen_app.look.phrases import missing_input_text
from lightpen_app.look.words import shortened
from lightpen_app.steps.start.fields import ItemChoice
from lightpen_app.steps.start.form import LimitsForm, NamesForm
from lightpen_app.steps.start.library_dialog import LibraryDialog, RequestedChange
from lightpen_app.steps.start.limits_dialog import AssumptionsDialog
from lightpen_app.widgets.bars import Question, QuestionBar
from lightpen_app.widgets.state_banner import status_message
from lightpen_app.work.selection import Selection
from lightpen_app.work.workbench import Workbench


class LibraryControl(QObject):
    """Keeps the lists and the dialog of the library, and finds tips by their codes.

    The question asks whether to add an unknown one.
    """

    # ItemKind, str: an item was chosen, in a list, in the dialog or by its code
    chosen = Signal(object, str)
    unknown_declined = Signal()  # an unknown tip is not to be added

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
    if asked.is_new:
        return add_item(folder, asked.item, by, now)
    return change_item(folder, asked.item, by, now, asked.before)


TYPING_PAUSE_MS = 400  # after which what was typed is taken over


class EntryPresenter(QObject):
    """Fills the fields from the selection and applies entries."""

    edited = Signal()  # something is being typed; it may be unfinished

    def __init__(
        self,
        selection: Selection,
        library: LibraryControl,
        names: NamesForm,
        limits: LimitsForm,
        assumed: AssumptionsDialog,
    ) -> None:
        super().__init__(names)
        self._selection, self._library = selection, library
        self._names, self._limits, self._assumed = names, limits, assumed
        self._typing = QTimer(self, singleShot=True, interval=TYPING_PAUSE_MS)
        # Typed here, perhaps before the name of the tip: for a tip that is not known
        self._ball: float | None = None
        self._nominal_tip: FloatArray | None = None

        # Connections
        names.value_edited.connect(self._on_edited)
        names.value_changed.connect(self._take_names)
        names.ball_entered.connect(self._on_ball_entered)
        names.station_changed.connect(self._on_station_changed)
        names.nominal_tip_changed.connect(self._on_nominal_tip_changed)
        library.chosen.connect(self._on_item_chosen)
        library.unknown_declined.connect(self._on_unknown_declined)
        limits.value_changed.connect(self._on_limits_changed)
        assumed.value_changed.connect(self._on_assumed_changed)
        self._typing.timeout.connect(self._take_names)
        selection.changed.connect(self._on_selected)

        self._show(selection.preparation)

    def typed(self) -> Preparation:
        """Return the selection with the names being typed."""
        return replace(self._selection.preparation, names=self._names.value())

    def why_not_on(self) -> str:
        """Return the missing input, or that the tip is retired."""
        typed = self.typed()
        missing = typed.start_missing_inputs()
        tip = self._library.tip(typed.names.tip)
        if missing:
            return missing_input_text(missing[0])
        if tip is None or not tip.is_retired:
            return ""
        return QCoreApplication.translate(
            "StartPage",
            "Tip {0} is retired. Choose another tip, or reactivate it in the tip "
            "library.",
        ).format(shortened(tip.id))

    def _on_edited(self) -> None:
        self._typing.start()
        self.edited.emit()

    def _take_names(self) -> None:
        """Apply all names but the station's, which may be incomplete."""
        self._typing.stop()
        now = self._selection.preparation
        names = replace(self._names.value(), station=now.names.station)
        if names == now.names:
            return
        renamed, listed = now.renamed(names), self._library.tip(names.tip)
        if names.tip != now.names.tip:
            ball = renamed.names.ball_diameter or self._ball
            point = self._nominal_tip
            point = point if renamed.nominal_tip is None else renamed.nominal_tip
            names = replace(renamed.names, ball_diameter=ball)
            renamed = replace(renamed, names=names, nominal_tip=point)
            if listed is not None:
                renamed = renamed.with_listed(listed)
        self._selection.set_preparation(renamed)

    def _on_ball_entered(self, ball: float) -> None:
        self._ball = ball or None
        self._take_names()

    def forget_typed(self) -> None:
        """Keep what was typed for the tip that is chosen from another tip."""
        self._ball = self._nominal_tip = None

    def _on_item_chosen(self, kind: ItemKind, name: str) -> None:
        """Apply a selected pen, tip or cone; a tip with its properties."""
        self._take_names()
        now = self._selection.preparation
        tip = self._library.tip(name)
        if kind is ItemKind.TIP and tip is not None:
            self.forget_typed()
            self._selection.set_preparation(now.with_listed(tip))
        elif kind is ItemKind.PEN:
            names = replace(now.names, pen=name)
            self._selection.set_preparation(replace(now, names=names))
        else:
            names = replace(now.names, cone=name)
            self._selection.set_preparation(replace(now, names=names))

    def _on_unknown_declined(self) -> None:
        """Ask for the tip again: the code belongs to another one."""
        self._take_names()
        now = self._selection.preparation
        self._selection.set_preparation(now.renamed(replace(now.names, tip="")))

    def _on_station_changed(self, name: str) -> None:
        """Bring back a known station; a new one takes over the present choices."""
        self._take_names()
        now = self._selection.preparation
        if name in self._selection.stations():
            self._selection.choose_station(name)
        else:
            if now.names.station and now.source.kind == SourceKind.SIMULATED:
                now = now.with_source(NO_SOURCE)  # only the station before simulates
            now = replace(now, names=replace(now.names, station=name))
            self._selection.set_preparation(now)
        self._names.set_stations(self._selection.stations())

    def _on_nominal_tip_changed(self) -> None:
        now, point = self._selection.preparation, self._names.nominal_tip()
        self._nominal_tip = point
        self._selection.set_preparation(replace(now, nominal_tip=point))

    def _on_limits_changed(self) -> None:
        now, limits = self._selection.preparation, self._limits.value()
        self._selection.set_preparation(replace(now, limits=limits))

    def _on_assumed_changed(self) -> None:
        now, assumed = self._selection.preparation, self._assumed.value()
        self._selection.set_preparation(now.with_assumptions(assumed))

    def settle(self) -> None:
        """Apply pending input."""
        self._names.settle()
        self._limits.settle()
        self._take_names()
        station = self._names.value().station
        if station != self._selection.preparation.names.station:
            self._on_station_changed(station)

    def _on_selected(self, before: Preparation) -> None:
        now = self._selection.preparation
        if now.names.tip not in (before.names.tip, self._names.value().tip):
            self.forget_typed()  # another was chosen elsewhere
        self._show(now, before)

    def _show(self, now: Preparation, before: Preparation | None = None) -> None:
        """Update the fields that differ; others may be in use."""
        if before is None or now.names != before.names:
            self._names.set_value(now.names, None if before is None else before.names)
        if before is None or now.names.station != before.names.station:
            self._names.set_stations(self._selection.stations())
        if now.limits != self._limits.value():
            self._limits.set_value(now.limits)
        self._limits.set_guarded(self._selection.supervision.is_guarded)
        if now.assumptions_today != self._assumed.value():
            self._assumed.set_value(now.assumptions_today)
        if before is None or now.nominal_tip is not before.nominal_tip:
            self._names.set_nominal_tip(now.nominal_tip)
        if before is None or now.pen_file is not before.pen_file:
            pen = None if now.pen_file is None else now.pen_file.pen
            self._names.set_tip_of_file(None if pen is None else pen.nominal_tip)
