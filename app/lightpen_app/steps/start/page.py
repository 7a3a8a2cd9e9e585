"""The step Start: who calibrates what, where, and what there is of it already."""

from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

from PySide6.QtCore import QEvent, QSize, QTimer
from PySide6.QtGui import QHideEvent, QKeyEvent, QShowEvent
from PySide6.QtWidgets import QBoxLayout, QVBoxLayout, QWidget
from typing_extensions import override

from lightpen.model.due_rule import DueRule
from lightpen.model.limits import StationLimits
from lightpen.model.origin import Origin
from lightpen.record.results import Result
from lightpen.record.supervision import Signature, Supervision, lay_down
from lightpen.record.tip_library import ItemKind
from lightpen.swing.preparation import Preparation
from lightpen_app.look.phrases import lack_text
from lightpen_app.look.sounds import Sounds
from lightpen_app.look.theme import GRID
from lightpen_app.look.words import shortened
from lightpen_app.steps.page import MainAction, Page
from lightpen_app.steps.start.assumptions_panel import AssumptionsPanel
from lightpen_app.steps.start.data_folder_panel import DataFolderPanel
from lightpen_app.steps.start.form import LimitsForm, NamesForm
from lightpen_app.steps.start.interrupted_control import InterruptedControl
from lightpen_app.steps.start.interrupted_panel import InterruptedPanel
from lightpen_app.steps.start.library_control import LibraryControl
from lightpen_app.steps.start.limits_dialog import LimitsDialog
from lightpen_app.steps.start.newcomer_panel import NewcomerPanel
from lightpen_app.steps.start.result_panel import LastResult, LastResultPanel
from lightpen_app.steps.start.sound_test import SoundTest
from lightpen_app.steps.start.vast_panel import VastPanel
from lightpen_app.widgets.page_scroll import PageScroll
from lightpen_app.widgets.question_bar import QuestionBar
from lightpen_app.widgets.rearranged import Rearranged
from lightpen_app.work.job import Job, Report
from lightpen_app.work.workbench import TRIAL, Workbench

T = TypeVar("T")

TYPING_PAUSE_MS = 400  # after which what was typed is taken over


