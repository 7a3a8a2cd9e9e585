"""The plots of a review: residuals, uncertainty, postures, and the paper's method."""

from collections.abc import Sequence

import numpy as np
from PySide6.QtCore import Signal
from PySide6.QtWidgets import QCheckBox, QFrame, QWidget
from typing_extensions import override

from lightpen.arrays import BoolArray, FloatArray
from lightpen.estimation.bundle.image_fields import FieldName
from lightpen.estimation.reports.report_warnings import (
    reported,
    result_of,
    two_stage_difference,
)
from lightpen.model.camera import Camera
from lightpen.model.rigid import Rig
from lightpen.record.swings.solving import Solution
from lightpen.swing.status import FailedSwing
from lightpen_app.face import Services
from lightpen_app.look.figures import budget_figure
from lightpen_app.look.layouts import (
    fill,
    grid_layout,
    horizontal_layout,
    vertical_layout,
)
from lightpen_app.look.theme import GRID, TextSize, Tone, text_label
from lightpen_app.look.words import AXES, PARTED, mm_text, set_tooltip
from lightpen_app.widgets.fields import Translated
from lightpen_app.widgets.figure import Axes, Figure
from lightpen_app.widgets.live_markers import CameraSwitch
from lightpen_app.widgets.result_plots import (
    ArrowPlot,
    BarPlot,
    BudgetPlot,
    PosturePlot,
)
from lightpen_app.widgets.tables import Figures, NumberTable

N_COLUMNS = 2  # of plots
LEAST_HEIGHT = 25 * GRID  # px, of a plot with its title and axes


