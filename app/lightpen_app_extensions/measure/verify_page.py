"""The step Verify: checks of the current tip, of artefacts and of the pen."""

from dataclasses import replace

from typing_extensions import override

from lightpen.estimation.reports.verdict import Grade
from lightpen.model.artefacts import Artefact
from lightpen_app.look.grades import GRADE_MARKS
from lightpen_app.look.signs import Sign
from lightpen_app.look.sounds import Sounds
from lightpen_app.look.theme import Tone
from lightpen_app_extensions.measure.check_list import CheckRow
from lightpen_app_extensions.measure.figure import FigureValue
from lightpen_app_extensions.measure.pen_panel import PenPanel
from lightpen_app_extensions.measure.plan_panel import choose_plan, listed_artefacts
from lightpen_app_extensions.measure.presenter import VerifyPresenter
from lightpen_app_extensions.measure.probing_page import ProbingPage
from lightpen_app_extensions.measure.service import MeasureService
from lightpen_extensions.measure.measuring.artefacts import artefact_plan


class ChecksPresenter(VerifyPresenter):
    """Lists the artefacts of the library, and the pen, after the checks of the tip."""

    def __init__(self, service: MeasureService) -> None:
        super().__init__(service, service.verification)
        self._library = service.workbench.library
        self.pen_grade: Grade | None = None  # None until it is known

    @property
    def artefacts(self) -> dict[str, Artefact]:
        """The artefacts of the library by their names."""
        return listed_artefacts(self._library.statuses.library)

    @override
    def rows(self) -> tuple[CheckRow, ...]:
        quiet = (CheckRow(name, "", Sign.RING, Tone.QUIET) for name in self.artefacts)
        name, grade = self.tr("Pen"), self.pen_grade
        pen = CheckRow(name, "", Sign.RING, Tone.QUIET)
        if grade is not None:
            pen = CheckRow(name, self._grade_text(grade), *GRADE_MARKS[grade])
        return (*super().rows(), *quiet, pen)

    @override
    def figure(self, row: int) -> FigureValue:
        names = list(self.artefacts)
        if row < len(self.tasks):
            return super().figure(row)
        name = names[row - len(self.tasks)]
        purpose = self.tr("The scale by a certified value: {0:.4f} mm.")
        certified = self.artefacts[name].certified
        action = self.tr("Measure")
        return FigureValue(name, purpose.format(certified), action=action)


class VerifyPage(ProbingPage):
    """Shows the checks and leads through the one that is probed."""

    key = "verify"

    def __init__(self, service: MeasureService, sounds: Sounds) -> None:
        self._lists = ChecksPresenter(service)
        self._row: int | None = None  # that the user selected
        super().__init__(service, sounds, service.verification, self._lists)

        # Widgets
        self._pen = PenPanel(service.workbench)
        self._stack.addWidget(self._pen)

        # Connections
        self._checks.chosen.connect(self._on_row_chosen)
        self._figure.asked.connect(self._on_asked)
        self._pen.changed.connect(self._on_pen_read)

        self._on_workbench_changed()
        self._retranslate()

    @override
    def title(self) -> str:
        return self.tr("Verify")

    @override
    def entered(self) -> None:
        super().entered()
        self._pen.read()

    @override
    def shut_down(self) -> None:
        super().shut_down()
        self._pen.shut_down()

    @override
    def _shown_row(self) -> int:
        row = super()._shown_row() if self._row is None else self._row
        return min(row, len(self._view.rows) - 1)

    @override
    def _show_row(self, row: int) -> None:
        is_pen = row == len(self._view.rows) - 1
        self._stack.setCurrentIndex(1 if is_pen else 0)
        if not is_pen:
            super()._show_row(row)

    def _on_row_chosen(self, row: int) -> None:
        self._row = None if row == self._view.current else row
        self._show()

    def _on_pen_read(self) -> None:
        self._lists.pen_grade = self._pen.grade
        self._show_soon()

    def _on_asked(self) -> None:
        row, choices = self._shown_row(), self._service.choices
        self._row = None
        tasks = self._lists.tasks
        if row < len(tasks):
            self._service.set_choices(replace(choices, kind=tasks[row].kind))
            return
        name, artefact = list(self._lists.artefacts.items())[row - len(tasks)]
        choose_plan(self._service, artefact_plan(name, [artefact]))
        self.step_requested.emit("measure")
