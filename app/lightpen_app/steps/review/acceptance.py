"""Questions before a tip is accepted or revoked."""

from PySide6.QtCore import QObject

from lightpen.record.library.supervision import Signature
from lightpen.record.results.acceptance import takes_supervisor
from lightpen_app.steps.review.view import ReviewView
from lightpen_app.steps.review.view_state import repeat_question
from lightpen_app.work.selection import Selection
from lightpen_app.work.swing_run import SwingRun


class AcceptanceControl(QObject):
    """Asks in the view of Review and forwards the answers to the runner."""

    def __init__(self, selection: Selection, run: SwingRun, view: ReviewView) -> None:
        super().__init__(view)
        self._selection, self._run, self._view = selection, run, view
        self._runner = run.runner

        # Connections
        view.accept.clicked.connect(self._ask_reason)
        view.reason.given.connect(self._accept)
        view.repeat.clicked.connect(self.ask_to_repeat)
        view.take_back.clicked.connect(self._ask_to_take_back)
        view.withdrawal.given.connect(self._withdraw)
        run.refused.connect(self._on_refused)

    def ask_to_repeat(self) -> None:
        """Ask whether to set the swing aside and repeat it."""
        self._view.question.ask_about(repeat_question, self._set_aside)

    def _ask_reason(self) -> None:
        status = self._run.status
        if status.assessment is not None:
            supervision, station = self._selection.supervision, status.names.station
            of_supervisor = takes_supervisor(supervision, status.assessment, station)
            self._view.reason.ask(of_supervisor=of_supervisor)

    def _accept(self, reason: str, signature: Signature | None) -> None:
        self._runner.ask(lambda workflow: workflow.solving.accept(reason, signature))

    def _set_aside(self) -> None:
        self._runner.ask(lambda workflow: workflow.discard())

    def _ask_to_take_back(self) -> None:
        is_guarded = self._selection.supervision.is_guarded
        self._view.withdrawal.ask(of_supervisor=is_guarded)

    def _withdraw(self, reason: str, signature: Signature | None) -> None:
        result = self._run.status.result
        if result is not None:
            operator = self._selection.preparation.names.operator
            self._runner.ask(
                lambda workflow: workflow.solving.revoke(
                    result, operator, reason, signature
                )
            )

    def _on_refused(self) -> None:
        if self._run.status.result is None:
            self._view.reason.refuse()
