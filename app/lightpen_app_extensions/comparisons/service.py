"""U by Monte Carlo in the window."""

from typing_extensions import override

from lightpen_app.face import BudgetRow, Service


class ComparisonsService(Service):
    """Adds a check of the budget to the step Review."""

    @override
    def budget_row(self) -> BudgetRow:
        # Few budgets are checked.
        from lightpen_app_extensions.comparisons.monte_carlo_row import MonteCarloRow

        return MonteCarloRow()
