"""The step Measure: features of a part with their U, without a key between touches."""

from dataclasses import replace

from PySide6.QtWidgets import QWidget
from typing_extensions import override

from lightpen.estimation.reports.verdict import Grade
from lightpen_app.look.languages import worded
from lightpen_app.look.phrases import DECISION_MARKS, Instruction
from lightpen_app.look.signs import Sign
from lightpen_app.look.sounds import Sounds
from lightpen_app.look.theme import Tone
from lightpen_app.look.words import PARTED, number_text
from lightpen_app.widgets.operator_view import OperatorValue
from lightpen_app.widgets.page import MainAction
from lightpen_app.widgets.state_banner import State
from lightpen_app_extensions.measure.check_list import CheckRow, value_text
from lightpen_app_extensions.measure.part_view import FigureValue, part_value
from lightpen_app_extensions.measure.plan_panel import PlanPanel
from lightpen_app_extensions.measure.presenter import VerifyPresenter, VerifyView
from lightpen_app_extensions.measure.probing_page import ProbingPage
from lightpen_app_extensions.measure.service import MeasureService
from lightpen_extensions.comparisons.assessment import VerificationAssessment
from lightpen_extensions.measure.measuring.report import DECISIONS
from lightpen_extensions.measure.measuring.surfaces import NAMES
from lightpen_extensions.measure.session import SessionSetup, SessionState, bands_so_far
from lightpen_extensions.measure.tasks.part import (
    PART,
    FeatureSoFar,
    feature_so_far,
    planned_at,
)
from lightpen_extensions.measure.tasks.task import Band

FEW = 4  # values that leave room for the picture
NEAR = 10.0  # mm, from which the deviation of the tip at present is shown


