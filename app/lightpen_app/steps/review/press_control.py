"""The press test in Review, compared off the GUI thread, and the bending of the tip."""

from collections.abc import Callable
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject

from lightpen.model.bending import ASSUMED_BENDING, bending_on
from lightpen.model.origin import Origin
from lightpen.record.calibrations.tip_bending import keep_bending
from lightpen.record.library.library_changes import Author
from lightpen.record.library.tip_library import Library
from lightpen.swing.status import SwingStatus
from lightpen_app.steps.review.view import ReviewView
from lightpen_app.work.job import LatestJob, Report
from lightpen_app.work.library_watch import LibraryWatch
from lightpen_app.work.notifications import Notifications
from lightpen_app.work.swing_run import SwingRun

if TYPE_CHECKING:
    from lightpen.comparisons.press_test import PressTest


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
