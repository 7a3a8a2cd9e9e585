"""The pen's health: its LEDs over accepted swings, and a better LED file by them."""

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import Qt
from PySide6.QtGui import QShowEvent
from PySide6.QtWidgets import QProgressBar, QWidget
from typing_extensions import override

from lightpen.arrays import FloatArray
from lightpen.formats.opened_files import PenFile
from lightpen.verification.history.pen_health import PenHealth
from lightpen.verification.history.pen_over_time import (
    NewLedFile,
    PenOverTime,
    improve_led_file,
    read_pen_over_time,
)
from lightpen.verification.reports.records import BY_SIMPLE_ACCEPTANCE
from lightpen.verification.tasks.part import PART
from lightpen.verification.tasks.pen_scale import Scale, scale_of
from lightpen_app.look.grades import GRADE_MARKS
from lightpen_app.look.layouts import fill, horizontal_layout, vertical_layout
from lightpen_app.look.quantities import MICROMETRES, number_text
from lightpen_app.look.sentences import worded
from lightpen_app.look.signs import Sign
from lightpen_app.look.theme import GRID, TextSize, Tone, colors_of, text_label
from lightpen_app.look.tooltips import set_tooltip
from lightpen_app.look.words import moment_text, shortened
from lightpen_app.widgets.focus import give_focus
from lightpen_app.widgets.number_table import Figures, NumberTable
from lightpen_app.widgets.plots import Axes, Plot
from lightpen_app.widgets.push_button import PushButton
from lightpen_app.widgets.sign_label import SignLabel, StatusMessage
from lightpen_app.widgets.translated import Translated
from lightpen_app.work.job import LatestJob
from lightpen_app.work.workbench import Workbench

LATEST = 8  # swings; the table has room for as many
PROGRESS_STEPS = 1000
PLOT_HEIGHT = 20 * GRID
DOT = 6  # px
PPM = 1e6


