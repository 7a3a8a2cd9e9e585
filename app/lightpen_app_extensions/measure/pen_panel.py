"""The pen's health: its LEDs over accepted swings."""

from functools import partial

import numpy as np
from PySide6.QtCore import Signal
from PySide6.QtWidgets import QWidget
from typing_extensions import override

from lightpen.comparisons.pen_health import PenHealth
from lightpen.comparisons.pen_over_time import PenOverTime, read_pen_over_time
from lightpen.comparisons.records import BY_SIMPLE_ACCEPTANCE
from lightpen.estimation.reports.verdict import Grade
from lightpen_app.look.grades import GRADE_MARKS
from lightpen_app.look.layouts import vertical_layout
from lightpen_app.look.quantities import MICROMETRES, number_text
from lightpen_app.look.sentences import worded
from lightpen_app.look.signs import Sign
from lightpen_app.look.theme import GRID, TextSize, Tone, text_label
from lightpen_app.look.words import moment_text, shortened
from lightpen_app.widgets.number_table import Figures, NumberTable
from lightpen_app.widgets.sign_label import SignLabel, StatusMessage
from lightpen_app.widgets.translated import Translated
from lightpen_app.work.job import LatestJob
from lightpen_app.work.workbench import Workbench

LATEST = 8  # swings; the table has room for as many
PPM = 1e6


class PenPanel(Translated, QWidget):
    """Shows the pen that is chosen over its swings."""

    changed = Signal()  # what is found of it

    def __init__(self, workbench: Workbench) -> None:
        super().__init__()
        self._selection, self._run = workbench.selection, workbench.run
        self._shown: PenOverTime | None = None
        self._unread = ""  # why the swings cannot be read
        self._reading = LatestJob(self)
        self._read_of: tuple[object, ...] = ()

        # Widgets
        self._verdict = SignLabel()
        self._left_out, self._head = (
            text_label(TextSize.SMALL, Tone.QUIET) for _ in range(2)
        )
        self._left_out.setWordWrap(True)
        self._table = NumberTable()

        # Layout
        cells = self._verdict, self._left_out, self._head, self._table, 1
        vertical_layout(self, *cells, margins=(0, 2 * GRID, 0, 0))

        # Connections
        workbench.selection.changed.connect(self._on_workbench_changed)

        self._retranslate()

    def shut_down(self) -> None:
        """Cancel the running job."""
        self._reading.cancel()

    @property
    def grade(self) -> Grade | None:
        """What the swings say of the pen; None as long as they are too few."""
        found = None if self._shown is None else self._shown.health
        return None if found is None else found.assessment.grade

    def read(self) -> None:
        """Read the swings of the pen that is chosen."""
        now, archive = self._selection.preparation, self._run.archive
        if self._chosen() != self._read_of:
            self._shown = None
        self._read_of, self._unread = self._chosen(), ""
        self._reading.cancel()
        if now.pen_file is not None:
            work = partial(read_pen_over_time, archive, now)
            self._reading.start(work, self._on_read, self._on_unread)
        self._refresh()

    @override
    def _retranslate(self) -> None:
        head = self.tr("LEDs since the first swing / \xb5m, size of the pen / ppm")
        self._head.setText(head)
        self._table.setAccessibleName(head)
        self._refresh()

    def _on_workbench_changed(self) -> None:
        if self._read_of and self._chosen() != self._read_of:
            self.read()

    def _chosen(self) -> tuple[object, ...]:
        now = self._selection.preparation
        return now.names.pen, now.origin, now.pen_file, now.camera_file

    def _on_read(self, found: PenOverTime) -> None:
        self._shown = found
        self._refresh()

    def _on_unread(self, why: str) -> None:
        self._unread = why
        self._refresh()

    def _refresh(self) -> None:
        found = self._shown
        health = None if found is None else found.health
        self._verdict.set_value(self._health_message(health))
        self._left_out.setText(self._left_out_text())
        self._left_out.setVisible(bool(self._left_out.text()))
        for widget in (self._head, self._table):
            widget.setVisible(health is not None)
        if health is not None and found is not None:
            self._table.set_value(self._figures(found, health))
        self.changed.emit()

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
