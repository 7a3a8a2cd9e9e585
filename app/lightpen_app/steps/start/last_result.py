"""Reads and shows the last result of the selected pen and tip."""

from collections.abc import Callable

from PySide6.QtCore import QObject, Signal

from lightpen.model.origin import Origin
from lightpen.record.library.supervision import Signature
from lightpen.record.results.results import Result
from lightpen.swing.preparation import Preparation
from lightpen_app.look.phrases import first_missing
from lightpen_app.steps.start.large_screen_panel import LargeScreenPanel
from lightpen_app.steps.start.result_panel import LastResult, LastResultPanel
from lightpen_app.work.job import LatestJob
from lightpen_app.work.library_watch import LibraryWatch
from lightpen_app.work.selection import Selection
from lightpen_app.work.swing_run import SwingRun


class LastResultPresenter(QObject):
    """Shows the last result in one panel, its swing in another."""

    verification_requested = Signal()  # verify the displayed tip

    def __init__(
        self,
        selection: Selection,
        run: SwingRun,
        library: LibraryWatch,
        panel: LastResultPanel,
        large: LargeScreenPanel,
    ) -> None:
        super().__init__(panel)
        self._selection, self._run, self._library = selection, run, library
        self._panel, self._large = panel, large
        self._lookup = LatestJob(self)

        # Connections
        selection.changed.connect(self._on_selected)
        library.changed.connect(self.show_status)
        run.result_changed.connect(self.look_up)
        panel.take_back_requested.connect(self._on_take_back_requested)
        panel.verification_requested.connect(self.verification_requested)

        self.show_status()

    def look_up(self) -> None:
        """Read the current result."""
        self._look_up(lambda result: None)

    def show_trend(self) -> None:
        """Show the trend of the tip if there is room."""
        pen, tip, is_simulated = _key(self._selection.preparation)
        if not self._large.isHidden():
            self._large.set_value(pen, tip, is_simulated=is_simulated)

    def shut_down(self) -> None:
        """Stop."""
        self._large.shut_down()
        self._lookup.cancel()

    def _look_up(self, use: Callable[[Result | None], None]) -> None:
        self.shut_down()
        self.show_trend()
        pen, tip, is_simulated = _key(self._selection.preparation)
        if not (pen and tip):
            self._panel.set_value(LastResult(is_named=False))
            return
        archive = self._run.archive

        def show(result: Result | None) -> None:
            self._panel.set_value(LastResult(result, is_simulated=is_simulated))
            use(result)

        self._lookup.start(
            lambda _: archive.in_force(pen, tip, is_simulated=is_simulated),
            show,
            self._on_failed,
            crashed=lambda: self._on_failed(self.tr("Last calibration not available")),
        )

    def _fill_in(self, result: Result | None) -> None:
        if result is not None:
            completed = self._selection.preparation.completed(result)
            self._selection.set_preparation(completed)

    def _on_failed(self, sentence: str) -> None:
        self._panel.set_value(LastResult(fault=sentence))

    def _on_selected(self, before: Preparation) -> None:
        self.show_status()
        if _key(self._selection.preparation) != _key(before):
            self._look_up(self._fill_in)

    def show_status(self) -> None:
        """Mark the selected tip by its status."""
        now, library = self._selection.preparation, self._library
        self._panel.set_guarded(self._selection.supervision.is_guarded)
        status = library.statuses.of_tip(now.names.pen, now.names.tip)
        self._panel.set_status(None if now.origin is Origin.SIMULATED else status)
        due = self._selection.limits.due
        self._panel.set_rule(library.library.rule_of(now.names.tip, due))
        self._panel.set_why_unverified(first_missing(now.missing_inputs()))

    def _on_take_back_requested(
        self, result: Result, reason: str, signature: Signature | None
    ) -> None:
        operator = self._selection.preparation.names.operator
        self._run.runner.ask(
            lambda workflow: workflow.solving.revoke(
                result, operator, reason, signature
            )
        )


def _key(preparation: Preparation) -> tuple[str, str, bool]:
    names = preparation.names
    return names.pen, names.tip, preparation.origin is Origin.SIMULATED