class PenPanel(Translated, QWidget):
    """Shows the pen that is chosen over its swings, and makes a better LED file."""

    def __init__(self, workbench: Workbench) -> None:
        super().__init__()
        self._selection, self._run = workbench.selection, workbench.run
        self._measuring = workbench.measuring
        self._folder, self._clock = workbench.folder, workbench.around.now
        self._shown: PenOverTime | None = None
        self._new: NewLedFile | None = None
        self._fault = ""  # why there is no better file
        self._unread = ""  # why the swings cannot be read
        self._reading = LatestJob(self)
        self._improving = LatestJob(self)
        self._opening = LatestJob(self)  # the new file
        self._read_of: tuple[object, ...] = ()

        # Widgets
        self._verdict = SignLabel()
        self._left_out = text_label(TextSize.SMALL, Tone.QUIET)
        self._left_out.setWordWrap(True)
        self._plot = _LedMovesPlot()
        self._plot.setMinimumHeight(PLOT_HEIGHT)
        self._head = text_label(TextSize.SMALL, Tone.QUIET)
        self._table = NumberTable()
        self._improve = PushButton()
        self._cancel = PushButton()
        self._progress = QProgressBar(maximum=PROGRESS_STEPS, textVisible=False)
        self._label = SignLabel()
        self._use = PushButton()

        # Layout
        layout = vertical_layout(
            self, self._verdict, self._left_out, margins=(0, 2 * GRID, 0, 0)
        )
        horizontal_layout(
            layout,
            (self._improve, 0, Qt.AlignmentFlag.AlignTop),
            (self._cancel, 0, Qt.AlignmentFlag.AlignTop),
            (self._progress, 1),
            (self._label, 1, Qt.AlignmentFlag.AlignTop),
            (self._use, 0, Qt.AlignmentFlag.AlignTop),
        )
        fill(layout, self._head, self._table, (self._plot, 100), 1)

        # Connections
        self._improve.clicked.connect(self._on_improve_clicked)
        self._cancel.clicked.connect(self._on_cancel_clicked)
        self._use.clicked.connect(self._on_use_clicked)
        workbench.selection.changed.connect(self._on_workbench_changed)

        self._retranslate()

    def shut_down(self) -> None:
        """Cancel running jobs."""
        for job in (self._reading, self._improving, self._opening):
            job.cancel()

    @override
    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        self._read()

    @override
    def _retranslate(self) -> None:
        self._improve.setText(self.tr("Improve the LED file"))
        set_tooltip(
            self._improve,
            self.tr(
                "Pools the newest swings; the last one is held out for "
                "confirmation. The old file is retained."
            ),
        )
        self._cancel.setText(self.tr("Cancel"))
        self._use.setText(self.tr("Use the new file"))
        self._progress.setAccessibleName(self.tr("Progress"))
        head = self.tr("LEDs since the first swing / \xb5m, size of the pen / ppm")
        self._head.setText(head)
        self._table.setAccessibleName(head)
        title = self.tr("LEDs since the first swing / mm")
        self._plot.set_axes(Axes(title, self.tr("swing no.")))
        self._refresh()

    # What is read

    def _on_workbench_changed(self) -> None:
        if self.isVisible() and self._chosen() != self._read_of:
            self._read()

    def _chosen(self) -> tuple[object, ...]:
        now = self._selection.preparation
        return now.names.pen, now.origin, now.pen_file, now.camera_file

    def _read(self) -> None:
        now, archive = self._selection.preparation, self._run.archive
        is_other, self._read_of = self._chosen() != self._read_of, self._chosen()
        self._unread = ""
        if is_other:
            self.shut_down()  # its result would be of the previous pen
            self._shown, self._new, self._fault = None, None, ""
        self._reading.cancel()
        if now.pen_file is None:
            self._refresh()
            return
        work = partial(read_pen_over_time, archive, now)
        self._reading.start(work, self._on_read, self._on_unread)
        self._refresh()

    def _on_read(self, found: PenOverTime) -> None:
        self._shown = found
        self._refresh()

    def _on_unread(self, why: str) -> None:
        self._unread = why
        self._refresh()

    def _on_failed(self, why: str) -> None:
        self._fault = why
        self._refresh()

    # A better LED file

    def _on_improve_clicked(self) -> None:
        pen = self._shown
        if pen is None:
            return
        self._new, self._fault = None, ""
        self._progress.setValue(0)
        now, scale = self._clock(), self._scale()
        work = partial(improve_led_file, self._folder, pen, scale, now)
        self._improving.start(
            work,
            self._on_improved,
            self._on_failed,
            progressed=self._on_progressed,
            crashed=self._on_cancel_clicked,
        )
        self._refresh()
        self._cancel.setFocus()

    def _scale(self) -> Scale | None:
        """Return the scale by a certified length, where one was measured just now."""
        state, setup = self._measuring.status.state, self._measuring.status.setup
        found = None if state is None else state.found_by(PART)
        if found is None or setup is None:
            return None
        points = [point for _, point in found.points]
        return scale_of(found.part, points, setup.instrument)

    def _on_progressed(self, fraction: float) -> None:
        self._progress.setValue(round(PROGRESS_STEPS * fraction))

    def _on_improved(self, new: NewLedFile) -> None:
        self._new = new
        was_waited_for = self._cancel.hasFocus()
        self._refresh()
        if was_waited_for:
            give_focus(self._use)

    def _on_cancel_clicked(self) -> None:
        self._improving.cancel()
        self._refresh()
        give_focus(self._improve)

    def _on_use_clicked(self) -> None:
        if self._new is None:
            return
        path: Path = self._new.path
        on_read = partial(self._on_new_read, self._read_of)
        self._opening.start(lambda _: PenFile.read(path), on_read, self._on_failed)

    def _on_new_read(self, made_for: tuple[object, ...], pen_file: PenFile) -> None:
        now = self._selection.preparation
        if self._chosen() != made_for:
            return
        self._selection.set_preparation(replace(now, pen_file=pen_file))

    # What is shown

    def _refresh(self) -> None:
        found, is_busy = self._shown, self._improving.is_running
        health = None if found is None else found.health
        self._verdict.set_value(self._health_message(health))
        self._left_out.setText(self._left_out_text())
        self._left_out.setVisible(bool(self._left_out.text()))
        for widget in (self._head, self._table):
            widget.setVisible(health is not None)
        self._plot.setVisible(health is not None)
        if health is not None and found is not None:
            self._table.set_value(self._figures(found, health))
            moves = [np.linalg.norm(swing.shifts, axis=1) for swing in health.swings]
            self._plot.set_data(np.array(moves), health.moved)
        self._improve.setVisible(not is_busy)
        self._improve.set_why_not(self._why_not_improve())
        self._cancel.setVisible(is_busy)
        self._progress.setVisible(is_busy)
        self._label.set_value(self._message())
        self._label.setVisible(not is_busy)
        self._use.setVisible(self._new is not None and not is_busy)

    def _health_message(self, health: PenHealth | None) -> StatusMessage:
        if self._unread:
            return StatusMessage.fault(self._unread)
        if health is not None:
            assessment = health.assessment
            words = f"{worded(assessment.reason)} {worded(BY_SIMPLE_ACCEPTANCE)}"
            return StatusMessage(words, *GRADE_MARKS[assessment.grade])
        if self._shown is None and not self._reading.is_running:
            return StatusMessage()
        if self._shown is None:
            return StatusMessage(self.tr("Reading the swings of the pen."), Sign.WAIT)
        text = self.tr(
            "Two accepted swings of pen {0} with this LED file are needed; so far: {1}."
        )
        pen, n_swings = shortened(self._shown.names.pen), len(self._shown.swings)
        return StatusMessage(text.format(pen, n_swings), Sign.RING)

    def _left_out_text(self) -> str:
        if self._shown is None or not self._shown.n_left_out:
            return ""
        text = self.tr("Swings with another LED file, or unreadable: {0}.")
        return text.format(self._shown.n_left_out)

    def _why_not_improve(self) -> str:
        found = self._shown
        if found is None or found.camera is None:
            return self.tr("The swings are not read yet.")
        if found.n_missing:
            text = self.tr(
                "Four accepted swings with this LED file and intrinsics file are "
                "needed; missing: {0}."
            )
            return text.format(found.n_missing)
        if found.health is not None and found.health.moved:
            return self.tr("An LED has moved: no LED file fits all swings.")
        return ""

    def _message(self) -> StatusMessage:
        if self._new is None:
            return StatusMessage.fault(self._fault) if self._fault else StatusMessage()
        improved = self._new.improved
        text = self.tr(
            "Saved as {0}: residuals of the swing held out {1} px, with the old file "
            "{2} px. Calibrate the tip again with the new file."
        )
        after, before = improved.sigma_after, improved.sigma_before
        words = (self._new.path.name, number_text(after, 4), number_text(before, 4))
        return StatusMessage.good(text.format(*words))

    def _figures(self, found: PenOverTime, health: PenHealth) -> Figures:
        """Return the shift of each LED and the growth of the pen, by swing."""
        heads = *map(str, range(1, len(found.pen.leds) + 1)), self.tr("size")
        names, cells = [], []
        for swing, judged in list(zip(found.swings, health.swings, strict=True))[
            -LATEST:
        ]:
            names.append(moment_text(swing.when))
            lengths = np.linalg.norm(judged.shifts, axis=1) * MICROMETRES
            moves = (number_text(x, 0) if np.isfinite(x) else "" for x in lengths)
            growth = judged.growth
            size = "" if growth is None else number_text(PPM * growth.relative, 0)
            cells.append((*moves, size))
        return Figures(heads, tuple(names), tuple(cells))


