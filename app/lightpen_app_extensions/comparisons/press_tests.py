"""Press tests in the window: a firm swing is compared with the light one before."""

from functools import partial
from typing import TYPE_CHECKING

from typing_extensions import override

from lightpen.model.names import Origin
from lightpen.record.library.library_changes import Author
from lightpen.record.library.tip_library import Library
from lightpen.swing.status import SwingStatus
from lightpen_app.face import PressComparison
from lightpen_app.look.languages import worded
from lightpen_app.look.phrases import GRADE_MARKS
from lightpen_app.widgets.state_banner import StatusMessage
from lightpen_app.work.job import LatestJob, Report
from lightpen_app.work.workbench import Workbench
from lightpen_extensions.comparisons.press_test import keep_bending

if TYPE_CHECKING:
    from lightpen_extensions.comparisons.press_test import PressTest


class PressTests(PressComparison):
    """Compares in the background, and stores what was measured with the tip.

    That of a simulated pen is shown only.
    """

    is_here = True

    def __init__(self, workbench: Workbench) -> None:
        super().__init__(workbench)
        self._workbench = workbench
        self._compared: tuple[object, object] = None, None
        self._job = LatestJob(self)

        # Connections
        workbench.library.change_failed.connect(self._on_change_failed)

    @override
    def follow(self, status: SwingStatus) -> None:
        light, firm = status.solution, status.pressed
        if self._compared == (light, firm):
            return
        self._compared = light, firm
        self.shut_down()
        if light is None or firm is None:
            return
        one, other = light.calibration, firm.calibration

        def compare(_: Report) -> "PressTest":
            # Few swings are pressed.
            from lightpen_extensions.comparisons.press_test import press_test

            return press_test(one, other)

        on_failed = partial(self._workbench.notifications.notify, self)
        self._job.start(compare, self._on_compared, on_failed)

    @override
    def shut_down(self) -> None:
        self._job.cancel()

    def _on_compared(self, found: "PressTest") -> None:
        mark = GRADE_MARKS[found.assessment.grade]
        self.compared.emit(
            lambda: StatusMessage(" ".join(map(worded, found.words)), *mark)
        )
        status, now = self._workbench.run.status, self._workbench.around.now()
        measured, names = found.bending(now.date()), status.names
        if measured is None or status.origin is Origin.SIMULATED or not names.tip:
            return
        folder = self._workbench.folder
        by = Author(names.station, names.operator, self.tr("Press test"))

        def store() -> Library:
            return keep_bending(folder, names.tip, measured, by, now)

        self._workbench.library.change(self, store)

    def _on_change_failed(self, asked: object, why: str) -> None:
        if asked is self and why:
            self._workbench.notifications.notify(self, why)
