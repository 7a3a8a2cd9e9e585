"""View of a swing: instruction, dial, count, state, image and plots."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QProgressBar, QSizePolicy, QTabBar, QWidget
from typing_extensions import override

from lightpen.arrays import FloatArray
from lightpen.swing.capture.kept_images import AcceptedImages, tip_offsets
from lightpen.swing.capture.state import SwingState
from lightpen_app.look.layouts import grid_layout, horizontal_layout, vertical_layout
from lightpen_app.look.theme import GRID, TextSize, Tone, text_label
from lightpen_app.look.words import AXES, MICROMETRES
from lightpen_app.steps.swing.page_state import SwingPageState, side_text
from lightpen_app.widgets.controls import LazyWidget, PushButton
from lightpen_app.widgets.fields import Translated
from lightpen_app.widgets.figure import Axes
from lightpen_app.widgets.fitting import (
    NO_ROOM,
    FittedText,
    PageScroll,
    ResponsiveLayout,
    ShrinkingScrollContent,
)
from lightpen_app.widgets.image_view import ImageView
from lightpen_app.widgets.live_markers import live_markers
from lightpen_app.widgets.operator_view import OperatorValue
from lightpen_app.widgets.plots import TracePlot
from lightpen_app.widgets.posture_dial import PostureDial
from lightpen_app.widgets.state_banner import SignLabel, StateBanner
from lightpen_app.work.live_view import DisplayedImage

DIAL_SHARE, SMALL_DIAL_SHARE, SIDE_SHARE = 2, 3, 3  # of the width
SIDE_SHARES = (9, 7)  # of it: numbers, live image
ROW_SHARES = (1, 2)  # of the height: these, plots
LEAST_IMAGE = 14 * GRID  # px of width
PROGRESS_STEPS = 1000
PLOTS_HEIGHT = 32 * GRID  # px, there
ANY_HEIGHT = 16777215  # QWIDGETSIZE_MAX


class SwingView(ResponsiveLayout, Translated, QWidget):
    """Shows a snapshot of a swing."""

    narrow_below, low_below = 100 * GRID, 56 * GRID  # px; then its plots are below

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
        self.dial = PostureDial()
        self.dial.setFocusPolicy(Qt.FocusPolicy.StrongFocus)  # no button has it then
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
        self._image = ImageView()
        self._image.setMinimumWidth(LEAST_IMAGE)
        self._plots = LazyWidget(SwingPlots)

        # Layout
        self._content = ShrinkingScrollContent()
        self._body = grid_layout(self._content, spacing=(3 * GRID, GRID))
        self._body.addWidget(self.dial, 0, 0)
        self._side = grid_layout(self._body, at=(0, 1), spacing=2 * GRID)
        numbers = (self._count, self._progress, self._note, 1)
        self._numbers = vertical_layout(self._side, *numbers, at=(0, 0))
        self._body.setRowStretch(0, 1)
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
        self._refresh()

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

    def _refresh(self) -> None:
        self._image.set_message(self.tr("No image yet"))

    @property
    def _is_small(self) -> bool:
        return self._room.is_narrow or self._room.is_low

    @override
    def _use_room(self) -> None:
        """Place the plots beside the dial, or below it in a small window."""
        is_small = self._is_small
        if is_small:
            self._side.addWidget(self._banner, 1, 0, 1, 2)
            self._body.addWidget(self._plots, 1, 0, 1, 2)
            self._body.addWidget(self._image, 2, 0, 1, 2)
        else:
            self._numbers.addWidget(self._banner)
            self._side.addWidget(self._plots, 1, 0, 1, 2)
            self._side.addWidget(self._image, 0, 1)
        share = SMALL_DIAL_SHARE if is_small else DIAL_SHARE
        self._body.setColumnStretch(0, share)
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
        self._instruction.setMinimumHeight((5 if is_small else 7) * GRID)
        self._count.set_largest(TextSize.TITLE if is_small else TextSize.DISPLAY)

    def _share_room(self) -> None:
        """Divide the space beside the dial among numbers, image and plots."""
        columns, rows = SIDE_SHARES, ROW_SHARES
        if self._is_small:
            columns, rows = (1, 0), (1, 0)
        for column, share in enumerate(columns):
            self._side.setColumnStretch(column, share)
        for row, share in enumerate(rows):
            self._side.setRowStretch(row, share)

    def _hold_first_row(self, height: int) -> None:
        """Keep the dial and its neighbours fully visible above the plots."""
        self._body.setRowMinimumHeight(0, height if self._is_small else 0)


LEAST_HEIGHT = 15 * GRID
CAMERA_AXES = ("u", "v", "w")
N_SHOWN = 2  # plots at a time


@dataclass
class _Trace:
    """A plot, how it shows a swing, and the swing that it shows."""

    plot: TracePlot
    show: Callable[[SwingState], None]
    shown: SwingState | None = None


class SwingPlots(Translated, QWidget):
    """Residuals and U, or in their place the tip of each image and its estimate."""

    def __init__(self) -> None:
        super().__init__()
        self._limit: float | None = None  # of U, µm
        self._turn = 0

        # Widgets
        self._choice = QTabBar(documentMode=True, drawBase=False)
        self._choice.setFocusPolicy(Qt.FocusPolicy.TabFocus)  # Space is the swing's
        self.say_items(self._choice, (self.tr("Residuals and U"), self.tr("Tip")))
        image = self.tr("image")
        axes = Axes(self.tr("Residual of each image"), image, "RMS / px")
        misfit = self.say(
            TracePlot(axes, y_zero=True),
            tip=self.tr(
                "How far the LEDs of an image are from where the fit expects them. "
                "This fit takes the LEDs as in their file; that of the review may "
                "correct them, and leave smaller residuals."
            ),
        )
        axes = Axes(self.tr("Uncertainty of the tip"), image, self.tr("U (k = 2) / µm"))
        uncertainty = self.say(
            TracePlot(axes, ("U", ""), y_log=True),
            tip=self.tr(
                "U of the tip in its weakest direction. The swing ends below the limit "
                "(horizontal line). Dashed: what more images cannot improve."
            ),
        )
        axes = Axes(self.tr("Tip of each image"), image, "µm")
        scatter = self.say(
            TracePlot(axes, CAMERA_AXES, is_robust=True),
            tip=self.tr(
                "The tip by each image alone, from the cone: u to the right, v down, w "
                "away from the camera. A step means that the tip has slipped."
            ),
        )
        axes = Axes(self.tr("Estimate of the tip"), image, "µm")
        estimate = self.say(
            TracePlot(axes, AXES, is_robust=True),
            tip=self.tr(
                "The tip by all images so far, from its newest value. First estimates "
                "that are far off are cut off."
            ),
        )
        self._traces = (
            _Trace(misfit, self._show_misfit),
            _Trace(uncertainty, self._show_uncertainty),
            _Trace(scatter, self._show_scatter),
            _Trace(estimate, self._show_estimate),
        )

        # Layout
        layout = vertical_layout(self, self._choice, spacing=0)
        row = horizontal_layout(layout, *((plot, 1) for plot in self.plots()))
        layout.setStretchFactor(row, 1)
        for plot in self.plots():
            plot.setMinimumHeight(LEAST_HEIGHT)

        # Connections
        self._choice.currentChanged.connect(self._on_choice_changed)

        self._on_choice_changed()
        self._refresh()

    def plots(self) -> tuple[TracePlot, ...]:
        """Return the plots: misfit, uncertainty, scatter and estimate."""
        return tuple(trace.plot for trace in self._traces)

    def show_next(self, state: SwingState, max_uncertainty: float) -> None:
        """Update one of the plots in sight, in turn; the limit of U is in mm.

        One at a time, so that the window is never held up by all of them.
        """
        if self._limit != MICROMETRES * max_uncertainty:
            self._limit = MICROMETRES * max_uncertainty
            self._refresh()
        self._turn = (self._turn + 1) % N_SHOWN
        trace = self._traces[N_SHOWN * self._choice.currentIndex() + self._turn]
        if trace.shown is not state:
            trace.shown = state
            trace.show(state)

    def _on_choice_changed(self) -> None:
        for i, plot in enumerate(self.plots()):
            plot.setVisible(i // N_SHOWN == self._choice.currentIndex())

    def _show_misfit(self, state: SwingState) -> None:
        self._traces[0].plot.set_data(_numbers(state.kept), state.kept.misfits)

    def _show_uncertainty(self, state: SwingState) -> None:
        trace = state.trace
        finite = np.where(np.isfinite(trace.uncertainties), trace.uncertainties, np.nan)
        floors = np.where(np.isfinite(finite), trace.floors, np.nan)
        n_images = trace.n_images.astype(np.float64)
        values = MICROMETRES * finite, MICROMETRES * floors
        self._traces[1].plot.set_data(n_images, *values)

    def _show_scatter(self, state: SwingState) -> None:
        kept = state.kept
        offsets: FloatArray = np.zeros((len(kept), 3))
        if kept.seat is not None:
            offsets = tip_offsets(kept.seat, kept.rotations, kept.translations)
        self._traces[2].plot.set_data(_numbers(kept), *(MICROMETRES * offsets.T))

    def _show_estimate(self, state: SwingState) -> None:
        trace = state.trace
        changes = MICROMETRES * (trace.tips - trace.tips[-1:])
        self._traces[3].plot.set_data(trace.n_images.astype(np.float64), *changes.T)

    def _refresh(self) -> None:
        words = "" if self._limit is None else f"{self._limit:g}"
        limit = self.tr("limit {0} \u00b5m").format(words)
        plot = self._traces[1].plot
        plot.set_limit(self._limit, limit)
        plot.set_names("U", self.tr("achievable"))


def _numbers(kept: AcceptedImages) -> FloatArray:
    """Return the numbers (N,) of accepted images."""
    return kept.numbers.astype(np.float64)
