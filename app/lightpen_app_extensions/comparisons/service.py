"""Comparisons of calibrations in the window."""

from typing_extensions import override

from lightpen_app.face import BudgetRow, PressComparison, SelectionTab, Service
from lightpen_app.work.workbench import Workbench


class ComparisonsService(Service):
    """Adds a check of the budget and press tests to Review, repeatability to History.

    What few sessions need is imported when it is made.
    """

    def __init__(self, workbench: Workbench) -> None:
        super().__init__(workbench)
        self._workbench = workbench

    @override
    def budget_row(self) -> BudgetRow:
        from lightpen_app_extensions.comparisons.monte_carlo_row import MonteCarloRow

        return MonteCarloRow()

    @override
    def press_comparison(self) -> PressComparison:
        from lightpen_app_extensions.comparisons.press_tests import PressTests

        return PressTests(self._workbench)

    @override
    def selection_tab(self) -> SelectionTab:
        from lightpen_app_extensions.comparisons.selection_panel import SelectionPanel

        return SelectionPanel(self._workbench)
