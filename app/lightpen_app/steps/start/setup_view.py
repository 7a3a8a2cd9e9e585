"""Set up station: permanent entries."""

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QWidget

from lightpen_app.look.layouts import horizontal_layout, set_stacked, vertical_layout
from lightpen_app.look.theme import GRID
from lightpen_app.steps.start.assumptions_panel import AssumptionsPanel
from lightpen_app.steps.start.data_folder_panel import DataFolderPanel
from lightpen_app.steps.start.form import LimitsForm, NamesForm
from lightpen_app.widgets.push_button import PushButton
from lightpen_app.widgets.translated import Translated
from lightpen_app.work.workbench import Workbench


class SetupView(Translated, QWidget):
    """Setup of a station."""

    done = Signal()  # show the day page
    welcome_requested = Signal()  # show how to begin

    def __init__(self, workbench: Workbench, *, is_known: bool) -> None:
        super().__init__()

        # Widgets: the order of making them is the order of the Tab key
        self.names, self.limits = NamesForm(), LimitsForm()
        self.assumed = AssumptionsPanel()
        self.folder = DataFolderPanel(workbench.folder, workbench.notifications)
        self._more = self.say(PushButton(checkable=True), self.tr("More"))
        self._done = self.make_button(
            self.tr("Show the tips of this station"), self.done
        )
        self._welcome = self.make_button(
            self.tr("Other ways to begin"), self.welcome_requested
        )

        # Layout
        rows = vertical_layout(self, spacing=3 * GRID)
        self._columns = horizontal_layout(rows, spacing=3 * GRID)
        vertical_layout(
            self._columns,
            self.names,
            (self._more, 0, Qt.AlignmentFlag.AlignLeft),
            self.limits,
            self.assumed,
            1,
            spacing=2 * GRID,
            stretch=5,
        )
        vertical_layout(self._columns, self.folder, 1, spacing=2 * GRID, stretch=4)
        horizontal_layout(rows, self._done, self._welcome, 1)
        rows.addStretch(1)

        # Connections
        self._more.toggled.connect(self.set_more)

        self.set_more(is_known)

    def lead(self) -> str:
        """Return what to enter."""
        return self.tr(
            "Enter what you are calibrating. Entries are saved for this station."
        )

    def set_narrow(self, narrow: bool) -> None:
        """Use one column where there is little width."""
        set_stacked(self._columns, narrow)

    def set_more(self, more: bool) -> None:
        """Show also what has a default."""
        self._more.setChecked(more)
        self.names.set_more(more)
        for each in (self.limits, self.assumed, self.folder):
            each.setVisible(more)

    def set_why_not_done(self, why_not: str) -> None:
        """Show the missing inputs of the day page."""
        self._done.set_why_not(why_not)
