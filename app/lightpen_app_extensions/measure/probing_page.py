"""Base of the steps Verify and Measure: probing from the tip to a verdict."""

from PySide6.QtCore import QTimer
from PySide6.QtWidgets import QStackedWidget, QTabWidget, QWidget
from typing_extensions import override

from lightpen_app.look.layouts import fill, horizontal_layout, vertical_layout
from lightpen_app.look.phrases import missing_input_text
from lightpen_app.look.sounds import Sound, Sounds
from lightpen_app.look.theme import GRID, Tone
from lightpen_app.widgets.fitting import (
    NO_ROOM,
    PageScroll,
    ResponsiveLayout,
    ShrinkingScrollContent,
)
from lightpen_app.widgets.image_view import ImageView
from lightpen_app.widgets.live_markers import live_markers
from lightpen_app.widgets.page import MainAction, Page
from lightpen_app.work.live_view import DisplayedImage
from lightpen_app_extensions.measure.check_list import CheckList
from lightpen_app_extensions.measure.part_view import LOW_PICTURE_HEIGHT, FigurePanel
from lightpen_app_extensions.measure.presenter import VerifyPresenter, VerifyView
from lightpen_app_extensions.measure.progress_panel import DetailsView, ProgressPanel
from lightpen_app_extensions.measure.service import (
    MeasureService,
    ProbingSimulatorControls,
    VerificationRun,
)
from lightpen_extensions.measure.session import SessionEventKind

SHOWING_MS = 50  # from a new state to its display; states in between are skipped

SOUNDS: dict[SessionEventKind, Sound] = {
    SessionEventKind.RECORDED: Sound.KEPT,
    SessionEventKind.BROKEN_OFF: Sound.LOST,
    SessionEventKind.KNOWN: Sound.LOST,
    SessionEventKind.DONE: Sound.DONE,
    SessionEventKind.FAILED: Sound.FAILED,
}


