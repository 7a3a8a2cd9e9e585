"""The step LEDs: coordinates, checked against pen frame and live images."""

from typing_extensions import override

from lightpen.pen_check.draft import PenDraft, corrected, exchanged
from lightpen.pen_check.match import Finding, PenMatch
from lightpen.swing.preparation import SourceKind
from lightpen_app.face import Services, can_discover
from lightpen_app.look.layouts import horizontal_layout, vertical_layout
from lightpen_app.look.phrases import first_missing
from lightpen_app.look.theme import GRID
from lightpen_app.steps.leds.draft import LedDraft, unsaved_leds_text, why_not_next
from lightpen_app.steps.leds.file_panel import LedFileControl, LedFilePanel
from lightpen_app.steps.leds.frame_panel import FramePanel
from lightpen_app.steps.leds.match_control import LedSimulatorControls, MatchControl
from lightpen_app.steps.leds.match_panel import MatchPanel
from lightpen_app.steps.leds.table_panel import LedTablePanel
from lightpen_app.widgets.fitting import (
    PageScroll,
    ResponsiveLayout,
    ShrinkingScrollContent,
)
from lightpen_app.widgets.page import MainAction, Page
from lightpen_app.widgets.pen_view import PenPicture
from lightpen_app.widgets.tables import UndoButtons
from lightpen_app.work.workbench import Workbench

# Of table, pen in space and image
SHARES = 40, 29, 31


