"""Base of the steps Verify and Measure: probing from the tip to a verdict."""

from functools import partial

from PySide6.QtCore import QTimer
from PySide6.QtWidgets import QWidget
from typing_extensions import override

from lightpen.verification.session.status import SessionEventKind
from lightpen.verification.tasks.registry import AnyTask
from lightpen_app.look.layouts import fill, horizontal_layout, vertical_layout
from lightpen_app.look.phrases import missing_input_text
from lightpen_app.look.sounds import Sound, Sounds
from lightpen_app.look.theme import GRID, Tone
from lightpen_app.steps.page import MainAction, Page
from lightpen_app.steps.verify.listed_pages import ListedPages
from lightpen_app.steps.verify.presenter import VerifyPresenter
from lightpen_app.steps.verify.progress_panel import ProgressPanel
from lightpen_app.steps.verify.simulator_controls import ProbingSimulatorControls
from lightpen_app.steps.verify.task_panel import TaskPanel
from lightpen_app.steps.verify.view_state import VerifyView
from lightpen_app.widgets.image_view import ImageView
from lightpen_app.widgets.lazy import LazyWidget
from lightpen_app.widgets.live_markers import live_markers
from lightpen_app.widgets.page_scroll import PageScroll, ShrinkingScrollContent
from lightpen_app.widgets.responsive_layout import NO_ROOM, ResponsiveLayout
from lightpen_app.work.live_images import DisplayedImage
from lightpen_app.work.verification_run import VerificationRun
from lightpen_app.work.workbench import Workbench

SHOWING_MS = 50  # from a new state to its display; states in between are skipped
IMAGE_WIDTH = 56 * GRID  # px, at least

SOUNDS: dict[SessionEventKind, Sound] = {
    SessionEventKind.RECORDED: Sound.KEPT,
    SessionEventKind.BROKEN_OFF: Sound.LOST,
    SessionEventKind.KNOWN: Sound.LOST,
    SessionEventKind.DONE: Sound.DONE,
    SessionEventKind.FAILED: Sound.FAILED,
}


class ProbingPage(ResponsiveLayout, Page):
    """Shows a session and leads it; nothing on it must be pressed meanwhile."""

    shows_images = True
    narrow_below = 150 * GRID  # px; then the live image is a page of the list

    def __init__(
        self,
        workbench: Workbench,
        sounds: Sounds,
        run: VerificationRun,
        presenter: VerifyPresenter,
    ) -> None:
        super().__init__()
        self._workbench, self._sounds = workbench, sounds
        self._selection = workbench.selection
        self._run, self._live = run, workbench.live
        self._camera = workbench.camera
        self._runner = self._run.runner
        self._presenter = presenter
        self._view = VerifyView()
        self._room = NO_ROOM

        # Widgets
        self._progress = ProgressPanel(workbench, run)
        self._panels = {  # made when first shown: halves the start of the page
            task: LazyWidget(partial(self._make_panel, task))
            for task in presenter.tasks
        }
        self._pages = ListedPages()
        for panel in self._panels.values():
            self._pages.add(panel)
        self._image = ImageView()
        self._simulator = ProbingSimulatorControls(self._live)
        self._showing = QTimer(self, singleShot=True, interval=SHOWING_MS)

        # Layout
        layout = vertical_layout(self, self._progress)
        scroll = PageScroll()
        scrolled = ShrinkingScrollContent()
        self._scrolled = vertical_layout(scrolled, (self._pages, 1))
        scroll.setWidget(scrolled)
        self._body = horizontal_layout(layout, (scroll, 3), spacing=2 * GRID, stretch=1)
        fill(layout, self._simulator)
        self._use_room()

        # Connections
        self._run.changed.connect(self._show_soon)
        self._run.progressed.connect(self._show_soon)
        self._run.happened.connect(self._on_happened)
        self._live.image_shown.connect(self._on_image_shown)
        self._live.connection_changed.connect(self._show_soon)
        workbench.selection.changed.connect(self._on_workbench_changed)
        workbench.library.changed.connect(self.changed)
        self._showing.timeout.connect(self._show)

    @override
    def lead(self) -> str:
        return self._presenter.headline().lead

    @override
    def lead_tone(self) -> Tone:
        return self._presenter.headline().tone

    @override
    def is_complete(self) -> bool:
        return self._presenter.headline().is_complete

    @override
    def is_doubtful(self) -> bool:
        return self._presenter.headline().is_doubtful

    @override
    def why_closed(self) -> str:
        missing_inputs = self._selection.preparation.missing_inputs()
        return missing_input_text(missing_inputs[0]) if missing_inputs else ""

    @override
    def main_action(self) -> MainAction:
        return self._presenter.headline().action

    @override
    def run_main_action(self) -> None:
        if self._run.status.is_done:
            self.step_requested.emit(self._presenter.next_step())
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
        return self._pages

    @override
    def entered(self) -> None:
        if not self._live.is_open:
            self._camera.open()
        self._runner.ask(lambda workflow: workflow.come())
        self._show()

    @override
    def left(self) -> None:
        self._progress.hide_question()
        self._simulator.stop()
        self._runner.ask(lambda workflow: workflow.leave())

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
    def _retranslate(self) -> None:
        self._image.set_message(self.tr("No image yet"))
        self._pages.set_list_name(self.tr("Tasks"))
        if self._room.is_narrow:
            self._pages.set_title(self._image, self.tr("Live image"))
        self._show()

    @override
    def _use_room(self) -> None:
        """Place the live image beside or among the tasks."""
        if self._room.is_narrow:
            self._image.setMinimumWidth(0)
            self._pages.add(self._image)
            self._pages.set_title(self._image, self.tr("Live image"))
        else:
            self._pages.remove(self._image)
            self._image.setMinimumWidth(IMAGE_WIDTH)
            self._body.addWidget(self._image, 2)
            self._image.show()  # a page that is not the current one is hidden

    def _show_soon(self) -> None:
        if not self._showing.isActive():
            self._showing.start()

    def _show(self) -> None:
        before, self._view = self._view, self._presenter.view()
        view, status = self._view, self._run.status
        self._progress.set_value(view)
        for (task, place), title in zip(self._panels.items(), view.titles, strict=True):
            panel = place.content_so_far()
            if panel is not None:
                panel.set_status(status)
            self._pages.set_title(place, title.text, title.sign, title.tone)
            if task is view.task and view.task is not before.task:
                self._pages.show_page(place)
        if self.isVisible():
            self.operator_value_changed.emit(view.operator)
        if view.headline != before.headline:
            self.changed.emit()

    def _make_panel(self, task: AnyTask) -> TaskPanel:
        panel = TaskPanel(task, self._runner)
        panel.set_choices(self._selection.choices)
        panel.set_status(self._run.status)
        panel.value_changed.connect(self._selection.set_choices)
        return panel

    def _on_workbench_changed(self) -> None:
        for place in self._panels.values():
            panel = place.content_so_far()
            if panel is not None:
                panel.set_choices(self._selection.choices)
        self._show_soon()
        self.changed.emit()

    def _on_happened(self, what: SessionEventKind) -> None:
        fraction = self._presenter.operator_value().fraction
        self._sounds.play(SOUNDS[what], fraction or 0.0)

    def _on_image_shown(self, shown: DisplayedImage) -> None:
        if self._image.isVisible():
            self._image.set_half(shown.half, shown.size, live_markers(shown.seen))
