"""The step Start: day page and set-up of the station."""

from PySide6.QtGui import QShowEvent
from PySide6.QtWidgets import QStackedWidget, QWidget
from typing_extensions import override

from lightpen.swing.preparation import MissingInput, Preparation
from lightpen_app.face import Services, verify_step
from lightpen_app.look.layouts import fill, vertical_layout
from lightpen_app.look.theme import GRID
from lightpen_app.steps.start.day_view import DayView
from lightpen_app.steps.start.interrupted_panel import InterruptedPanel
from lightpen_app.steps.start.library_control import LibraryControl
from lightpen_app.steps.start.limits_dialog import LimitsControl
from lightpen_app.steps.start.result_panel import LastResultPanel
from lightpen_app.steps.start.setup_view import SetupView, WelcomeView
from lightpen_app.widgets.bars import QuestionBar
from lightpen_app.widgets.fitting import PageScroll, ResponsiveLayout
from lightpen_app.widgets.page import MainAction, Page
from lightpen_app.work.selection import is_trial_ready
from lightpen_app.work.workbench import Workbench

DAY, SETUP, WELCOME = range(3)  # the views


class StartPage(ResponsiveLayout, Page):
    """Shows the day page; on request the set-up; before all, how to begin."""

    key = "start"
    narrow_below = 100 * GRID  # px; then it has one column

    def __init__(self, workbench: Workbench, services: Services = ()) -> None:
        super().__init__()
        verify, show = verify_step(services), self.step_requested.emit
        self._selection, self._tips = workbench.selection, workbench.library

        # Widgets: the order of making them is the order of the Tab key
        self._unknown_code = QuestionBar()
        self._unfinished = InterruptedPanel(
            workbench, services, lambda: self._setup.settle()
        )
        self._day = DayView(workbench, services)
        is_known = bool(workbench.selection.stations())
        self._setup = setup = SetupView(workbench, is_known=is_known)
        self._welcome = WelcomeView(workbench)
        self._last = LastResultPanel(workbench, can_verify=bool(verify))
        self._views = QStackedWidget()
        self._all_limits = LimitsControl(workbench, self)
        self._library = LibraryControl(workbench, setup.names, self._unknown_code, self)

        # Layout
        bars = self._unknown_code, self._unfinished
        vertical_layout(self, *bars, (self._views, 1), spacing=2 * GRID)
        fill(self._day.side, self._last, 1)
        for each in (self._day, setup, self._welcome):
            scroll = PageScroll()
            scroll.setWidget(each)
            self._views.addWidget(scroll)
        self._views.setCurrentIndex(SETUP if is_known else WELCOME)

        # Connections
        setup.edited.connect(self._show_entries)
        setup.names.station_entered.connect(self.show_missing_input)
        setup.limits.all_requested.connect(self._all_limits.open)
        setup.welcome_requested.connect(self.show_welcome)
        self._welcome.trial_ready.connect(lambda: self.step_requested.emit("swing"))
        self._welcome.trial_awaited.connect(self.show_welcome)
        self._welcome.station_begun.connect(self.show_setup)
        setup.folder.change_requested.connect(self.data_folder_requested)
        setup.done.connect(self.show_day)
        self._day.setup_requested.connect(self.show_setup)
        self._day.changed.connect(self.changed)
        self._day.step_requested.connect(self.step_requested)
        self._day.code_entered.connect(self._library.take_code)
        self._library.chosen.connect(setup.choose_item)
        self._unknown_code.declined.connect(setup.ask_for_tip_again)
        self._unfinished.step_requested.connect(self.step_requested)
        self._last.verification_requested.connect(self._setup.settle)
        self._last.verification_requested.connect(lambda: show(verify))
        workbench.folder_watch.fault_changed.connect(setup.folder.set_fault)
        workbench.library.changed.connect(self._show_entries)
        workbench.selection.changed.connect(self._on_selected)

        self._use_room()
        self._refresh()

    @property
    def is_day(self) -> bool:
        """Whether the day page is shown, and not the set-up of the station."""
        return self._shows(DAY)

    def _shows(self, view: int) -> bool:
        return self._views.currentIndex() == view

    @override
    def heading(self) -> str:
        if self._shows(WELCOME):
            return self.tr("Where is the tip of the pen?")
        return self.title() if self.is_day else self.tr("Set up station")

    @override
    def lead(self) -> str:
        if self.is_day:
            return self.tr("Choose a tip, seat it in the cone and start the swing.")
        return self._welcome.lead() if self._shows(WELCOME) else self._setup.lead()

    @override
    def is_complete(self) -> bool:
        return not self._setup.why_not_on()

    @override
    def main_action(self) -> MainAction:
        why_not = self._setup.why_not_on()
        if self._shows(WELCOME):
            why_not = self.tr("Choose how to begin.")
        if not self.is_day:
            return MainAction(self.tr("Continue to the camera"), why_not)
        action = self._day.main_action()
        return MainAction(action.text, why_not or action.why_not)

    @override
    def run_main_action(self) -> None:
        self._setup.settle()
        if self.is_day:
            self._day.run_main_action()
        else:
            super().run_main_action()

    @override
    def show_missing_input(self) -> None:
        if self._shows(WELCOME):
            self._welcome.first.setFocus()
            return
        if self._setup.typed().start_missing_inputs():
            self.show_setup()

    @override
    def first_control(self) -> QWidget | None:
        if self._shows(WELCOME):
            return self._welcome.first
        return self._day.first_control() if self.is_day else None

    @override
    def entered(self) -> None:
        self._setup.names.set_stations(self._selection.stations())
        self._tips.refresh()
        self._last.look_up()
        if not self._setup.typed().start_missing_inputs():
            self.show_day()
        self._day.start()

    @override
    def left(self) -> None:
        self._day.stop()
        self._setup.settle()
        self._setup.forget_typed()

    @override
    def shut_down(self) -> None:
        self._day.stop()
        for each in (self._unfinished, self._last, self._all_limits):
            each.shut_down()

    def show_day(self) -> None:
        """Show the tips of the station."""
        self._show_view(DAY)

    def show_setup(self) -> None:
        """Show the settings page."""
        self._views.setCurrentIndex(SETUP)
        missing = self._setup.typed().start_missing_inputs()
        first = missing[0] if missing else MissingInput.STATION
        if first not in (MissingInput.PEN, MissingInput.TIP):
            self._setup.set_more(True)
        if self.isVisible():
            self._setup.names.focus_missing_input(first)
        self._show_entries()

    def show_welcome(self) -> None:
        """Show how to begin."""
        self._show_view(WELCOME)

    def _show_view(self, view: int) -> None:
        self._views.setCurrentIndex(view)
        control = self.first_control()
        if control is not None and self.isVisible():
            control.setFocus()
        self._show_entries()

    @override
    def _use_room(self) -> None:
        is_narrow = self._room.is_narrow
        self._day.set_narrow(is_narrow)
        self._setup.set_narrow(is_narrow)
        self._welcome.set_narrow(is_narrow)

    @override
    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        if not event.spontaneous():
            self._unfinished.search()

    @override
    def _refresh(self) -> None:
        self._library.refresh()
        self._show_entries()

    def _show_entries(self) -> None:
        self._setup.set_why_not_done(self._setup.why_not_on())
        self.changed.emit()

    def _on_selected(self, before: Preparation) -> None:
        now = self._selection.preparation
        if is_trial_ready(now) and not is_trial_ready(before) and self.isVisible():
            self.show_day()
            self.step_requested.emit("swing")
        if before.names != now.names or before.origin is not now.origin:
            self._library.refresh()
        if not before.names.station and not now.start_missing_inputs():
            self.show_day()  # the station is known from before
        self._show_entries()