class _LedMovesPlot(Plot):
    """Displacement of each LED over the swings; a displaced one stands out."""

    def __init__(self) -> None:
        self._lines: list[pg.PlotDataItem] = []
        self._moved: tuple[int, ...] = ()
        super().__init__(Axes(""))

    def set_data(self, moves: FloatArray, moved: tuple[int, ...]) -> None:
        """Show the shifts of LEDs (N, L) at each swing, mm, NaN where not seen.

        ``moved`` are the numbers of those that moved against the others, from 1.
        """
        n_swings, n_leds = moves.shape
        while len(self._lines) < n_leds:
            line = pg.PlotDataItem(symbol="o", symbolSize=DOT, connect="finite")
            self._lines.append(line)
            self._item.addItem(line)
        x = np.arange(1.0, n_swings + 1)
        for j, line in enumerate(self._lines):
            line.setVisible(j < n_leds)
            if j < n_leds:
                line.setData(x, moves[:, j])
        self._moved = moved
        self._columns = {"swing": x}
        for j in range(n_leds):
            self._columns[f"led_{j + 1}_mm"] = moves[:, j]
        self._fit_numbered(n_swings, np.append(moves.ravel(), (0.0, 0.01)))
        self._restyle()

    @override
    def _restyle(self) -> None:
        super()._restyle()
        colors = colors_of(self.palette())
        for number, line in enumerate(self._lines, start=1):
            has_moved = number in self._moved
            color = colors.tone(Tone.BAD) if has_moved else colors.muted
            line.setPen(pg.mkPen(color, width=1))
            line.setSymbolBrush(pg.mkBrush(color))
            line.setSymbolPen(None)
            line.setZValue(1 if has_moved else 0)