class StartPage(Rearranged, Page):
    """Names, limits, the last result of the pen and tip, and interrupted swings."""

    key = "start"
    narrow_below = 100 * GRID  # px; then it has one column
    large_from = QSize(150 * GRID, 96 * GRID)  # px; then its figures are larger
    vast_from = QSize(240 * GRID, 150 * GRID)  # px; then there is more below

    def __init__(
        self, workbench: Workbench, sounds: Sounds, parent: QWidget | None = None
    ) -> None:
        super().__init__(parent)
        self._workbench = workbench
        self._shown = workbench.preparation
        self._looked_up = ("", "", False)
        self._wants_last = False  # of a tip that was just named
        self._taken_back: Result | None = None
        self._lookup: Job | None = None
        self._signing: Job | None = None
        self._is_trying = False

        # Widgets: the order of making them is the order of the Tab key
        self._names = NamesForm()
        self._limits = LimitsForm()
        self._all_limits = LimitsDialog(self)
        self._unknown_code = QuestionBar()
        self._library = LibraryControl(workbench, self._names, self._unknown_code, self)
        self._assumed = AssumptionsPanel()
        self._interrupted = InterruptedPanel()
        self._unfinished = InterruptedControl(
            workbench, self._interrupted, self._settle, self
        )
        self._last = LastResultPanel(workbench.around.now)
        self._sound_test = SoundTest(sounds)
        self._folder = DataFolderPanel(workbench.folder)
        self._newcomer = NewcomerPanel()
        self._vast = VastPanel(workbench.run.logbook)
        self._typing = QTimer(self)
        self._typing.setSingleShot(True)
        self._typing.setInterval(TYPING_PAUSE_MS)

        # Layout
        self._left = left = QVBoxLayout()
        left.setSpacing(2 * GRID)
        left.addWidget(self._unknown_code)
        left.addWidget(self._names)
        left.addWidget(self._limits)
        left.addWidget(self._assumed)
        left.addStretch(1)
        self._right = right = QVBoxLayout()
        right.setSpacing(2 * GRID)
        right.addWidget(self._last)
        right.addWidget(self._sound_test)
        right.addWidget(self._folder)
        self._is_known = bool(workbench.stations())
        if self._is_known:
            right.addWidget(self._newcomer)
        right.addStretch(1)
        content = QWidget()
        rows = QVBoxLayout(content)
        rows.setContentsMargins(0, 0, 0, 0)
        rows.setSpacing(3 * GRID)
        self._columns = columns = QBoxLayout(QBoxLayout.Direction.LeftToRight)
        columns.setSpacing(3 * GRID)
        self._use_room()  # before the columns: the order of the Tab key
        columns.addLayout(left, 5)
        columns.addLayout(right, 4)
        rows.addLayout(columns)
        rows.addWidget(self._vast, 1)
        scroll = PageScroll()
        scroll.setWidget(content)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(scroll)

        # Connections
        self._names.value_edited.connect(self._on_edited)
        self._names.value_changed.connect(self._take_names)
        self._names.station_changed.connect(self._on_station_changed)
        self._names.station_entered.connect(self.show_lack)
        self._names.nominal_tip_changed.connect(self._on_nominal_tip_changed)
        self._library.chosen.connect(self._on_item_chosen)
        self._library.told.connect(self.status_changed)
        workbench.library.changed.connect(self._show_standing)
        self._limits.value_changed.connect(self._on_limits_changed)
        self._limits.all_requested.connect(self._on_all_limits_requested)
        self._all_limits.signed.connect(self._on_limits_signed)
        self._assumed.value_changed.connect(self._on_assumed_changed)
        self._typing.timeout.connect(self._take_names)
        self._unfinished.notice_raised.connect(self.notice_raised)
        self._unfinished.told.connect(self.status_changed)
        self._unfinished.step_requested.connect(self.step_requested)
        self._newcomer.trial_requested.connect(self._on_trial_requested)
        self._last.take_back_requested.connect(self._on_take_back_requested)
        self._last.verification_requested.connect(self._on_verification_requested)
        self._folder.change_requested.connect(self.data_folder_requested)
        self._folder.told.connect(self.status_changed)
        workbench.folder_watch.counted.connect(self._folder.set_others)
        workbench.folder_watch.doubted.connect(self._folder.set_trouble)
        workbench.changed.connect(self._on_workbench_changed)
        workbench.run.changed.connect(self._on_run_changed)

        self._show_changes(None, self._shown)
        self._retranslate()

    @override
    def title(self) -> str:
        return self.tr("Start")

    @override
    def lead(self) -> str:
        return self.tr(
            "Say what is calibrated. All of it is remembered for the station."
        )

    @override
    def is_complete(self) -> bool:
        return not self._why_not_on()

    @override
    def main_action(self) -> MainAction:
        return MainAction(self.tr("Continue to the camera"), self._why_not_on())

    @override
    def run_main_action(self) -> None:
        self._settle()
        super().run_main_action()

    @override
    def show_lack(self) -> None:
        lacks = self._typed().start_lacks()
        if lacks:
            self._names.focus_lack(lacks[0])

    @override
    def entered(self) -> None:
        self._names.set_stations(self._workbench.stations())
        self._workbench.library.refresh()
        self._look_up_last()

    @override
    def left(self) -> None:
        self._settle()
        self._sound_test.stop()

    @override
    def shut_down(self) -> None:
        self._unfinished.shut_down()
        self._vast.shut_down()
        for job in (self._lookup, self._signing):
            if job is not None:
                job.cancel()

    @override
    def _use_room(self) -> None:
        direction = QBoxLayout.Direction
        is_narrow = self._room.is_narrow
        self._columns.setDirection(
            direction.TopToBottom if is_narrow else direction.LeftToRight
        )
        # What waits for an answer comes first.
        column = self._left if is_narrow else self._right
        if not self._is_known:
            self._newcomer.set_wide(is_narrow)
            column.insertWidget(0, self._newcomer)
        column.insertWidget(0, self._interrupted)
        self._last.set_room(self._room)
        self._vast.setVisible(self._room.is_vast)
        self._show_vast()

    @override
    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        self._library.barcodes.listen(self.window().windowHandle())
        if not event.spontaneous():
            self._unfinished.search()

    @override
    def hideEvent(self, event: QHideEvent) -> None:
        super().hideEvent(event)
        self._library.barcodes.listen(None)

    @override
    def event(self, event: QEvent) -> bool:
        """Let no key of a barcode be taken for a shortcut."""
        if (
            event.type() == QEvent.Type.ShortcutOverride
            and isinstance(event, QKeyEvent)
            and self._library.barcodes.is_amid(event)
        ):
            event.accept()
            return True
        return super().event(event)

    @override
    def _retranslate(self) -> None:
        self._tell_why_unverified()
        self._tell_why_untried()
        self._library.refresh()
        self.changed.emit()

    def _why_not_on(self) -> str:
        """Return what is missing, or that the tip is retired."""
        typed = self._typed()
        lacks, tip = typed.start_lacks(), self._library.tip(typed.names.tip)
        if lacks:
            return lack_text(lacks[0])
        if tip is None or not tip.is_retired:
            return ""
        return self.tr(
            "Tip {0} is retired. Choose another one, or bring it back in the library."
        ).format(shortened(tip.id))

    # What is typed

    def _typed(self) -> Preparation:
        """Return what is chosen, with the names as they are being typed."""
        return replace(self._workbench.preparation, names=self._names.value())

    def _on_edited(self) -> None:
        self._typing.start()
        self.changed.emit()

    def _take_names(self) -> None:
        """Take over all names but that of the station, which may be unfinished."""
        self._typing.stop()
        now = self._workbench.preparation
        names = replace(self._names.value(), station=now.names.station)
        if names == now.names:
            return
        is_other = names.tip != now.names.tip
        self._wants_last = self._wants_last or is_other
        renamed, listed = now.renamed(names), self._library.tip(names.tip)
        is_bare = renamed.names.ball_diameter is None
        if is_other and listed is not None and is_bare:
            renamed = renamed.with_listed(listed)
        self._choose_tip(renamed)

    def _on_item_chosen(self, kind: ItemKind, name: str) -> None:
        """Take over a pen, tip or cone that was chosen; a tip with what is its own."""
        self._take_names()
        now = self._workbench.preparation
        tip = self._library.tip(name)
        if kind is ItemKind.TIP and tip is not None:
            self._wants_last = True
            chosen = now.with_listed(tip)
        elif kind is ItemKind.PEN:
            chosen = replace(now, names=replace(now.names, pen=name))
        else:
            chosen = replace(now, names=replace(now.names, cone=name))
        self._workbench.set_preparation(chosen)

    def _on_station_changed(self, name: str) -> None:
        """Bring back a known station; a new one takes over the present choices."""
        self._take_names()
        now = self._workbench.preparation
        if name in self._workbench.stations():
            self._workbench.choose_station(name)
        else:
            self._choose(replace(now, names=replace(now.names, station=name)))
        self._names.set_stations(self._workbench.stations())

    def _on_nominal_tip_changed(self) -> None:
        point = self._names.nominal_tip()
        self._choose(replace(self._workbench.preparation, nominal_tip=point))

    def _on_limits_changed(self) -> None:
        self._choose(replace(self._workbench.preparation, limits=self._limits.value()))

    def _on_all_limits_requested(self) -> None:
        now, choices = self._workbench.preparation, self._workbench.choices
        due = self._workbench.due_rule()
        limits = StationLimits(now.limits, choices.limits, due)
        is_guarded = self._workbench.supervision.is_guarded
        self._all_limits.set_value(limits, is_guarded=is_guarded)
        self._all_limits.open()

    def _on_limits_signed(
        self, limits: StationLimits, signature: Signature, new_password: str
    ) -> None:
        workbench = self._workbench
        folder, now = workbench.folder, workbench.around.now
        station = workbench.preparation.names.station
        self._signing = self._started(
            lambda _: lay_down(
                *(folder, station, limits, signature, new_password, now())
            ),
            self._on_laid_down,
        )
        self._signing.failed.connect(self._all_limits.tell)

    def _on_laid_down(self, supervision: Supervision) -> None:
        self._all_limits.close()
        self._workbench.set_supervision(supervision)
        self._workbench.enter_owed()

    def _on_assumed_changed(self) -> None:
        assumed = self._assumed.value()
        self._choose(replace(self._workbench.preparation, assumptions=assumed))

    def _choose_tip(self, preparation: Preparation) -> None:
        """Choose names with what belongs to their tip; they may be being typed in."""
        self._names.set_ball(preparation.names.ball_diameter)
        self._names.set_nominal_tip(preparation.nominal_tip)
        self._choose(preparation)

    def _choose(self, preparation: Preparation) -> None:
        self._shown = preparation  # the fields show it already
        self._workbench.set_preparation(preparation)

    def _settle(self) -> None:
        """Take over what is being typed."""
        self._names.settle()
        self._limits.settle()
        self._take_names()
        station = self._names.value().station
        if station != self._workbench.preparation.names.station:
            self._on_station_changed(station)

    # What is shown

    def _on_workbench_changed(self) -> None:
        before, now = self._shown, self._workbench.preparation
        self._shown = now
        self._show_changes(before, now)
        self._go_on_trying()
        self._tell_why_unverified()
        self._limits.set_guarded(self._workbench.supervision.is_guarded)
        if _key(now) != self._looked_up:
            self._look_up_last()
        if before.names != now.names or before.origin is not now.origin:
            self._library.refresh()
            self._show_standing()
        self.changed.emit()

    def _show_standing(self) -> None:
        """Mark the tip that is named, as it stands now."""
        now, library = self._workbench.preparation, self._workbench.library
        standings = library.standings
        standing = standings.of_tip(now.names.pen, now.names.tip)
        is_simulated = now.origin is Origin.SIMULATED
        self._last.set_standing(None if is_simulated else standing)
        self._last.set_rule(self._rule_looked_up())
        self.changed.emit()

    def _show_changes(self, before: Preparation | None, now: Preparation) -> None:
        """Fill the fields of what is different; others may be being typed in."""
        if before is None or now.names != before.names:
            self._typing.stop()
            self._names.set_value(now.names)
        if before is None or now.names.station != before.names.station:
            self._names.set_stations(self._workbench.stations())
        if before is None or now.limits != before.limits:
            self._limits.set_value(now.limits)
        if before is None or now.assumptions != before.assumptions:
            self._assumed.set_value(now.assumptions)
        if before is None or now.nominal_tip is not before.nominal_tip:
            self._names.set_nominal_tip(now.nominal_tip)
        if before is None or now.pen_file is not before.pen_file:
            pen = None if now.pen_file is None else now.pen_file.pen
            self._names.set_tip_of_file(None if pen is None else pen.nominal_tip)

    def _tell_why_unverified(self) -> None:
        lacks = self._workbench.preparation.lacks()
        self._last.set_why_unverified(lack_text(lacks[0]) if lacks else "")

    def _look_up_last(self) -> None:
        """Look for the result in force, for the pen and tip that are named."""
        if self._lookup is not None:
            self._lookup.cancel()
        self._looked_up = pen, tip, is_simulated = _key(self._workbench.preparation)
        self._show_vast()
        if not (pen and tip):
            self._last.set_value(LastResult(is_named=False))
            return
        archive = self._workbench.run.archive
        self._lookup = self._started(
            lambda _: archive.in_force(pen, tip, is_simulated=is_simulated),
            self._on_looked_up,
        )
        self._lookup.failed.connect(self._on_lookup_failed)
        self._lookup.crashed.connect(self._on_lookup_crashed)

    def _show_vast(self) -> None:
        """Show more of the tip that is named where there is the room."""
        if self._room.is_vast:
            pen, tip, is_simulated = _key(self._workbench.preparation)
            self._vast.set_value(pen, tip, is_simulated=is_simulated)

    def _rule_looked_up(self) -> DueRule:
        """Return how long the tip that is looked for may be in force."""
        library = self._workbench.library.library
        return library.rule_of(self._looked_up[1], self._workbench.due_rule())

    def _on_looked_up(self, result: Result | None) -> None:
        found = LastResult(
            result, is_simulated=self._looked_up[2], rule=self._rule_looked_up()
        )
        self._last.set_value(found)
        now = self._workbench.preparation
        wants_last, self._wants_last = self._wants_last, False
        is_bare = now.names.ball_diameter is None and now.nominal_tip is None
        if wants_last and is_bare and result is not None:
            self._choose_tip(now.with_last(result))

    def _on_lookup_failed(self, sentence: str) -> None:
        self._last.set_value(LastResult(trouble=sentence))

    def _on_lookup_crashed(self) -> None:
        self._on_lookup_failed(self.tr("The last calibration cannot be shown."))

    # A trial with the simulated pen

    def _on_trial_requested(self) -> None:
        self._is_trying = True
        self._workbench.try_out()

    def _go_on_trying(self) -> None:
        """Show the swing of a trial once simulated images and files are there."""
        now = self._workbench.preparation
        if now.names != TRIAL:
            self._is_trying = False
        if self._is_trying and not now.lacks():
            self._is_trying = False
            self.step_requested.emit("swing")

    def _on_verification_requested(self) -> None:
        self._settle()
        self.step_requested.emit("verify")

    def _on_take_back_requested(self, result: Result) -> None:
        operator = self._workbench.preparation.names.operator
        self._workbench.run.runner.take_back(result, operator)

    def _on_run_changed(self) -> None:
        status = self._workbench.run.status
        self._tell_why_untried()
        if status.taken_back is not self._taken_back:
            self._taken_back = status.taken_back
            self._look_up_last()

    def _tell_why_untried(self) -> None:
        is_on = self._workbench.run.status.state is not None
        self._newcomer.set_why_not(self.tr("A swing is under way.") if is_on else "")

    def _started(
        self, function: Callable[[Report], T], on_succeeded: Callable[[T], None]
    ) -> Job:
        job = Job(function, self)

        # Connections
        job.succeeded.connect(on_succeeded)
        job.start()
        return job


def _key(preparation: Preparation) -> tuple[str, str, bool]:
    """Return what the result that is shown is looked for by."""
    names = preparation.names
    return names.pen, names.tip, preparation.origin is Origin.SIMULATED