def card_of(plot: Figure) -> QFrame:
    """Return a frame with a plot."""
    frame = QFrame()
    frame.setProperty("area", "panel")
    vertical_layout(frame, plot, margins=GRID // 2)
    return frame


class PlotsPanel(Translated, QWidget):
    """Base of the panels: shows plots of a solution."""

    def __init__(self, plots: Sequence[Figure]) -> None:
        super().__init__()
        self._solution: Solution | None = None
        self._limit: float | None = None  # of U, mm
        self._cards = tuple(map(card_of, plots))

        # Layout
        self._layout = vertical_layout(self, margins=(0, GRID, 0, 0))
        grid = grid_layout(self._layout, stretch=1)
        for i, (plot, card) in enumerate(zip(plots, self._cards, strict=True)):
            plot.setMinimumHeight(LEAST_HEIGHT)
            grid.addWidget(card, *divmod(i, N_COLUMNS))

    def value(self) -> Solution | None:
        """Return the solution that is shown."""
        return self._solution

    def set_value(self, solution: Solution | None, limit: float | None = None) -> None:
        """Show another solution, with its limit of U in mm."""
        self._solution, self._limit = solution, limit
        if solution is not None:
            self._show(solution)

    def set_failed(self, failed: FailedSwing, rig: Rig) -> None:
        """Show images that gave no tip; only their residuals are known."""

    def shut_down(self) -> None:
        """Cancel running jobs."""

    def _show(self, solution: Solution) -> None:
        raise NotImplementedError


class ResidualsPanel(PlotsPanel):
    """Residuals over the image and by LED."""

    def __init__(self) -> None:
        # Widgets
        self._arrows, self._lens = ArrowPlot(Axes("")), ArrowPlot(Axes(""))
        axes = Axes(self.tr("Residuals by LED / px"), self.tr("LED"))
        self._leds = BarPlot(axes, ("", "", ""))
        super().__init__((self._arrows, self._leds, self._lens))
        self._lens_card = self._cards[-1]
        self._lens_card.setVisible(False)
        self._advice = self.say(
            text_label(TextSize.SMALL, Tone.QUIET),
            self.tr(
                "The arrows should look random. A pattern indicates an error of the "
                "intrinsics file; a single outlying LED, of the LED file."
            ),
        )
        self._switch = CameraSwitch()
        self._failed: tuple[FailedSwing, Rig] | None = None

        # Layout
        horizontal_layout(self._layout, (self._advice, 1), self._switch, spacing=-1)

        # Connections
        self._switch.value_changed.connect(self._on_camera_changed)

        self._refresh()

    @override
    def set_failed(self, failed: FailedSwing, rig: Rig) -> None:
        """Show the residuals of images, each from its own pose."""
        self._failed = failed, rig
        self._switch.setVisible(rig.n_cameras > 1)
        c = self._switch.value() if rig.n_cameras > 1 else 0
        residuals, pixels = failed.residuals[:, c], failed.pixels[:, c]
        seen: BoolArray = np.isfinite(residuals[..., 0])
        sums = np.where(seen[..., None], residuals, 0.0)
        n_seen = np.maximum(seen.sum(axis=0), 1)
        rms = np.sqrt((sums**2).sum(axis=(0, 2)) / (2 * n_seen))
        mean = sums.sum(axis=0) / n_seen[:, None]
        self._draw(rig.cameras[c], pixels[seen], residuals[seen], rms, mean)

    def _on_camera_changed(self) -> None:
        if self._solution is not None:
            self._show(self._solution)
        elif self._failed is not None:
            self.set_failed(*self._failed)

    @override
    def _show(self, solution: Solution) -> None:
        self._failed = None
        rig = solution.source.rig
        self._switch.setVisible(rig.n_cameras > 1)
        if rig.n_cameras == 1:
            self._switch.set_value(0)
        c = self._switch.value()
        camera = rig.cameras[c]
        calibration = solution.calibration
        images = calibration.cameras[c]
        used = images.leds_used & calibration.used[:, None]
        points = images.observations.seen_pixels[used]
        residuals = solution.residuals[:, c][used]
        leds = calibration.leds
        is_found = any(each.name is FieldName.LENS for each in calibration.fields)
        shifts = calibration.bundle.lens_shifts(c) if is_found else None
        self._lens_card.setVisible(shifts is not None)
        if shifts is not None:
            in_joint: BoolArray = np.any(calibration.joint.used, axis=1)
            in_fit = images.leds_used[calibration.used]
            found = shifts[: len(in_joint)][in_joint][in_fit]
            if camera.lens_field is not None:
                found = found + camera.lens_field.at(points)
            self._lens.set_data(camera.image_size, points, found)
        self._draw(camera, points, residuals, leds.rms, leds.mean)

    def _draw(
        self,
        camera: Camera,
        points: FloatArray,
        residuals: FloatArray,
        rms: FloatArray,
        mean: FloatArray,
    ) -> None:
        """Draw residuals (N, 2), px, at points (N, 2), and the residuals by LED."""
        self._arrows.set_data(camera.image_size, points, residuals)
        numbers = [str(led + 1) for led in range(len(rms))]
        self._leds.set_data(numbers, rms, mean[:, 0], mean[:, 1])
        self._refresh()

    @override
    def _refresh(self) -> None:
        x, y = self.tr("x / px"), self.tr("y / px")
        for plot, title in (
            (self._arrows, self.tr("Residuals \xd7 {0}")),
            (self._lens, self.tr("Lens field \xd7 {0}")),
        ):
            plot.set_axes(Axes(title.format(f"{plot.scale():g}"), x, y))
        self._leds.set_names([self.tr("RMS"), self.tr("mean x"), self.tr("mean y")])


class UncertaintyPanel(PlotsPanel):
    """Uncertainty budget of the tip with its checks, and the postures."""

    def __init__(self, services: Services = ()) -> None:
        # Widgets
        title = self.tr("U (k = 2) by source, weakest direction / mm")
        self._budget = BudgetPlot(Axes(title))
        axes = Axes(
            self.tr("Postures: tilt / \xb0"),
            self.tr("to the right"),
            self.tr("away from the camera"),
        )
        self._postures = PosturePlot(axes)
        super().__init__((self._budget, self._postures))
        self._remark = text_label(TextSize.SMALL, Tone.QUIET)
        rows = (each.budget_row() for each in services)
        self._checks = [row for row in rows if row is not None]

        # Layout
        self._layout.addWidget(self._remark)
        fill(self._layout, *self._checks)

    @override
    def shut_down(self) -> None:
        for each in self._checks:
            each.stop()

    @override
    def _show(self, solution: Solution) -> None:
        for each in self._checks:
            each.set_value(solution)
        coverage = solution.calibration.coverage
        self._postures.set_data(coverage.tilts, coverage.directions)
        self._refresh()

    @override
    def _refresh(self) -> None:
        if self._solution is not None:
            self._show_budget(self._solution)

    def _show_budget(self, solution: Solution) -> None:
        budget = reported(solution.calibration).budget
        parts = ((s.name, budget.weakest_share(s), s.assumed) for s in budget.shares)
        whole = budget.weakest_uncertainty
        self._budget.set_value(budget_figure(parts, whole, self._limit))
        along = ", ".join(f"{x:.2f}" for x in budget.weakest_direction.tolist())
        texts = [self.tr("Weakest direction: ({0})").format(along)]
        if any(share.assumed for share in budget.shares):
            texts.append(self.tr("Assumed: not stated in file"))
        if budget.correlation_factor > 1:
            text = self.tr("Images are correlated: noise variance \u00d7 {0}")
            texts.append(text.format(f"{budget.correlation_factor:.2f}"))
        self._remark.setText(PARTED.join(texts))


class MethodsPanel(PlotsPanel):
    """The paper's method, compared with the joint fit."""

    method_chosen = Signal(str)  # `Method` to be reported

    def __init__(self) -> None:
        # Widgets
        super().__init__(())
        self._table = self.say(NumberTable(), self.tr("Two-stage method and joint fit"))
        self._reports = self.say(QCheckBox(), self.tr("Report this method"))

        # Layout
        fill(self._layout, self._table, self._reports, (QWidget(), 10))

        # Connections
        self._reports.clicked.connect(
            lambda is_on: self.method_chosen.emit("two-stage" if is_on else "joint")
        )

    def set_locked(self, why: str) -> None:
        """Set why the method cannot be changed; empty if it can."""
        self._reports.setEnabled(not why)
        set_tooltip(self._reports, why or self.tr("Also for later swings here"))

    @override
    def _show(self, solution: Solution) -> None:
        self._reports.setChecked(solution.calibration.method == "two-stage")
        self._refresh()

    @override
    def _refresh(self) -> None:
        if self._solution is not None:
            self._table.set_value(self._figures(self._solution))

    def _figures(self, solution: Solution) -> Figures:
        calibration = solution.calibration
        joint = result_of(calibration, "joint")
        paper = result_of(calibration, "two-stage")
        joint_u, paper_u = joint.expanded_uncertainty, paper.expanded_uncertainty
        rows = (
            (self.tr("Joint fit"), joint.tip_pen, joint.rms_mm),
            (self.tr("U (k = 2)"), joint_u, None),
            (self.tr("Two-stage (paper)"), paper.tip_pen, paper.rms_mm),
            (self.tr("U (k = 2)"), paper_u, None),
            (self.tr("Difference"), two_stage_difference(calibration), None),
            (self.tr("of it by projected discs"), calibration.projection_bias, None),
        )
        columns = (*(f"{axis} / mm" for axis in AXES), self.tr("RMS / mm"))
        cells = tuple(
            (*map(mm_text, values[:3].tolist()), "" if rms is None else mm_text(rms))
            for _, values, rms in rows
        )
        return Figures(columns, tuple(name for name, *_ in rows), cells)
