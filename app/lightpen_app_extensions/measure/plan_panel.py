"""The measuring plan: opened or taught; the kind of the current feature; exports."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

from msgspec import structs
from PySide6.QtWidgets import QFileDialog, QWidget
from typing_extensions import override

from lightpen.formats.files import FileFormat
from lightpen.record.exports import save_new
from lightpen_app.look.languages import worded
from lightpen_app.look.layouts import fill, horizontal_layout, vertical_layout
from lightpen_app.look.theme import GRID, TextSize, text_label
from lightpen_app.widgets.bars import Question, QuestionBar
from lightpen_app.widgets.fields import ChoiceField, Translated
from lightpen_app.work.job import Job, Report
from lightpen_app_extensions.measure.service import MeasureService
from lightpen_extensions.measure.measuring.part import MeasuredPart, taught_plan
from lightpen_extensions.measure.measuring.plan import Plan, PlannedFeature, free_plan
from lightpen_extensions.measure.measuring.plan_checks import read_plan, write_plan
from lightpen_extensions.measure.measuring.report import EXPORTS
from lightpen_extensions.measure.measuring.surfaces import NAMES, FeatureKind
from lightpen_extensions.measure.probing_operator import PLATE_WORDS, plate_plan
from lightpen_extensions.measure.session import VerificationStatus
from lightpen_extensions.measure.tasks.part import PART, planned_at

SUFFIXES = "*.yaml *.yml"
BUTTON_WIDTH, BUTTON_HEIGHT = 30 * GRID, 8 * GRID  # px, at least


def choose_plan(service: MeasureService, plan: Plan | None) -> None:
    """Measure by a plan from its first feature, or leave the plan."""
    run, choices = service.measuring, service.choices
    state = run.status.state
    if state is not None and state.is_begun:
        run.runner.ask(lambda workflow: workflow.start_over())
    service.set_choices(replace(choices, plan=plan))


class PlanPanel(Translated, QWidget):
    """Chooses a plan, changes the kind of the current feature, and saves results.

    Without a plan it shows the choices of one, else a row of controls.
    """

    def __init__(self, service: MeasureService) -> None:
        super().__init__()
        workbench = service.workbench
        self._workbench, self._run = workbench, service.measuring
        self._service, self._live = service, workbench.live
        self._notices = workbench.notifications
        self._status = VerificationStatus()

        # Widgets
        self._question = QuestionBar()
        self._question.set_words(self._leaving)
        self._start, self.of_part, self.of_feature = (QWidget() for _ in range(3))
        self.open_button = self.make_button(self.tr("Open a plan..."), self.pick_plan)
        self._teach = self.make_button(self.tr("Teach a plan"), self._on_teach_clicked)
        plate = self.tr("Try the simulated plate")
        self._plate = self.make_button(plate, self._on_plate_clicked)
        texts = (
            self.tr("Measure by a plan in a YAML file."),
            self.tr(
                "Features are recognised while they are probed; save them as a plan "
                "at the end."
            ),
            self.tr("Ten features of a plate that the simulated operator probes."),
        )
        name = self.tr("Kind of the feature that is probed")
        self._kind = self.say(ChoiceField(), name=name)
        for kind in (None, *FeatureKind):
            self._kind.addItem("", None if kind is None else kind.value)
        tip = self.tr("Save a plan with the measured features as nominals.")
        save = self.tr("Save plan...")
        self._save_plan = self.make_button(save, self._on_save_plan_clicked, tip=tip)
        self._export = self.make_button(self.tr("Export..."), self._on_export_clicked)
        self._other = self.make_button(self.tr("Other plan"), self._on_other_clicked)

        # Layout
        vertical_layout(self, self._question, (self._start, 1))
        rows = vertical_layout(self._start, 1, spacing=2 * GRID, margins=2 * GRID)
        buttons = self.open_button, self._teach, self._plate
        for button, text in zip(buttons, texts, strict=True):
            words = self.say(text_label(TextSize.LEAD), text)
            button.setProperty("inviting", button is self.open_button)
            button.setMinimumSize(BUTTON_WIDTH, BUTTON_HEIGHT)
            horizontal_layout(rows, button, (words, 1), spacing=3 * GRID)
        fill(rows, 2)
        horizontal_layout(self.of_feature, self._kind)
        of_part = self._save_plan, self._export, self._other
        horizontal_layout(self.of_part, *of_part)

        # Connections
        self._question.agreed.connect(self._leave_plan)
        self._kind.activated.connect(self._on_kind_chosen)

        self._refresh()

    def set_status(self, status: VerificationStatus, *, lacks_plan: bool) -> None:
        """Show a measurement."""
        self._status = status
        self._start.setVisible(lacks_plan)
        planned = self._planned()
        is_taught = planned is not None and planned.nominal is None
        self.of_feature.setVisible(is_taught)
        kind = None if planned is None else planned.kind
        self._kind.setCurrentIndex(self._kind.findData(kind and kind.value))
        is_simulated = self._live.operator is not None
        why_not = "" if is_simulated else self.tr("Only with the simulated camera.")
        self._plate.set_why_not(why_not)
        for button in (self._save_plan, self._export):
            button.setVisible(self._part() is not None)

    def _planned(self) -> PlannedFeature | None:
        state = self._status.state
        if state is None or state.done is not None:
            return None
        setup = self._status.setup
        choices = self._service.choices if setup is None else setup.choices
        return planned_at(choices, len(state.runs))

    def _part(self) -> MeasuredPart | None:
        state = self._status.state
        found = None if state is None else state.found_by(PART)
        return None if found is None else found.part

    @override
    def _refresh(self) -> None:
        self._kind.setItemText(0, self.tr("Recognise"))
        for index, kind in enumerate(FeatureKind, start=1):
            self._kind.setItemText(index, worded(NAMES[kind]))

    def pick_plan(self) -> None:
        """Let the user choose the file of a plan."""
        name, _ = QFileDialog.getOpenFileName(
            self,
            self.tr("Open a measuring plan"),
            self._folder(),
            self.tr("Measuring plans ({0})").format(SUFFIXES),
        )
        if name:
            self.open_plan(Path(name))

    def open_plan(self, path: Path) -> None:
        """Read a plan and measure by it, or report why that is impossible."""
        job = Job(lambda _: read_plan(path), self)
        job.succeeded.connect(partial(choose_plan, self._service))
        job.start(
            lambda _: self._notices.withdraw(self), partial(self._notices.notify, self)
        )

    def _folder(self) -> str:
        return str(self._workbench.save_place.folder())

    def _on_teach_clicked(self) -> None:
        choose_plan(self._service, free_plan(str(self.tr("Part"))))

    def _leaving(self) -> Question:
        return Question(
            self.tr("Leave the plan? The points of this part are discarded."),
            self.tr("Leave the plan"),
            self.tr("Continue"),
        )

    def _on_other_clicked(self) -> None:
        state = self._status.state
        if state is not None and state.is_begun and not self._status.is_done:
            self._question.ask()
        else:
            self._leave_plan()

    def _leave_plan(self) -> None:
        choose_plan(self._service, None)

    def _on_plate_clicked(self) -> None:
        choose_plan(self._service, plate_plan(worded(PLATE_WORDS)))

    def _on_kind_chosen(self) -> None:
        word = self._kind.currentData()
        kind = None if word is None else FeatureKind(word)
        choices, planned = self._service.choices, self._planned()
        plan = choices.plan
        if plan is None or planned is None:
            return
        changed = structs.replace(planned, kind=kind)
        features = tuple(
            changed if e.name == planned.name else e for e in plan.features
        )
        changed_plan = structs.replace(plan, features=features)
        self._service.set_choices(replace(choices, plan=changed_plan))

    def _on_save_plan_clicked(self) -> None:
        part = self._part()
        name, _ = QFileDialog.getSaveFileName(
            self,
            self.tr("Save the measuring plan"),
            str(Path(self._folder()) / "plan.yaml"),
            self.tr("Measuring plans ({0})").format(SUFFIXES),
        )
        if part is None or not name:
            return
        path, plan = Path(name), taught_plan(part)
        self._save(lambda _: write_plan(plan, path), path)

    def _on_export_clicked(self) -> None:
        part = self._part()
        filters = {f"{worded(each.label)} (*{each.suffix})": each for each in EXPORTS}
        name, chosen = QFileDialog.getSaveFileName(
            self,
            self.tr("Export the measured part"),
            self._folder(),
            ";;".join(filters),
        )
        if part is not None and name:
            self.export(part, filters[chosen], Path(name))

    def export(self, part: MeasuredPart, export: FileFormat, path: Path) -> None:
        """Write a measured part in a format for other programs."""
        named = path if path.suffix else path.with_suffix(export.suffix)
        self._save(
            lambda _: save_new(named.parent, named.name, export.encoded(part)), named
        )

    def _save(self, work: Callable[[Report], object], path: Path) -> None:
        self._workbench.save_place.remember(path.parent)
        job = Job(work, self)
        job.start(lambda _: self._on_saved(path), partial(self._notices.notify, self))

    def _on_saved(self, path: Path) -> None:
        self._notices.show_status(self.tr("Saved: {0}").format(path))
