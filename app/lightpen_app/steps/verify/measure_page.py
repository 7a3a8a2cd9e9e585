"""The step Measure: features of a part with their U, without a key between touches."""

from dataclasses import replace

from typing_extensions import override

from lightpen.estimation.reports.verdict import Grade
from lightpen.model.expanded_uncertainty import COVERAGE_FACTOR
from lightpen.verification.session.session_state import SessionSetup, SessionState
from lightpen.verification.tasks.assessment import VerificationAssessment
from lightpen.verification.tasks.part import PART
from lightpen.verification.tasks.probed_point import StillFrames, measure_touches
from lightpen_app.look.quantities import number_text
from lightpen_app.look.signs import Sign
from lightpen_app.look.sounds import Sounds
from lightpen_app.look.theme import GRID, Tone
from lightpen_app.steps.page import MainAction
from lightpen_app.steps.verify.plan_panel import PlanPanel
from lightpen_app.steps.verify.presenter import VerifyPresenter
from lightpen_app.steps.verify.probing_page import ProbingPage
from lightpen_app.steps.verify.view_state import VerifyView
from lightpen_app.widgets.operator_view import OperatorValue
from lightpen_app.widgets.state_banner import State
from lightpen_app.work.workbench import Workbench


class MeasurePresenter(VerifyPresenter):
    """Computes the view from the status of runner, camera and station."""

    tasks = (PART,)

    @override
    def view(self) -> VerifyView:
        return replace(super().view(), can_be_accepted=False)

    @override
    def next_step(self) -> str:
        return "start"

    def lacks_plan(self) -> bool:
        """Return whether a plan is all that is missing."""
        status = self._status
        return status.tip is not None and status.refusal is not None

    @override
    def _action(self) -> MainAction:
        if self.lacks_plan():
            return MainAction(self.tr("Open plan..."))
        return super()._action()

    @override
    def _banner(self) -> State:
        if self.lacks_plan():
            return State(self.tr("NO PLAN YET"), "", Sign.RING, Tone.QUIET)
        return super()._banner()

    @override
    def operator_value(self) -> OperatorValue:
        value, status = super().operator_value(), self._status
        if status.setup is None or status.state is None or value.fraction is None:
            return value
        place = self._live_tip(status.setup, status.state)
        banner = replace(value.state, detail=place or value.state.detail)
        if status.task is PART:  # the hint counts the points
            progress = status.state.progress(status.setup, PART)
            count = self.tr("Feature {0} of {1}").format(progress.run, progress.n_runs)
            value = replace(value, count=count)
            if status.setup.choices.options_of(PART).plan is None:
                value = replace(value, count="", fraction=None)
        return replace(value, state=banner)

    def _live_tip(self, setup: SessionSetup, state: SessionState) -> str:
        """Return the tip with its U at the present pose; empty if it is not seen."""
        touching = state.touching
        if not touching.held or touching.n_lost:
            return ""
        still = StillFrames((touching.held[-1].frame,))
        (point,) = measure_touches(setup.instrument, (still,))
        spread = COVERAGE_FACTOR * point.covariance(setup.instrument).diagonal() ** 0.5
        numbers = (number_text(x, 2) for x in point.point_cam.tolist())
        u = number_text(float(spread.max()), 3)
        place = self.tr("{0}  {1}  {2}  \u00b1 {3} mm (k = 2)").format(*numbers, u)
        tail = place.rindex("\u00b1")  # from which number and unit stay together
        return place[:tail] + place[tail:].replace(" ", "\u00a0", 2)

    @override
    def _purpose(self) -> str:
        return self.tr("Measure features of a part with the current tip.")

    @override
    def _missing(self) -> str:
        return self.tr("Choose a plan")

    @override
    def _refused(self) -> str:
        return self.tr("Nothing to measure")

    @override
    def _verdict(self, found: VerificationAssessment) -> str:
        if found.is_accepted:
            return self.tr("Part measured")
        if found.grade is Grade.CHECK:
            return self.tr("Not proven")
        return self.tr("Out of tolerance")

    @override
    def _grade_text(self, grade: Grade) -> str:
        if grade is Grade.REPEAT:
            return self.tr("NOT OK")
        return super()._grade_text(grade)


class MeasurePage(ProbingPage):
    """Shows a part that is measured and leads through its plan."""

    key = "measure"
    narrow_below = 1000 * GRID  # px: the tables need the room of the live image

    def __init__(self, workbench: Workbench, sounds: Sounds) -> None:
        run = workbench.measuring
        self._measures = MeasurePresenter(workbench, run)
        super().__init__(workbench, sounds, run, self._measures)

        # Widgets
        self._plan = PlanPanel(workbench)

        # Layout
        self._scrolled.insertWidget(0, self._plan)

        self._on_workbench_changed()
        self._retranslate()

    @override
    def run_main_action(self) -> None:
        if self._measures.lacks_plan():
            self._plan.pick_plan()
        else:
            super().run_main_action()

    @override
    def _show(self) -> None:
        super()._show()
        self._plan.set_status(self._run.status)