class ProbingPage(ResponsiveLayout, Page):
    """Shows a session and leads it; nothing on it must be pressed meanwhile.

    At the left is the list of what is to be done, beside it one large figure of what is
    probed now; tables and the live image are behind tabs.
    """

    shows_images = True
    # px; then the list is behind a tab, too; then what is said twice is hidden
    narrow_below, low_below = 112 * GRID, 64 * GRID

    def __init__(
        self,
        service: MeasureService,
        sounds: Sounds,
        run: VerificationRun,
        presenter: VerifyPresenter,
    ) -> None:
        super().__init__()
        workbench = service.workbench
        self._service, self._sounds = service, sounds
        self._selection = workbench.selection
        self._run, self._live = run, workbench.live
        self._camera = workbench.camera
        self._runner = self._run.runner
        self._presenter = presenter
        self._view = VerifyView()
        self._head: tuple[object, ...] = ()  # of the page, when it was last shown
        self._room = NO_ROOM

        # Widgets
        self._progress = ProgressPanel(workbench, run)
        self._work, self._checks = QWidget(), CheckList()
        self._figure, self._details = FigurePanel(), DetailsView()
        self._image = ImageView()
        self._image.setMinimumHeight(LOW_PICTURE_HEIGHT)
        self._tabs = QTabWidget()
        for tab in (self._figure, self._details, self._image):
            self._tabs.addTab(tab, "")
        texts = self.tr("Figure"), self.tr("Details"), self.tr("Live image")
        self.say_items(self._tabs, (*texts, self.tr("List")))
        self.say(self._checks, self.tr("Checks and features"))
        self._stack = QStackedWidget()
        self._stack.addWidget(self._tabs)
        self._simulator = ProbingSimulatorControls(service)
        self._showing = QTimer(self, singleShot=True, interval=SHOWING_MS)

        # Layout
        layout, scroll = vertical_layout(self, self._progress), PageScroll()
        self._column = layout
        content = ShrinkingScrollContent()
        self._rows = vertical_layout(content)  # more of them may be added
        self._body = horizontal_layout(self._work, (self._stack, 1), spacing=2 * GRID)
        self._rows.addWidget(self._work, 1)
        scroll.setWidget(content)
        fill(layout, (scroll, 1), self._simulator)
        self._use_room()

        # Connections
        self._run.changed.connect(self._show_soon)
        self._run.progressed.connect(self._show_soon)
        self._run.happened.connect(self._on_happened)
        self._live.image_shown.connect(self._on_image_shown)
        self._live.connection_changed.connect(self._show_soon)
        self._tabs.currentChanged.connect(self._show)
        workbench.selection.changed.connect(self._on_workbench_changed)
        workbench.library.changed.connect(self.changed)
        self._showing.timeout.connect(self._show)

    @override
    def lead(self) -> str:
        return self._presenter.lead()

    @override
    def lead_tone(self) -> Tone:
        return Tone.WARN if self._presenter.tip_is_doubted() else Tone.QUIET

    @override
    def is_complete(self) -> bool:
        return self._run.status.is_done

    @override
    def is_doubtful(self) -> bool:
        return self._presenter.is_doubtful()

    @override
    def why_closed(self) -> str:
        missing_inputs = self._selection.preparation.missing_inputs()
        return missing_input_text(missing_inputs[0]) if missing_inputs else ""

    @override
    def main_action(self) -> MainAction:
        return self._presenter.action()

    @override
    def run_main_action(self) -> None:
        if self._run.status.is_done:
            step = self._presenter.next_step()
            if step:
                self.step_requested.emit(step)
            else:
                self._runner.ask(lambda workflow: workflow.start_over())
        else:
            self._runner.ask(lambda workflow: workflow.end_task())

    @override
    def is_hands_free(self) -> bool:
        return True

    @override
    def toggle_pause(self) -> None:
        self._progress.toggle_pause()

    @override
    def first_control(self) -> QWidget:
        return self._checks

    @override
    def entered(self) -> None:
        if not self._live.is_open:
            self._camera.open()
        self._runner.ask(lambda workflow: workflow.note_arrival())
        self._show()

    @override
    def left(self) -> None:
        self._progress.hide_question()
        self._simulator.stop()
        self._runner.ask(lambda workflow: workflow.note_departure())

    @override
    def unsaved(self) -> str:
        state = self._runner.status.state
        if state is None or not (state.touches or state.runs):
            return ""
        return self.tr(
            "The work is not finished. The points of the current task are lost; "
            "results are kept."
        )

    @override
    def shut_down(self) -> None:
        self._showing.stop()

    @override
    def _refresh(self) -> None:
        self._image.set_message(self.tr("No image yet"))
        self._show()

    @override
    def _use_room(self) -> None:
        """Place the list beside or behind the figure."""
        is_narrow, is_low = self._room.is_narrow, self._room.is_low
        self._column.setSpacing(0 if is_low else GRID)
        self._progress.set_low(low=is_low)
        self._figure.set_low(low=is_low)
        self._checks.set_wide(is_narrow)
        if is_narrow:
            self._tabs.addTab(self._checks, self.tr("List"))
        else:
            self._tabs.removeTab(self._tabs.indexOf(self._checks))
            self._body.insertWidget(0, self._checks)
            self._checks.show()

    def _show_soon(self) -> None:
        if not self._showing.isActive():
            self._showing.start()

    def _show(self) -> None:
        self._view = view = self._presenter.view()
        status = self._run.status
        self._progress.set_value(view)
        self._simulator.set_inviting(not status.is_done)
        self._checks.set_rows(view.rows)
        self._checks.show_row(self._shown_row())
        self._show_row(self._shown_row())
        if self._details.isVisible():
            self._details.set_value(status.setup, status.state)
        if self.isVisible():
            self.operator_value_changed.emit(view.operator)
        head = self.lead(), self.lead_tone(), self.main_action(), self.is_complete()
        if head != self._head:
            self._head = head
            self.changed.emit()

    def _shown_row(self) -> int:
        """Return the row whose figure is shown; by default what is probed now."""
        return self._view.current

    def _show_row(self, row: int) -> None:
        """Show the figure of a row."""
        if self._figure.isVisible():
            self._figure.set_value(self._presenter.figure(row))

    def _on_workbench_changed(self) -> None:
        self._show_soon()
        self.changed.emit()

    def _on_happened(self, what: SessionEventKind) -> None:
        fraction = self._presenter.operator_value().fraction
        self._sounds.play(SOUNDS[what], fraction or 0.0)

    def _on_image_shown(self, shown: DisplayedImage) -> None:
        if self._image.isVisible():
            self._image.set_half(shown.half, shown.size, live_markers(shown.seen))
