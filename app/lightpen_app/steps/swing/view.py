"""View of a swing: instruction, dial, count, state, image and plots."""

from dataclasses import replace
from typing import TYPE_CHECKING

from PySide6.QtCore import QSize
from PySide6.QtWidgets import QProgressBar, QSizePolicy, QWidget
from typing_extensions import override

from lightpen_app.look.layouts import grid_layout, horizontal_layout, vertical_layout
from lightpen_app.look.theme import GRID, TextSize, Tone, text_label
from lightpen_app.steps.swing.leaning_dial import LeaningDial
from lightpen_app.steps.swing.page_state import SwingPageState, side_text
from lightpen_app.widgets.fitted_text import FittedText
from lightpen_app.widgets.image_view import ImageView
from lightpen_app.widgets.lazy import LazyWidget
from lightpen_app.widgets.live_markers import live_markers
from lightpen_app.widgets.operator_view import OperatorValue
from lightpen_app.widgets.page_scroll import PageScroll, ShrinkingScrollContent
from lightpen_app.widgets.pen_in_space import PenInSpace
from lightpen_app.widgets.push_button import PushButton
from lightpen_app.widgets.responsive_layout import NO_ROOM, ResponsiveLayout
from lightpen_app.widgets.sign_label import SignLabel
from lightpen_app.widgets.state_banner import StateBanner
from lightpen_app.widgets.translated import Translated
from lightpen_app.work.live_images import DisplayedImage

if TYPE_CHECKING:
    from lightpen_app.steps.swing.plots_panel import SwingPlots

DIAL_SHARE, SIDE_SHARE = 2, 3  # of the width
SIDE_SHARES = (9, 4, 6)  # of it: numbers, pen in space, live image
ROW_SHARES = (1, 2)  # of the height: these, plots
LARGE_SIDE_SHARES, LARGE_ROW_SHARES = (9, 5, 7), (2, 3)  # where there is plenty
VERY_LARGE_SIDE_SHARES, VERY_LARGE_ROW_SHARES = (
    (5, 0, 6),
    (1, 1),
)  # and where there is more
PEN_PLACE = 3  # below the count, its bar and its note
LEAST_IMAGE = 14 * GRID  # px of width
PROGRESS_STEPS = 1000
PLOTS_HEIGHT = 32 * GRID  # px, there
ANY_HEIGHT = 16777215  # QWIDGETSIZE_MAX


