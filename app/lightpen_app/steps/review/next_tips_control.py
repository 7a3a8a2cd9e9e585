"""What comes after a tip was accepted: the other tips of its pen, one click each."""

from dataclasses import replace

from PySide6.QtCore import QObject, Signal

from lightpen.record.next_tips import NextTip, next_tips
from lightpen.record.results import Result
from lightpen_app.steps.review.next_tips_row import NextTipsRow
from lightpen_app.work.job import Job
from lightpen_app.work.workbench import Workbench


class NextTipsControl(QObject):
    """Looks for the other tips of a pen, and chooses the one that is wanted.

    Parameters
    ----------
    row : NextTipsRow
        Shows them.

    Signals
    -------
    chosen()
        The station is prepared for another tip; the swing before is left.
    """

    chosen = Signal()

    def __init__(self, workbench: Workbench, row: NextTipsRow) -> None:
        super().__init__(row)
        self._workbench = workbench
        self._row = row
        self._search: Job | None = None

        # Connections
        workbench.library.changed.connect(self._show_standings)
        row.chosen.connect(self._on_chosen)

        self._show_standings()

    def follow(self, result: Result | None) -> None:
        """Show the other tips of the pen whose tip was accepted, if one was."""
        self.shut_down()
        self._row.set_value(())
        if result is None:
            return
        archive = self._workbench.run.archive
        self._search = job = Job(lambda _: next_tips(archive, result), self)

        # Connections
        job.succeeded.connect(self._row.set_value)
        job.start()

    def shut_down(self) -> None:
        """Look no more."""
        if self._search is not None:
            self._search.cancel()

    def _show_standings(self) -> None:
        self._row.set_standings(self._workbench.library.standings)

    def _on_chosen(self, tip: NextTip) -> None:
        workbench = self._workbench
        workbench.run.runner.abandon()
        chosen = workbench.preparation
        if tip.last is not None:
            chosen = chosen.with_last(tip.last)
        if tip.listed is not None:
            chosen = chosen.with_listed(tip.listed)
        names = replace(chosen.names, pen=tip.pen)
        workbench.set_preparation(replace(chosen, names=names))
        self.chosen.emit()
