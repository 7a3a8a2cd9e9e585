"""Questions before a tip is accepted or revoked, and the press test."""

from collections.abc import Callable
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject

from lightpen.model.bending import ASSUMED_BENDING, bending_on
from lightpen.model.names import Origin
from lightpen.record.calibrations import keep_bending
from lightpen.record.library.library_changes import Author
from lightpen.record.library.supervision import Signature
from lightpen.record.library.tip_library import Library
from lightpen.record.results.acceptance import takes_supervisor
from lightpen.swing.status import SwingStatus
from lightpen_app.steps.review.view import ReviewView
from lightpen_app.steps.review.view_state import repeat_question, take_back_question
from lightpen_app.work.job import LatestJob, Notifications, Report
from lightpen_app.work.library_watch import LibraryWatch
from lightpen_app.work.selection import Selection
from lightpen_app.work.swing_run import SwingRun

if TYPE_CHECKING:
    from lightpen.comparisons.press_test import PressTest


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
        if self._selection.supervision.is_guarded:
            self._view.withdrawal.ask(of_supervisor=True)
        else:
            self._view.question.ask_about(take_back_question, self._withdraw)

    def _withdraw(self, reason: str = "", signature: Signature | None = None) -> None:
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


class PressTestControl(QObject):
    """Starts a swing with firm pressure, compares it with the light one, stores it.

    It is stored with the tip in the library of the ``folder``; without one, or of a
    simulated pen, it is shown only.
    """

    def __init__(
        self,
        run: SwingRun,
        view: ReviewView,
        library: LibraryWatch,
        notifications: Notifications,
        folder: Path,
        now: Callable[[], datetime],
    ) -> None:
        super().__init__(view)
        self._run, self._library = run, library
        self._result, self._notices = view.result, notifications
        self._folder, self._now = folder, now
        self._compared: tuple[object, object] = None, None
        self._job = LatestJob(self)

        # Connections
        view.tools.press_requested.connect(self._press)
        library.changed.connect(self._show_bending)
        library.change_failed.connect(self._on_change_failed)

    def _press(self) -> None:
        self._run.runner.ask(lambda workflow: workflow.press())

    def follow(self, status: SwingStatus) -> None:
        """Compare the swings of a status, if there are two."""
        light, firm = status.solution, status.pressed
        if self._compared == (light, firm):
            return
        self._compared = light, firm
        self.shut_down()
        self._show_bending()
        if light is None or firm is None:
            return
        one, other = light.calibration, firm.calibration

        def compared(_: Report) -> "PressTest":
            from lightpen.comparisons.press_test import press_test

            return press_test(one, other)

        on_failed = partial(self._notices.notify, self)
        self._job.start(compared, self._on_compared, on_failed)

    def shut_down(self) -> None:
        """Compare no more."""
        self._job.cancel()

    def _show_bending(self) -> None:
        """Show the bending that counts for the tip of the swing."""
        status = self._run.status
        bending = ASSUMED_BENDING
        if status.origin is not Origin.SIMULATED:
            today, tip = self._now().date(), status.names.tip
            bending = self._library.library.bending_of(tip, today)
        self._result.set_bending(bending, None)

    def _on_compared(self, found: "PressTest") -> None:
        status, now = self._run.status, self._now()
        measured, names = found.bending(now.date()), status.names
        self._result.set_bending(bending_on(now.date(), measured), found)
        if measured is None or status.origin is Origin.SIMULATED or not names.tip:
            return
        folder = self._folder
        by = Author(names.station, names.operator, self.tr("Press test"))

        def store() -> Library:
            return keep_bending(folder, names.tip, measured, by, now)

        self._library.change(self, store)

    def _on_change_failed(self, asked: object, why: str) -> None:
        if asked is self and why:
            self._notices.notify(self, why)
