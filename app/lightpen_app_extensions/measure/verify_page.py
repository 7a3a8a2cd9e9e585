"""The step Verify: checks of the current tip, of artefacts and of the pen."""

from dataclasses import replace
from functools import partial

import numpy as np
from PySide6.QtCore import Signal
from PySide6.QtWidgets import QWidget
from typing_extensions import override

from lightpen.estimation.reports.verdict import Grade
from lightpen.model.artefacts import Artefact
from lightpen_app.look.languages import worded
from lightpen_app.look.layouts import vertical_layout
from lightpen_app.look.phrases import GRADE_MARKS
from lightpen_app.look.signs import Sign
from lightpen_app.look.sounds import Sounds
from lightpen_app.look.theme import GRID, TextSize, Tone, text_label
from lightpen_app.look.words import MICROMETRES, moment_text, number_text, shortened
from lightpen_app.widgets.fields import Translated
from lightpen_app.widgets.state_banner import SignLabel, StatusMessage
from lightpen_app.widgets.tables import Figures, NumberTable
from lightpen_app.work.job import LatestJob
from lightpen_app.work.workbench import Workbench
from lightpen_app_extensions.measure.check_list import CheckRow
from lightpen_app_extensions.measure.part_view import FigureValue
from lightpen_app_extensions.measure.plan_panel import choose_plan
from lightpen_app_extensions.measure.presenter import VerifyPresenter
from lightpen_app_extensions.measure.probing_page import ProbingPage
from lightpen_app_extensions.measure.service import MeasureService
from lightpen_extensions.comparisons.assessment import BY_SIMPLE_ACCEPTANCE
from lightpen_extensions.comparisons.pen_health import (
    PenHealth,
    PenOverTime,
    read_pen_over_time,
)
from lightpen_extensions.measure.measuring.plan import artefact_plan

LATEST = 8  # swings; the table has room for as many


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
        head = self.tr("LEDs since the first swing / \xb5m")
        self._head = self.say(text_label(TextSize.SMALL, Tone.QUIET), head)
        self._table = self.say(NumberTable(), head)

        # Layout
        cells = self._verdict, self._head, self._table, 1
        vertical_layout(self, *cells, margins=(0, 2 * GRID, 0, 0))

        # Connections
        workbench.selection.changed.connect(self._on_workbench_changed)

        self._refresh()

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
            words += self._left_out_text()
            return StatusMessage(words, *GRADE_MARKS[assessment.grade])
        if self._shown is None and not self._reading.is_running:
            return StatusMessage()
        if self._shown is None:
            return StatusMessage(self.tr("Reading the swings of the pen."), Sign.WAIT)
        text = self.tr(
            "Two accepted swings of pen {0} with this LED file are needed; so far: {1}."
        )
        pen, n_swings = shortened(self._shown.names.pen), len(self._shown.swings)
        return StatusMessage(
            text.format(pen, n_swings) + self._left_out_text(), Sign.RING
        )

    def _left_out_text(self) -> str:
        if self._shown is None or not self._shown.n_left_out:
            return ""
        text = self.tr("Swings with another LED file, or unreadable: {0}.")
        return " " + text.format(self._shown.n_left_out)

    def _figures(self, found: PenOverTime, health: PenHealth) -> Figures:
        """Return the shift of each LED, by swing."""
        heads = tuple(map(str, range(1, len(found.pen.leds) + 1)))
        names, cells = [], []
        for swing, judged in list(zip(found.swings, health.swings, strict=True))[
            -LATEST:
        ]:
            names.append(moment_text(swing.when))
            lengths = np.linalg.norm(judged.shifts, axis=1) * MICROMETRES
            moves = (number_text(x, 0) if np.isfinite(x) else "" for x in lengths)
            cells.append(tuple(moves))
        return Figures(heads, tuple(names), tuple(cells))


class ChecksPresenter(VerifyPresenter):
    """Lists the artefacts of the library, and the pen, after the checks of the tip."""

    def __init__(self, service: MeasureService) -> None:
        super().__init__(service, service.verification)
        self._library = service.workbench.library
        self.pen_grade: Grade | None = None  # None until it is known

    @property
    def artefacts(self) -> dict[str, Artefact]:
        """The artefacts of the library by their names."""
        return {
            name: item.artefact
            for name, item in self._library.statuses.library.references.items()
            if item.artefact is not None and not item.is_retired
        }

    @override
    def rows(self) -> tuple[CheckRow, ...]:
        quiet = (CheckRow(name, "", Sign.RING, Tone.QUIET) for name in self.artefacts)
        name, grade = self.tr("Pen"), self.pen_grade
        pen = CheckRow(name, "", Sign.RING, Tone.QUIET)
        if grade is not None:
            pen = CheckRow(name, self._grade_text(grade), *GRADE_MARKS[grade])
        return (*super().rows(), *quiet, pen)

    @override
    def figure(self, row: int) -> FigureValue:
        names = list(self.artefacts)
        if row < len(self.tasks):
            return super().figure(row)
        name = names[row - len(self.tasks)]
        purpose = self.tr("The scale by a certified value: {0:.4f} mm.")
        certified = self.artefacts[name].certified
        action = self.tr("Measure")
        return FigureValue(name, purpose.format(certified), action=action)


class VerifyPage(ProbingPage):
    """Shows the checks and leads through the one that is probed."""

    key = "verify"

    def __init__(self, service: MeasureService, sounds: Sounds) -> None:
        self._lists = ChecksPresenter(service)
        self._row: int | None = None  # that the user selected
        super().__init__(service, sounds, service.verification, self._lists)

        # Widgets
        self._pen = PenPanel(service.workbench)
        self._stack.addWidget(self._pen)

        # Connections
        self._checks.chosen.connect(self._on_row_chosen)
        self._figure.asked.connect(self._on_asked)
        self._pen.changed.connect(self._on_pen_read)

        self._on_workbench_changed()
        self._refresh()

    @override
    def title(self) -> str:
        return self.tr("Verify")

    @override
    def entered(self) -> None:
        super().entered()
        self._pen.read()

    @override
    def shut_down(self) -> None:
        super().shut_down()
        self._pen.shut_down()

    @override
    def _shown_row(self) -> int:
        row = super()._shown_row() if self._row is None else self._row
        return min(row, len(self._view.rows) - 1)

    @override
    def _show_row(self, row: int) -> None:
        is_pen = row == len(self._view.rows) - 1
        self._stack.setCurrentIndex(1 if is_pen else 0)
        if not is_pen:
            super()._show_row(row)

    def _on_row_chosen(self, row: int) -> None:
        self._row = None if row == self._view.current else row
        self._show()

    def _on_pen_read(self) -> None:
        self._lists.pen_grade = self._pen.grade
        self._show_soon()

    def _on_asked(self) -> None:
        row, choices = self._shown_row(), self._service.choices
        self._row = None
        tasks = self._lists.tasks
        if row < len(tasks):
            self._service.set_choices(replace(choices, kind=tasks[row].kind))
            return
        name, artefact = list(self._lists.artefacts.items())[row - len(tasks)]
        choose_plan(self._service, artefact_plan(name, [artefact]))
        self.step_requested.emit("measure")
