"""The press test in Review: begun by a button, compared off the GUI thread."""

from functools import partial

from PySide6.QtCore import QObject

from lightpen.swing.status import SwingStatus
from lightpen_app.steps.review.view import ReviewView
from lightpen_app.work.job import LatestJob, Report
from lightpen_app.work.notifications import Notifications
from lightpen_app.work.swing_run import SwingRun


class PressTestControl(QObject):
    """Starts a swing with firm pressure, and shows its difference from the first."""

    def __init__(
        self, run: SwingRun, view: ReviewView, notifications: Notifications
    ) -> None:
        super().__init__(view)
        self._runner = run.runner
        self._result, self._notices = view.result, notifications
        self._compared: tuple[object, object] = None, None
        self._job = LatestJob(self)

        # Connections
        view.tools.press_requested.connect(self._press)

    def _press(self) -> None:
        self._runner.ask(lambda workflow: workflow.press())

    def follow(self, status: SwingStatus) -> None:
        """Compare the swings of a status, if there are two."""
        usual, firm = status.solution, status.pressed
        if self._compared == (usual, firm):
            return
        self._compared = usual, firm
        self.shut_down()
        self._result.set_pressed(None)
        if usual is None or firm is None:
            return
        one, other = usual.calibration, firm.calibration

        def compared(_: Report) -> object:
            from lightpen.verification.history.press_test import press_test

            return press_test(one, other)

        on_failed = partial(self._notices.notify, self)
        self._job.start(compared, self._result.set_pressed, on_failed)

    def shut_down(self) -> None:
        """Compare no more."""
        self._job.cancel()