class MeasurePresenter(VerifyPresenter):
    """Computes the view from the status of runner, camera and station."""

    tasks = (PART,)

    @override
    def view(self) -> VerifyView:
        view = super().view()
        begins_anew = view.can_start_over and not self._status.is_done
        return replace(view, can_start_over=begins_anew)

    @override
    def next_step(self) -> str:
        return ""  # the next part by the same plan

    @override
    def rows(self) -> tuple[CheckRow, ...]:
        """Return the features in their order, with the values that end with each."""
        return self._listed()[0]

    @override
    def current_row(self) -> int:
        return self._listed()[1]

    def _listed(self) -> tuple[tuple[CheckRow, ...], int]:
        """Return the rows, and which of them is probed now."""
        setup, state = self._status.setup, self._status.state
        if setup is None or state is None:
            return (), 0
        features = setup.choices.features
        n_done, found = len(state.runs), state.found_by(PART)
        if found is not None:
            features = tuple(e for e in features if e.name not in found.missing)
            n_done = len(features)
        ends = self._values_by_last(setup, state)
        rows, current = list[CheckRow](), 0
        for i, planned in enumerate(features):
            name = planned.name
            if i < n_done:
                values = ends.get(name, [])
                rows += [_value_row(each) for each in values]
                if not values:
                    rows.append(CheckRow(name, "", *DECISION_MARKS[None]))
            elif i == n_done:
                current = len(rows)
                now = Sign.PLAY, Tone.ACTIVE
                rows.append(CheckRow(name, self.tr("now"), *now))
            elif planned.kind is not None:  # what is recognised may be the last one
                rows.append(CheckRow(name, "", Sign.RING, Tone.QUIET))
        return tuple(rows), current

    def _values_by_last(
        self, setup: SessionSetup, state: SessionState
    ) -> dict[str, list[Band]]:
        """Return the values so far by the last probed of their features."""
        features = setup.choices.features
        order = {each.name: i for i, each in enumerate(features)}
        found: dict[str, list[Band]] = {}
        for band in bands_so_far(setup, state):
            last = max((n for n in band.of if n in order), key=order.__getitem__)
            found.setdefault(last, []).append(band)
        return found

    @override
    def figure(self, row: int) -> FigureValue:
        setup, state = self._status.setup, self._status.state
        if setup is None or state is None:
            return FigureValue()
        choices, bands = setup.choices, bands_so_far(setup, state)
        picture = part_value(setup, state)
        if state.done is not None:
            name = "" if choices.plan is None else worded(choices.plan.words)
            shown = picture if len(bands) < FEW else None
            return FigureValue(name, picture=shown, bands=bands)
        progress = state.progress(setup, PART)
        now = feature_so_far(choices, progress, setup.conditions)
        if now is None:
            return FigureValue()
        kind = "" if now.kind is None else worded(NAMES[now.kind])
        name = now.planned.name
        title = name if not kind or kind in name else f"{name} ({kind})"
        before = planned_at(choices, len(state.runs) - 1) if state.runs else None
        last = None if before is None else before.name
        ended = self._values_by_last(setup, state).get(last or "", [])
        live = self._live_deviation(now, state)
        return FigureValue(title, live, picture, tuple(ended))

    def _live_deviation(self, now: FeatureSoFar, state: SessionState) -> str:
        """Return how far the tip is from the feature; the points done without one."""
        touching = state.touching
        if now.fit is not None and touching.held and not touching.n_lost:
            off = now.fit.distance_of(touching.held[-1].tip_cam)
            if abs(off) < NEAR:
                words = self.tr("Deviation {0} mm")
                return words.format(number_text(off, 3))
        done, needed = len(state.touches), now.planned.n_touches
        return self.tr("Point {0} of {1}").format(min(done + 1, needed), needed)

    def lacks_plan(self) -> bool:
        """Return whether a plan is all that is missing."""
        status = self._status
        return status.tip is not None and status.refusal is not None

    @override
    def action(self) -> MainAction:
        if self.lacks_plan():
            return MainAction(self.tr("Open a plan..."))
        if self._status.is_done:
            return MainAction(self.tr("Measure the next part"))
        return super().action()

    @override
    def _now(self) -> tuple[Instruction, State]:
        words, shown = super()._now()
        if self.lacks_plan():
            shown = State(self.tr("NO PLAN YET"), "", Sign.RING, Tone.QUIET)
        return words, shown

    @override
    def operator_value(self) -> OperatorValue:
        value, status = super().operator_value(), self._status
        if status.setup is None or status.state is None or value.fraction is None:
            return value
        if status.task is PART:  # the hint counts the points
            progress = status.state.progress(status.setup, PART)
            choices = status.setup.choices
            now = feature_so_far(choices, progress, status.setup.conditions)
            live = "" if now is None else self._live_deviation(now, status.state)
            banner = replace(value.state, detail=live or value.state.detail)
            value = replace(value, state=banner)
            count = self.tr("Feature {0} of {1}").format(progress.run, progress.n_runs)
            value = replace(value, count=count)
            ended = bands_so_far(status.setup, status.state)[-1:]
            words = (f"{worded(e.name)}  {value_text(e)}" for e in ended)
            value = replace(value, time_left="".join(words))
        return value

    @override
    def lead(self) -> str:
        plan = self._service.choices.plan
        lead = super().lead()
        return lead if plan is None else PARTED.join((lead, worded(plan.words)))

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


def _value_row(band: Band) -> CheckRow:
    verdict, mark = worded(DECISIONS[band.decision]), DECISION_MARKS[band.decision]
    return CheckRow(worded(band.name), value_text(band), *mark, verdict)


class MeasurePage(ProbingPage):
    """Shows a part that is measured and leads through its plan."""

    key = "measure"

    def __init__(self, service: MeasureService, sounds: Sounds) -> None:
        run = service.measuring
        self._measures = MeasurePresenter(service, run)
        self._plan = PlanPanel(service)
        super().__init__(service, sounds, run, self._measures)

        # Layout
        self._rows.insertWidget(0, self._plan)
        self._figure.head.addWidget(self._plan.of_feature)
        self._progress.add_button(self._plan.of_part)

        self._on_workbench_changed()
        self._refresh()

    @override
    def title(self) -> str:
        return self.tr("Measure")

    @override
    def first_control(self) -> QWidget:
        lacks_plan = self._measures.lacks_plan()
        return self._plan.open_button if lacks_plan else self._checks

    @override
    def run_main_action(self) -> None:
        if self._measures.lacks_plan():
            self._plan.pick_plan()
        else:
            super().run_main_action()

    @override
    def _show(self) -> None:
        lacks_plan = self._measures.lacks_plan()
        for widget in (self._work, self._progress.state, self._plan.of_part):
            widget.setVisible(not lacks_plan)
        super()._show()
        self._plan.set_status(self._run.status, lacks_plan=lacks_plan)