class SwingView(ResponsiveLayout, Translated, QWidget):
    """Shows a snapshot of a swing."""

    narrow_below, low_below = 100 * GRID, 56 * GRID  # px; then its plots are below
    large_from = QSize(150 * GRID, 80 * GRID)  # px; then image and letters are larger
    very_large_from = QSize(240 * GRID, 130 * GRID)  # px; then they are larger still

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._room = NO_ROOM  # so that its least size at first widens no window

        # Widgets
        self.side = PushButton()
        self.start_over = self.make_button(
            self.tr("Start over"),
            tip=self.tr(
                "Abandon this swing and start again. Its images remain on the disk."
            ),
        )
        # For an operator who stands elsewhere than the arrow assumes.
        self.swapped = self.make_button(
            self.tr("Left and right are swapped"),
            tip=self.tr("Learn again on which side you stand."),
        )
        self._instruction = FittedText(TextSize.HUGE)
        self._hint = FittedText(TextSize.LEAD, least=TextSize.BODY)
        self._warning = SignLabel()
        self._verdict = StateBanner(TextSize.DISPLAY)
        self._verdict.setMinimumHeight(10 * GRID)
        self.dial = LeaningDial()
        # As high as its place is; it draws itself as large as it can.
        self.dial.setSizePolicy(
            QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Ignored
        )
        self._count = FittedText(TextSize.DISPLAY, wraps=False)
        self._note = text_label(TextSize.SMALL, Tone.QUIET)
        self._progress = self.say(
            QProgressBar(maximum=PROGRESS_STEPS, textVisible=False), self.tr("Progress")
        )
        self._banner = StateBanner(TextSize.TITLE)
        self._pen = PenInSpace()
        self._image = ImageView()
        self._image.setMinimumWidth(LEAST_IMAGE)
        self._plots = LazyWidget(_make_plots)

        # Layout
        self._content = ShrinkingScrollContent()
        self._body = grid_layout(self._content, spacing=(3 * GRID, GRID))
        self._body.addWidget(self.dial, 0, 0)
        self._side = grid_layout(self._body, at=(0, 1), spacing=2 * GRID)
        numbers = (self._count, self._progress, self._note, 1)
        self._numbers = vertical_layout(self._side, *numbers, at=(0, 0))
        self._body.setRowStretch(0, 1)
        self._body.setColumnStretch(0, DIAL_SHARE)
        self._body.setColumnStretch(1, SIDE_SHARE)
        self._scroll = PageScroll()
        self._scroll.setWidget(self._content)
        layout = grid_layout(self)
        layout.addWidget(self._warning, 2, 0)
        layout.addWidget(self._verdict, 3, 0)
        layout.addWidget(self._scroll, 4, 0)
        # The last in the order of the Tab key: Enter must press a button of these only
        # if it is selected.
        head = ((self._instruction, 1), self.side, self.start_over)
        horizontal_layout(layout, *head, at=(0, 0))
        horizontal_layout(layout, (self._hint, 1), self.swapped, at=(1, 0))
        layout.setRowMinimumHeight(1, 5 * GRID)  # with its button and without
        layout.setRowStretch(0, 1)
        layout.setRowStretch(4, 10)

        # Connections
        self._scroll.height_changed.connect(self._hold_first_row)

        self._verdict.hide()
        self._use_room()
        self._retranslate()

    def set_value(
        self, value: OperatorValue, note: str = "", *, is_verdict: bool = False
    ) -> None:
        """Show something else; a verdict has the whole width."""
        self._instruction.set_text(value.instruction)
        self._hint.set_text(value.hint, bold=False)
        self._verdict.set_value(value.state)
        self._banner.set_value(value.state)
        self._banner.setVisible(not is_verdict)
        self._verdict.setVisible(is_verdict)
        self._count.set_text(value.count)
        self._note.setText(note)
        self._progress.setVisible(value.fraction is not None)
        self._progress.setValue(round(PROGRESS_STEPS * (value.fraction or 0.0)))
        if value.dial is not None:
            self.dial.set_value(value.dial)

    def set_state(self, state: SwingPageState) -> None:
        """Show a snapshot of a swing."""
        self.set_value(state.value, state.note, is_verdict=state.is_verdict)
        self._warning.set_value(state.warning)
        self._pen.set_value(state.pen_posture)
        self.side.setText(side_text(state.side))
        self.side.set_why_not(state.why_not_side)
        self.swapped.setVisible(state.knows_side)

    def set_image(self, shown: DisplayedImage) -> None:
        """Show a live image with rings about the spots."""
        rings = (replace(ring, label="") for ring in live_markers(shown.seen))
        self._image.set_half(shown.half, shown.size, tuple(rings))

    def plots(self) -> "SwingPlots":
        """Return the plots."""
        return self._plots.content()

    def _retranslate(self) -> None:
        self._image.set_message(self.tr("No image yet"))

    @property
    def _is_small(self) -> bool:
        return self._room.is_narrow or self._room.is_low

    @override
    def _use_room(self) -> None:
        """Place the plots beside the dial, or below it in a small window."""
        is_small = self._is_small
        if is_small:
            self._side.addWidget(self._banner, 1, 0, 1, 3)
            self._body.addWidget(self._plots, 1, 0, 1, 2)
            self._body.addWidget(self._image, 2, 0, 1, 2)
        else:
            self._numbers.addWidget(self._banner)
            self._side.addWidget(self._plots, 1, 0, 1, 3)
            self._side.addWidget(self._image, 0, 2)
        if self._room.is_very_large:
            self._numbers.insertWidget(PEN_PLACE, self._pen, 100)
        else:
            self._side.addWidget(self._pen, 0, 1)
        self._share_room()
        self._side.setVerticalSpacing(GRID if is_small else 2 * GRID)
        self._hold_first_row(self._scroll.viewport().height())
        policy = QSizePolicy.Policy
        # Beside the numbers it is as high as they are; the plots have the rest.
        down = policy.Preferred if is_small else policy.Ignored
        self._image.setSizePolicy(policy.Expanding, down)
        for each in (self._plots, self._image):
            each.setMinimumHeight(PLOTS_HEIGHT if is_small else 0)
            each.setMaximumHeight(PLOTS_HEIGHT if is_small else ANY_HEIGHT)
        self._content.set_squeezed(not is_small)
        is_large = self._room.is_large
        self._instruction.setMinimumHeight(
            (5 if is_small else 9 if is_large else 7) * GRID
        )
        usual = TextSize.TITLE if is_small else TextSize.DISPLAY
        self._count.set_largest(TextSize.HUGE if is_large else usual)

    def _share_room(self) -> None:
        """Divide the space beside the dial among numbers, pen, image and plots."""
        columns, rows = SIDE_SHARES, ROW_SHARES
        if self._is_small:
            columns, rows = (*columns[:2], 0), (1, 0)
        elif self._room.is_very_large:
            columns, rows = VERY_LARGE_SIDE_SHARES, VERY_LARGE_ROW_SHARES
        elif self._room.is_large:
            columns, rows = LARGE_SIDE_SHARES, LARGE_ROW_SHARES
        for column, share in enumerate(columns):
            self._side.setColumnStretch(column, share)
        for row, share in enumerate(rows):
            self._side.setRowStretch(row, share)

    def _hold_first_row(self, height: int) -> None:
        """Keep the dial and its neighbours fully visible above the plots."""
        self._body.setRowMinimumHeight(0, height if self._is_small else 0)


def _make_plots() -> "SwingPlots":
    # Imported here: plots take a fifth of the start time, and the first window has
    # none.
    from lightpen_app.steps.swing.plots_panel import SwingPlots

    return SwingPlots()
