"""The step Measure: features of a part with their U, without a key between touches."""

from PySide6.QtWidgets import QWidget
from typing_extensions import override

from lightpen_app.look.sounds import Sounds
from lightpen_app.look.theme import GRID
from lightpen_app.steps.verify.measure_presenter import MeasurePresenter
from lightpen_app.steps.verify.plan_panel import PlanPanel
from lightpen_app.steps.verify.probing_page import ProbingPage
from lightpen_app.work.workbench import Workbench


class MeasurePage(ProbingPage):
    """Shows a part that is measured and leads through its plan."""

    key = "measure"
    narrow_below = 1000 * GRID  # px: the tables need the room of the live image

    def __init__(
        self, workbench: Workbench, sounds: Sounds, parent: QWidget | None = None
    ) -> None:
        run = workbench.measuring
        presenter = MeasurePresenter(workbench, run)
        super().__init__(workbench, sounds, run, presenter, parent)

        # Widgets
        self._plan = PlanPanel(workbench)

        # Layout
        self._scrolled.insertWidget(0, self._plan)

        self._on_workbench_changed()
        self._retranslate()

    @override
    def _show(self) -> None:
        super()._show()
        self._plan.set_status(self._run.status)
