"""The step LEDs: coordinates, checked against pen frame and live images."""

from PySide6.QtWidgets import QGroupBox
from typing_extensions import override

from lightpen.model.pen import Pen
from lightpen.pen_check.frame import exchanged, leds_to_exchange
from lightpen.pen_check.match import PenMatch
from lightpen.swing.preparation import SourceKind
from lightpen_app.face import Services
from lightpen_app.look.languages import worded
from lightpen_app.look.layouts import horizontal_layout, vertical_layout
from lightpen_app.look.phrases import first_missing
from lightpen_app.look.signs import Sign
from lightpen_app.look.theme import GRID, Tone
from lightpen_app.look.words import set_tooltip
from lightpen_app.steps.leds.file_panel import LedFilePanel
from lightpen_app.steps.leds.match_panel import MatchPanel
from lightpen_app.steps.leds.table_panel import LedTablePanel
from lightpen_app.widgets.controls import PushButton
from lightpen_app.widgets.fields import Translated
from lightpen_app.widgets.fitting import (
    PageScroll,
    ResponsiveLayout,
    ShrinkingScrollContent,
)
from lightpen_app.widgets.page import MainAction, Page
from lightpen_app.widgets.pen_view import PenPicture, PenView
from lightpen_app.widgets.state_banner import SignLabel, StatusMessage
from lightpen_app.work.workbench import Workbench

# Of table, pen in space and image
SHARES = 40, 29, 31


class FramePanel(Translated, QGroupBox):
    """Draws a pen, and says whether it is in the pen frame."""

    def __init__(self) -> None:
        super().__init__()
        self.say(self, self.tr("Pen and pen frame"))
        self.view = PenView()
        self.frame = SignLabel()
        self.correct = PushButton()
        vertical_layout(self, (self.view, 1), self.frame, self.correct)


class LedsPage(ResponsiveLayout, Page):
    """Opens, shows and checks the LED file.

    Corrections are saved as a file that is then in use: a swing needs a file.
    """

    key = "leds"
    shows_images = True
    narrow_below = 110 * GRID  # px; then two panels are side by side, not three
    low_below = 62 * GRID  # px; then it scrolls

    def __init__(self, workbench: Workbench, services: Services = ()) -> None:
        super().__init__()
        self._selection = workbench.selection
        self._correction: Pen | None = None  # that the pen frame needs
        self._shown_match: PenMatch | None = None

        # Widgets
        self._file = LedFilePanel(
            workbench, can_discover=any(each.discovers for each in services)
        )
        self._leds = LedTablePanel()
        self._space = FramePanel()
        self._match = MatchPanel(workbench, self._file)

        self._pens = workbench.pens

        # Layout
        self._content = ShrinkingScrollContent()
        self._rows = vertical_layout(self._content, self._file, spacing=2 * GRID)
        self._panels = horizontal_layout(
            self._rows, (self._leds, SHARES[0]), stretch=1, spacing=2 * GRID
        )
        self._use_room()  # before the match: the order of the Tab key
        self._panels.addWidget(self._match, SHARES[2])
        scroll = PageScroll()
        scroll.setWidget(self._content)
        vertical_layout(self, scroll)

        # Connections
        self._file.discovery_requested.connect(self.discovery_requested)
        self._file.changed.connect(self._on_file_changed)
        self._leds.table.led_chosen.connect(self._space.view.set_chosen)
        self._space.view.led_chosen.connect(self._leds.table.set_chosen)
        self._space.correct.clicked.connect(self._on_correct_clicked)
        self._match.watch.value_changed.connect(self._on_match_changed)
        self._pens.changed.connect(self.changed)
        self._selection.changed.connect(self._show_pen)

        self._on_file_changed()

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
        return bool(self._pens.doubt() or self._match.doubt())

    @override
    def why_closed(self) -> str:
        now = self._selection.preparation
        return first_missing(now.start_missing_inputs() + now.camera_missing_inputs())

    @override
    def main_action(self) -> MainAction:
        missing = self._selection.preparation.leds_missing_inputs()
        return MainAction(self.tr("Continue to the swing"), first_missing(missing))

    @override
    def run_main_action(self) -> None:
        if self.is_doubtful():
            self._file.ask(self._doubt_question, self.advance_requested.emit)
        else:
            super().run_main_action()

    @override
    def entered(self) -> None:
        self._match.start()
        self._file.reread()

    @override
    def left(self) -> None:
        self._match.stop()

    @override
    def shut_down(self) -> None:
        self._match.watch.stop()

    @override
    def _refresh(self) -> None:
        self._on_file_changed()

    @override
    def _use_room(self) -> None:
        """Put the pen in space between the others, or below them on a narrow page."""
        self._content.set_squeezed(not self._room.is_low)
        self._file.set_narrow(self._room.is_narrow)
        if self._room.is_narrow:
            self._rows.addWidget(self._space)
        else:
            self._panels.insertWidget(1, self._space, SHARES[1])

    def _on_file_changed(self) -> None:
        """Show the LEDs of the open file, and the correction that its frame needs."""
        opened, note, verb = self._file.opened, StatusMessage(), ""
        self._correction = remark = None
        if opened is not None and opened.pen is not None:
            frame, pair = opened.frame, leds_to_exchange(opened.frame)
            remark = frame.remark
            if pair is not None:
                self._correction = exchanged(opened.pen, pair)
                verb = self.tr("Swap {0} and {1}").format(*pair)
            elif frame.can_be_moved:
                self._correction = opened.sought
                verb = self.tr("Transform to pen frame")
            if remark is not None:
                words = self.tr(
                    "Other layout than the ten-LED pen; the frame of the file is used "
                    "as is."
                )
                note = StatusMessage(words, Sign.WARNING, Tone.QUIET)
            elif frame.error is None:
                note = StatusMessage.good(self.tr("The LEDs are in the pen frame."))
        self._space.frame.set_value(note)
        set_tooltip(self._space.frame, "" if remark is None else worded(remark))
        self._space.correct.setText(verb)
        self._space.correct.setVisible(bool(verb))
        self._show_pen()
        self.changed.emit()

    def _show_pen(self) -> None:
        """Show the pen of the open file and the nominal tip in use."""
        opened, tip = self._file.opened, self._selection.preparation.nominal_tip
        pen = None if opened is None else opened.pen
        self._leds.set_value(pen, tip)
        self._show_match()
        if tip is None and pen is not None:
            tip = pen.nominal_tip
        marked = frozenset(self._match.reasons())
        self._space.view.set_value(PenPicture(pen, tip, marked))

    def _show_match(self) -> None:
        match = self._shown_match
        rms = () if match is None else enumerate(match.rms.tolist(), 1)
        misfits = {led: each for led, each in rms if each == each}  # px, of LEDs seen
        self._leds.table.set_match(misfits, self._match.reasons())

    def _on_correct_clicked(self) -> None:
        if self._correction is not None:
            self._file.ask_place(self._correction)

    def _doubt_question(self) -> tuple[str, str]:
        """Return the question whether to swing with LEDs that do not fit.

        The match says what does not fit.
        """
        is_doubted = bool(self._match.doubt())
        words = self.tr("The swing will probably fail.") if is_doubted else ""
        parts = self._pens.doubt(), words
        return " ".join(filter(None, parts)), self.tr("Swing anyway")

    def _on_match_changed(self, match: PenMatch | None) -> None:
        self._shown_match = match
        self._match.set_value(match)
        self._file.question.refresh()  # the pen may only have entered the image
        self._show_pen()
        self.changed.emit()
