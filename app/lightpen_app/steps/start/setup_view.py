"""Set up station: permanent entries."""

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QWidget

from lightpen_app.look.layouts import (
    fill,
    horizontal_layout,
    set_stacked,
    vertical_layout,
)
from lightpen_app.look.theme import GRID
from lightpen_app.steps.start.assumptions_panel import AssumptionsPanel
from lightpen_app.steps.start.data_folder_panel import DataFolderPanel
from lightpen_app.steps.start.form import LimitsForm, NamesForm
from lightpen_app.steps.start.newcomer_panel import NewcomerPanel
from lightpen_app.widgets.push_button import PushButton
from lightpen_app.widgets.translated import Translated
from lightpen_app.work.workbench import Workbench


class SetupView(Translated, QWidget):
    """Setup of a station."""

    done = Signal()  # show the day page

    def __init__(self, workbench: Workbench, *, is_known: bool) -> None:
        super().__init__()
        self._is_known = is_known

        # Widgets: the order of making them is the order of the Tab key
        self.names, self.limits = NamesForm(), LimitsForm()
        self.assumed = AssumptionsPanel()
        self.folder = DataFolderPanel(workbench.folder, workbench.notifications)
        self.newcomer = NewcomerPanel()
        self._done = PushButton()

        # Layout
        rows = vertical_layout(self, spacing=3 * GRID)
        self._columns = horizontal_layout(rows, spacing=3 * GRID)
        self._left = vertical_layout(
            self._columns,
            self.names,
            self.limits,
            self.assumed,
            1,
            spacing=2 * GRID,
            stretch=5,
        )
        self._right = vertical_layout(self._columns, spacing=2 * GRID, stretch=4)
        fill(self._right, self.folder)
        if is_known:
            fill(self._right, self.newcomer)
        fill(self._right, 1)
        horizontal_layout(rows, self._done, 1)
        rows.addStretch(1)

        # Connections
        self._done.clicked.connect(self.done)

        self.set_narrow(False)
        self._retranslate()

    def set_narrow(self, narrow: bool) -> None:
        """Use one column where there is little width."""
        set_stacked(self._columns, narrow)
        if not self._is_known:
            self.newcomer.set_wide(narrow)
            column = self._left if narrow else self._right
            column.insertWidget(0, self.newcomer)

    def set_why_not_done(self, why_not: str) -> None:
        """Show the missing inputs of the day page."""
        self._done.set_why_not(why_not)

    def _retranslate(self) -> None:
        self._done.setText(self.tr("Show the tips of this station"))
