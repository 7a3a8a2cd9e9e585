"""The step Start: station, operator, item, and interrupted work."""

from PySide6.QtCore import QEvent, QSize
from PySide6.QtGui import QHideEvent, QKeyEvent, QShowEvent
from PySide6.QtWidgets import QBoxLayout, QWidget
from typing_extensions import override

from lightpen.swing.preparation import Preparation
from lightpen_app.look.layouts import fill, horizontal_layout, vertical_layout
from lightpen_app.look.phrases import missing_input_text
from lightpen_app.look.sounds import Sounds
from lightpen_app.look.theme import GRID
from lightpen_app.look.words import shortened
from lightpen_app.steps.page import MainAction, Page
from lightpen_app.steps.start.assumptions_panel import AssumptionsPanel
from lightpen_app.steps.start.data_folder_panel import DataFolderPanel
from lightpen_app.steps.start.entries import EntryPresenter
from lightpen_app.steps.start.form import LimitsForm, NamesForm
from lightpen_app.steps.start.interrupted_control import InterruptedControl
from lightpen_app.steps.start.interrupted_panel import InterruptedPanel
from lightpen_app.steps.start.large_screen_panel import LargeScreenPanel
from lightpen_app.steps.start.last_result import LastResultPresenter
from lightpen_app.steps.start.library_control import LibraryControl
from lightpen_app.steps.start.limits_dialog import LimitsControl
from lightpen_app.steps.start.newcomer_panel import NewcomerPanel
from lightpen_app.steps.start.result_panel import LastResultPanel
from lightpen_app.steps.start.sound_test import SoundTest
from lightpen_app.widgets.page_scroll import PageScroll
from lightpen_app.widgets.question_bar import QuestionBar
from lightpen_app.widgets.responsive_layout import ResponsiveLayout
from lightpen_app.work.selection import is_trial_ready, trial_of
from lightpen_app.work.workbench import Workbench