class LedsPage(ResponsiveLayout, Page):
    """Opens, shows, corrects and saves the LED file.

    The table shows a draft. The live match follows it at once; a swing needs a file, so
    a draft that differs from the file in use must be saved before the next step.
    """

    key = "leds"
    shows_images = True
    narrow_below = 110 * GRID  # px; then two panels are side by side, not three
    low_below = 62 * GRID  # px; then it scrolls

    def __init__(self, workbench: Workbench, services: Services = ()) -> None:
        super().__init__()
        self._selection = workbench.selection
        self._leds = LedDraft(self._selection, self)

        # Widgets
        self._file = LedFilePanel(can_discover=can_discover(services))
        self._table = LedTablePanel(UndoButtons(self._leds.edits, self))
        self._space = FramePanel()
        self._simulator = LedSimulatorControls(workbench.live)
        self._match = MatchPanel(self._simulator)

        self._pens = workbench.pens
        self._files = LedFileControl(
            self._leds, workbench.files, workbench.pens, self._file
        )
        self._matching = MatchControl(
            self._leds, self._selection, workbench.run, workbench.live, self._match
        )

        # Layout
        self._content = ShrinkingScrollContent()
        self._rows = vertical_layout(self._content, self._file, spacing=2 * GRID)
        self._panels = horizontal_layout(
            self._rows, (self._table, SHARES[0]), stretch=1, spacing=2 * GRID
        )
        self._use_room()  # before the match: the order of the Tab key
        self._panels.addWidget(self._match, SHARES[2])
        scroll = PageScroll()
        scroll.setWidget(self._content)
        vertical_layout(self, scroll)

        # Connections
        self._file.discovery_requested.connect(self.discovery_requested)
        self._file.exchange_requested.connect(self._on_exchange_requested)
        self._files.status_changed.connect(workbench.notifications.show_status)
        self._table.value_changed.connect(self._leds.edit)
        self._table.discard_requested.connect(self._files.discard)
        self._table.led_chosen.connect(self._space.view.set_chosen)
        self._space.led_chosen.connect(self._table.set_chosen)
        self._space.move_requested.connect(self._on_move_requested)
        self._match.correction_requested.connect(self._on_correction_requested)
        self._matching.watch.value_changed.connect(self._on_match_changed)
        self._leds.changed.connect(self._on_draft_changed)
        self._pens.changed.connect(self.changed)
        self._selection.changed.connect(self._on_selection_changed)
        self._selection.station_changed.connect(self._files.drop_job)

        self._files.retranslate()
        self._on_selection_changed()

    @override
    def lead(self) -> str:
        if self._selection.preparation.source.kind == SourceKind.RECORDED:
            return self.tr(
                "Open the LED file of this pen. It is compared with the recorded "
                "images."
            )
        return self.tr(
            "Open the LED file of this pen and hold the pen in view of the camera."
        )

    @override
    def is_complete(self) -> bool:
        return not self._selection.preparation.leds_missing_inputs()

    @override
    def is_doubtful(self) -> bool:
        return bool(self._pens.doubt() or self._matching.doubt())

    @override
    def why_closed(self) -> str:
        now = self._selection.preparation
        return first_missing(now.start_missing_inputs() + now.camera_missing_inputs())

    @override
    def main_action(self) -> MainAction:
        why_not = why_not_next(self._leds.state, self._selection.preparation)
        return MainAction(self.tr("Continue to the swing"), why_not)

    @override
    def run_main_action(self) -> None:
        if self.is_doubtful():
            self._file.ask(self._doubt_question, self.advance_requested.emit)
        else:
            super().run_main_action()

    @override
    def entered(self) -> None:
        self._matching.start()

    @override
    def left(self) -> None:
        self._matching.stop()
        self._simulator.rest()

    @override
    def unsaved(self) -> str:
        return unsaved_leds_text(self._leds.state)

    @override
    def shut_down(self) -> None:
        self._matching.watch.stop()

    @override
    def _retranslate(self) -> None:
        self._files.retranslate()
        self._matching.retranslate()
        self._table.set_flaw(self._leds.state.check.flaw)
        self._table.set_marked(self._match.reasons())
        self._refresh()

    @override
    def _use_room(self) -> None:
        """Put the pen in space between the others, or below them on a narrow page."""
        self._content.set_squeezed(not self._room.is_low)
        self._file.set_narrow(self._room.is_narrow)
        if self._room.is_narrow:
            self._rows.addWidget(self._space)
        else:
            self._panels.insertWidget(1, self._space, SHARES[1])

    def _on_selection_changed(self) -> None:
        self._leds.follow_selection()
        source = self._selection.preparation.source
        self._file.set_has_samples(source.kind == SourceKind.SIMULATED)
        self._refresh()

    def _on_draft_changed(self) -> None:
        state = self._leds.state
        self._table.set_value(state.draft, state.changes)
        self._table.set_flaw(state.check.flaw)
        self._refresh()
        self.changed.emit()

    def _refresh(self) -> None:
        """Show the state of the draft and the nominal tip in use."""
        pen, tip = self._leds.state.check.pen, self._selection.preparation.nominal_tip
        overriding = ""  # nominal tip in use, if not the table's
        if tip is not None and pen is not None:
            overriding = "  ".join(f"{each:g}" for each in tip.tolist())
        elif pen is not None:
            tip = pen.nominal_tip
        self._space.set_value(self._leds.state.check.frame)
        marked = frozenset(self._match.reasons())
        self._space.set_picture(PenPicture(pen, tip, marked))
        self._table.set_overriding_tip(overriding)

    def _on_move_requested(self) -> None:
        sought = self._leds.state.check.sought
        if sought is not None:
            self._leds.edit(PenDraft.of(sought))

    def _on_exchange_requested(self, pair: tuple[int, int]) -> None:
        self._table.focus_cells()
        self._leds.edit(exchanged(self._leds.state.draft, pair))

    def _on_correction_requested(self, finding: Finding) -> None:
        self._table.focus_cells()
        self._leds.edit(corrected(self._leds.state.draft, finding))

    def _doubt_question(self) -> tuple[str, str]:
        """Return the question whether to swing with LEDs that do not fit.

        The match says what does not fit.
        """
        is_doubted = bool(self._matching.doubt())
        words = self.tr("The swing will probably fail.") if is_doubted else ""
        parts = self._pens.doubt(), words
        return " ".join(filter(None, parts)), self.tr("Swing anyway")

    def _on_match_changed(self, match: PenMatch | None) -> None:
        self._match.set_value(match)
        rms = () if match is None else enumerate(match.rms.tolist(), 1)
        misfits = {led: each for led, each in rms if each == each}  # px, of LEDs seen
        self._table.set_misfits(misfits)
        self._file.refresh_question()  # the pen may only have entered the image
        self.changed.emit()
        self._table.set_marked(self._match.reasons())
        self._refresh()
