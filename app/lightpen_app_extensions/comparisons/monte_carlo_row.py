"""U by Monte Carlo on request, beside the budget."""

import os

from typing_extensions import override

from lightpen.model.coverage import COVERAGE_FACTOR
from lightpen.record.swings.solving import Solution
from lightpen_app.face import BudgetRow
from lightpen_app.look.languages import worded
from lightpen_app.look.layouts import horizontal_layout, vertical_layout
from lightpen_app.look.signs import Sign
from lightpen_app.look.theme import GRID, TextSize, text_label
from lightpen_app.look.words import AXES, decimals_for, number_text
from lightpen_app.widgets.bars import JobProgress
from lightpen_app.widgets.controls import give_focus
from lightpen_app.widgets.fields import Translated
from lightpen_app.widgets.number_field import NumberField, is_refusing
from lightpen_app.widgets.state_banner import SignLabel, StatusMessage
from lightpen_app.widgets.tables import Figures, NumberTable
from lightpen_app.work.job import LatestJob, Report
from lightpen_extensions.comparisons.monte_carlo import (
    MIN_TRIALS,
    MonteCarlo,
    local_workers,
    run_monte_carlo,
)

USUAL_TRIALS, MOST_TRIALS = 200, 10_000


class MonteCarloRow(Translated, BudgetRow):
    """Checks the budget of a solution by simulated calibrations, in other processes."""

    def __init__(self) -> None:
        super().__init__()
        self._solution: Solution | None = None
        self._found: MonteCarlo | None = None
        self._fault = ""
        self._job = LatestJob(self)

        # Widgets
        self._start = self.make_button(
            self.tr("Monte Carlo check"),
            self._on_start_clicked,
            tip=self.tr(
                "Propagates the distributions of files, seating and noise by the "
                "Monte Carlo method (JCGM 101). Uses all processor cores but one "
                "for seconds to minutes."
            ),
        )
        self._label = self.say(text_label(TextSize.BODY), self.tr("Trials"))
        self._trials = self.say(
            NumberField("", (MIN_TRIALS, MOST_TRIALS), 0), self.tr("Trials")
        )
        self._trials.set_value(USUAL_TRIALS)
        self._label.setBuddy(self._trials)
        self._progress = JobProgress()
        self._outcome = SignLabel()
        self._table = self.say(
            NumberTable(), self.tr("U by Monte Carlo and by uncertainty budget")
        )

        # Layout
        layout = vertical_layout(self, spacing=GRID // 2)
        horizontal_layout(
            layout,
            self._start,
            self._label,
            self._trials,
            (self._progress, 1),
            (self._outcome, 1),
        )
        layout.addWidget(self._table)

        # Connections
        self._progress.cancelled.connect(self._on_cancel_clicked)

        self._refresh()

    @override
    def set_value(self, solution: Solution) -> None:
        if solution is self._solution:
            return
        self.stop()
        self._solution, self._found, self._fault = solution, None, ""
        self._refresh()

    @override
    def stop(self) -> None:
        self._job.cancel()

    def _on_start_clicked(self) -> None:
        solution = self._solution
        if solution is None or is_refusing(self):
            return
        calibration, n_trials = solution.calibration, round(self._trials.value())

        def compute(report: Report) -> MonteCarlo:
            with local_workers(max(1, (os.cpu_count() or 1) - 1)) as in_workers:
                return run_monte_carlo(calibration, n_trials, in_workers, report)

        self._fault = ""
        self._progress.begin()
        self._job.start(
            compute,
            self._on_found,
            self._on_failed,
            progressed=self._progress.set_fraction,
            crashed=self._on_cancel_clicked,
        )
        self._refresh()

    def _on_found(self, found: MonteCarlo) -> None:
        self._found = found
        self._refresh()

    def _on_failed(self, why: str) -> None:
        self._fault = why
        self._refresh()

    def _on_cancel_clicked(self) -> None:
        self.stop()
        self._refresh()
        give_focus(self._start)

    def _refresh(self) -> None:
        is_busy = self._job.is_running
        self._start.setVisible(not is_busy)
        self._start.set_why_not(self._why_not())
        for field in (self._label, self._trials):
            field.setVisible(not is_busy)
        if not is_busy:
            self._progress.end()
        self._outcome.set_value(self._message())
        self._outcome.setVisible(not is_busy)
        self._table.setVisible(self._found is not None)
        if self._found is not None:
            self._table.set_value(self._figures(self._found))

    def _why_not(self) -> str:
        if self._solution is not None and self._solution.source.rig.n_cameras > 1:
            return self.tr("Available for swings with one camera only.")
        return ""

    def _message(self) -> StatusMessage:
        if self._fault:
            return StatusMessage.fault(self._fault)
        if self._found is None:
            why_not = self._why_not()
            return StatusMessage(why_not, Sign.RING if why_not else Sign.NONE)
        text = self.tr("{0} trials successful, {1} failed.")
        n_solved = len(self._found.errors)
        outcome = text.format(n_solved, self._found.n_failed)
        return StatusMessage(f"{outcome} {worded(self._found.explanation)}", Sign.RING)

    def _figures(self, found: MonteCarlo) -> Figures:
        """Return U by both, and their difference over its standard error."""
        by_trials = COVERAGE_FACTOR * found.deviation
        within = COVERAGE_FACTOR * found.precision
        by_budget = COVERAGE_FACTOR * found.linear
        rows = (
            (self.tr("U (k = 2) by Monte Carlo / mm"), by_trials, within),
            (self.tr("its standard error / mm"), within, within),
            (self.tr("U (k = 2) by uncertainty budget / mm"), by_budget, within),
        )
        cells = [
            tuple(
                number_text(x, decimals_for(u))
                for x, u in zip(values.tolist(), digits.tolist(), strict=True)
            )
            for _, values, digits in rows
        ]
        cells.append(tuple(number_text(x, 1) for x in found.difference.tolist()))
        names = (*(name for name, *_ in rows), self.tr("Difference / standard error"))
        return Figures(AXES, names, tuple(cells))