class StartPage(ResponsiveLayout, Page):
    """Names, limits, the last result of the pen and tip, and interrupted swings."""

    key = "start"
    narrow_below = 100 * GRID  # px; then it has one column
    large_from = QSize(150 * GRID, 96 * GRID)  # px; then its figures are larger
    vast_from = QSize(240 * GRID, 150 * GRID)  # px; then there is more below

    def __init__(
        self, workbench: Workbench, sounds: Sounds, parent: QWidget | None = None
    ) -> None:
        super().__init__(parent)
        self._selection, self._run = workbench.selection, workbench.run
        self._tips = workbench.library
        self._camera, self._chosen_files = workbench.camera, workbench.files
        self._is_known = bool(workbench.selection.stations())

        # Widgets: the order of making them is the order of the Tab key
        self._names = NamesForm()
        self._limits = LimitsForm()
        self._all_limits = LimitsControl(workbench, self)
        self._unknown_code = QuestionBar()
        self._library = LibraryControl(workbench, self._names, self._unknown_code, self)
        self._assumed = AssumptionsPanel()
        self._interrupted = InterruptedPanel()
        self._unfinished = InterruptedControl(
            workbench, self._interrupted, self._settle, self
        )
        self._result = LastResultPanel(workbench.around.now)
        self._sound_test = SoundTest(sounds)
        self._folder = DataFolderPanel(workbench.folder, workbench.notifications)
        self._newcomer = NewcomerPanel()
        self._large = LargeScreenPanel(workbench.run.logbook)
        self._last = LastResultPresenter(
            *(self._selection, self._run, self._tips, self._result, self._large)
        )
        self._entries = EntryPresenter(
            self._selection, self._library, self._names, self._limits, self._assumed
        )

        # Layout
        content = QWidget()
        rows = vertical_layout(content, spacing=3 * GRID)
        self._columns = horizontal_layout(rows, spacing=3 * GRID)
        self._left = vertical_layout(
            *(self._columns, self._unknown_code, self._names, self._limits),
            *(self._assumed, 1),
            spacing=2 * GRID,
            stretch=5,
        )
        self._right = vertical_layout(self._columns, spacing=2 * GRID, stretch=4)
        self._use_room()  # before the rest: the order of the Tab key
        fill(self._right, self._result, self._sound_test, self._folder)
        if self._is_known:
            fill(self._right, self._newcomer)
        fill(self._right, 1)
        fill(rows, (self._large, 1))
        scroll = PageScroll()
        scroll.setWidget(content)
        vertical_layout(self, scroll)

        # Connections
        self._names.station_entered.connect(self.show_missing_input)
        self._limits.all_requested.connect(self._all_limits.open)
        self._entries.edited.connect(self.changed)
        self._entries.tip_named.connect(self._last.look_up_tip)
        self._unfinished.step_requested.connect(self.step_requested)
        self._newcomer.trial_requested.connect(self._on_trial_requested)
        self._last.verification_requested.connect(self._on_verification_requested)
        self._folder.change_requested.connect(self.data_folder_requested)
        workbench.folder_watch.counted.connect(self._folder.set_others)
        workbench.folder_watch.doubted.connect(self._folder.set_fault)
        workbench.library.changed.connect(self.changed)
        workbench.selection.changed.connect(self._on_selected)
        workbench.run.changed.connect(self._show_trial)

        self._retranslate()

    @override
    def title(self) -> str:
        return self.tr("Start")

    @override
    def lead(self) -> str:
        return self.tr(
            "Enter what you are calibrating. Entries are saved for this station."
        )

    @override
    def is_complete(self) -> bool:
        return not self._why_not_on()

    @override
    def main_action(self) -> MainAction:
        return MainAction(self.tr("Continue to the camera"), self._why_not_on())

    @override
    def run_main_action(self) -> None:
        self._entries.settle()
        super().run_main_action()

    @override
    def show_missing_input(self) -> None:
        missing_inputs = self._entries.typed().start_missing_inputs()
        if missing_inputs:
            self._names.focus_missing_input(missing_inputs[0])

    @override
    def entered(self) -> None:
        self._names.set_stations(self._selection.stations())
        self._tips.refresh()
        self._last.look_up()

    @override
    def left(self) -> None:
        self._entries.settle()
        self._sound_test.stop()

    @override
    def shut_down(self) -> None:
        for each in (self._unfinished, self._last, self._all_limits):
            each.shut_down()

    @override
    def _use_room(self) -> None:
        direction = QBoxLayout.Direction
        is_narrow = self._room.is_narrow
        self._columns.setDirection(
            direction.TopToBottom if is_narrow else direction.LeftToRight
        )
        # What waits for an answer comes first.
        column = self._left if is_narrow else self._right
        column.insertWidget(0, self._interrupted)
        if not self._is_known:
            self._newcomer.set_wide(is_narrow)
            column.insertWidget(1, self._newcomer)
        self._result.set_room(self._room)
        self._large.setVisible(self._room.is_vast)
        self._last.show_trend()

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
        self._show_trial()
        self._last.show_status()
        self._library.refresh()
        self.changed.emit()

    def _why_not_on(self) -> str:
        """Return what is missing, or that the tip is retired."""
        typed = self._entries.typed()
        missing_inputs, tip = (
            typed.start_missing_inputs(),
            self._library.tip(typed.names.tip),
        )
        if missing_inputs:
            return missing_input_text(missing_inputs[0])
        if tip is None or not tip.is_retired:
            return ""
        return self.tr(
            "Tip {0} is retired. Choose another tip, or reactivate it in the tip "
            "library."
        ).format(shortened(tip.id))

    def _settle(self) -> None:
        self._entries.settle()

    def _on_selected(self, before: Preparation) -> None:
        now = self._selection.preparation
        if is_trial_ready(now) and not is_trial_ready(before) and self.isVisible():
            self.step_requested.emit("swing")
        if before.names != now.names or before.origin is not now.origin:
            self._library.refresh()
        self.changed.emit()

    def _on_trial_requested(self) -> None:
        self._selection.set_preparation(trial_of(self._selection.preparation))
        self._chosen_files.use_samples()
        if not self._camera.live.is_open:
            self._camera.open()

    def _show_trial(self) -> None:
        is_on = self._run.status.state is not None
        self._newcomer.set_why_not(self.tr("A swing is in progress.") if is_on else "")

    def _on_verification_requested(self) -> None:
        self._entries.settle()
        self.step_requested.emit("verify")
