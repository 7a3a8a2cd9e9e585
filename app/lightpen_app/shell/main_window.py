"""The window of the wizard: steps at the left, one page, one main button."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

from PySide6.QtCore import QEvent, QPoint, QSize, Qt, QTimer, Signal
from PySide6.QtGui import QAction, QCloseEvent, QIcon, QKeyEvent, QPaintEvent
from PySide6.QtWidgets import (
    QAbstractButton,
    QApplication,
    QCheckBox,
    QMainWindow,
    QWidget,
)
from typing_extensions import override

from lightpen_app.face import Service
from lightpen_app.look.layouts import grid_layout
from lightpen_app.look.theme import GRID, Tone
from lightpen_app.shell.menus import HelpWindow, OptionsMenu, is_agreed_to_close
from lightpen_app.shell.page_area import ActionBar, PageArea, focus_first
from lightpen_app.shell.sidebar import (
    Sidebar,
    Status,
    Step,
    StepButton,
    Subject,
    list_steps,
)
from lightpen_app.widgets.bars import AskingBar
from lightpen_app.widgets.controls import ENTER_KEYS, PAGE_KEYS
from lightpen_app.widgets.fitting import FRAME, ResponsiveLayout, fit_screen
from lightpen_app.widgets.number_field import is_refusing
from lightpen_app.widgets.operator_view import OperatorView
from lightpen_app.widgets.page import MainAction, Page, step_titles
from lightpen_app.widgets.state_banner import StatusMessage
from lightpen_app.work.job import Notifications
from lightpen_app.work.settings import Preferences, Settings
from lightpen_resources import RESOURCES

LEAST_SIZE = QSize(98 * GRID, 60 * GRID)  # fits 800 x 600, and 1280 x 800 at 150 %
FIRST_SIZE = QSize(160 * GRID, 100 * GRID)
PAINTED_MS = 50  # after the first paint, before slow work starts
OPTIONS = "options"  # cause of a notification
KEYS_THAT_LEAD_ON = (*ENTER_KEYS, *PAGE_KEYS)


class MainWindow(ResponsiveLayout, QMainWindow):
    """Shows one page at a time and leads from step to step.

    Keys: Enter and PageDown press the main button, PageUp goes back, Space pauses,
    F1 helps, F10 opens the options, F11 the operator view, B mutes. Escape does
    nothing here, so that it cannot end a capture.

    The pages are in the order of the steps; those in ``later`` are made one by one once
    the window is painted; ``titles`` are those of all. Notifications of a page, by its
    key, go with the page.
    """

    # Less is what a screen of 1920 x 1080 drawn at 200 % has.
    narrow_below, low_below = 150 * GRID, 80 * GRID  # px
    completed = Signal()  # the window was painted, and all pages are made
    preferences_changed = Signal(object)  # Preferences: the user chose otherwise
    log_requested = Signal()  # open the folder of the log
    # Whether anybody may be looking at live images now.
    attention_changed = Signal(bool)
    # Pages are shut down; receivers shut down shared objects and wait for them.
    closing = Signal()

    def __init__(
        self,
        pages: Sequence[Page],
        settings: Settings,
        preferences: Preferences,
        notifications: Notifications,
        later: Iterator[Page] | None = None,
        titles: Callable[[], Sequence[str]] = lambda: tuple(step_titles().values()),
    ) -> None:
        super().__init__()
        if not pages:
            raise ValueError("`pages` must hold at least one page.")
        self.setObjectName("main")
        self.setWindowIcon(QIcon(str(RESOURCES / "icons" / "lightpen.svg")))
        self._pages: list[Page] = []
        self._questions: list[list[AskingBar]] = []
        self._later, self._titles = later, titles
        self._services: list[Service] = []
        self._wanted: int | None = None  # page that was chosen before it was made
        self._is_painted = False
        self._settings = settings
        self._notifications = notifications
        self._now = 0
        self._asks = True

        # Widgets: the order of making them is the order of the Tab key
        self._sidebar = Sidebar()
        self._area = PageArea(pages[0])
        self._action_bar = ActionBar()
        self.operator_view = OperatorView()
        self.operator_view.set_distance_m(preferences.distance_m)
        self.help_window = HelpWindow()
        self._options = OptionsMenu(preferences, self)
        self._make_actions()

        # Layout
        central = QWidget()
        layout = grid_layout(central, spacing=0)
        layout.addWidget(self._sidebar, 0, 0, 2, 1)
        layout.addWidget(self._area, 0, 1)
        layout.addWidget(self._action_bar, 1, 1)
        layout.setRowStretch(0, 1)
        self.setCentralWidget(central)

        # Connections
        self._sidebar.step_chosen.connect(self._on_step_chosen)
        self._sidebar.operator_view.clicked.connect(self._operator_action.toggle)
        self._sidebar.help.clicked.connect(self._on_help_triggered)
        self._sidebar.options.clicked.connect(self._show_options)
        self._action_bar.main_pressed.connect(self._on_main_pressed)
        self._action_bar.back_pressed.connect(self.go_back)
        self._options.value_changed.connect(self.preferences_changed)
        self._options.value_changed.connect(
            lambda chosen: self.operator_view.set_distance_m(chosen.distance_m)
        )
        self._options.said.connect(self._action_bar.set_status)
        self._options.data_folder_chosen.connect(self._on_data_folder_chosen)
        self._options.log_requested.connect(self.log_requested)
        self.operator_view.closed.connect(
            lambda: self._operator_action.setChecked(False)
        )
        self.operator_view.advance_requested.connect(self._on_remote_advance)
        self.operator_view.pause_requested.connect(lambda: self.page().toggle_pause())
        self._area.notice.value_changed.connect(self.operator_view.set_notice)
        notifications.raised.connect(self._area.notice.show_text)
        notifications.withdrawn.connect(self._area.notice.drop)
        notifications.status_changed.connect(self._action_bar.set_status)
        self._sidebar.subject_changed.connect(self.operator_view.set_subject)
        for page in pages:
            self._add_page(page)
        application = QApplication.instance()
        assert isinstance(application, QApplication)
        application.focusChanged.connect(self._on_focus_changed)

        self._use_room()
        self._retranslate()
        if settings.restore_geometry(self):
            fit_screen(self)
        else:
            available = self.screen().availableGeometry()
            self.resize(FIRST_SIZE.boundedTo(available.size() - FRAME))
        self._pages[0].entered()
        self._refresh()
        self._focus_page()

    def pages(self) -> tuple[Page, ...]:
        """Return the pages in the order of the steps; create missing ones."""
        while self._make_page():
            pass
        return tuple(self._pages)

    def page(self) -> Page:
        """Return the page that is shown."""
        return self._pages[self._now]

    def go_to(self, index: int) -> None:
        """Show a page, or say why it is locked."""
        if index == self._now:
            return
        asked = self._page_at(index)
        why_closed = asked.why_closed()
        if why_closed:
            self._action_bar.set_status(
                why_closed, lambda: asked.why_closed() == why_closed
            )
            return
        self.page().left()
        self._now = index
        self._action_bar.set_status("")
        self._action_bar.guard()
        self._notifications.withdraw(*(page.key for page in self._pages))
        self._area.show_page(self.page())
        self._emit_attention()
        self.page().entered()
        self._refresh()
        self._focus_page()

    def show_step(self, key: str) -> None:
        """Show the page of a step by its key, or say why it is locked."""
        self.go_to([page.key for page in self.pages()].index(key))

    def go_back(self) -> None:
        """Show the page before this one."""
        if self._now > 0:
            self.go_to(self._now - 1)

    def advance(self) -> None:
        """Show the page after this one."""
        if self._now + 1 < len(self.steps()):
            self.go_to(self._now + 1)

    def press_main(self) -> None:
        """Press the main button, if it can be pressed."""
        self._action_bar.press_main()

    def close_unasked(self) -> None:
        """Close without a question, since nobody may be present."""
        self._asks = False
        self.close()

    def set_subject(self, subject: Subject) -> None:
        """Show the item and the origin of its images on every page."""
        self._sidebar.set_subject(subject)

    def add_service(self, service: Service) -> None:
        """Show what an extension remarks, and its entries among the options."""
        self._services.append(service)
        for entry in service.menu_entries():
            self._options.add_entry(entry, self)
        service.remark_changed.connect(self._show_remark)
        service.step_requested.connect(self.show_step)
        self.closing.connect(service.close)
        self._show_remark()

    def steps(self) -> tuple[Step, ...]:
        """Return the list of steps."""
        return self._sidebar.steps()

    def words(self) -> tuple[str, ...]:
        """Return the texts of the window outside the page."""
        texts = (
            self._sidebar.subject(),
            *self._area.words(),
            *self._action_bar.words(),
        )
        return tuple(filter(None, texts))

    @override
    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Take the keys that no control has taken."""
        key = event.key()
        if event.isAutoRepeat() and key in KEYS_THAT_LEAD_ON:
            return  # auto-repeat of a held key would run through all steps
        if key in ENTER_KEYS:
            button = _focused_button()
            if button is not None and not isinstance(button, QCheckBox):
                button.click()
            elif self.page().main_action().why_not:
                self.page().show_missing_input()
            else:
                self._action_bar.press_main()
        elif key == Qt.Key.Key_PageDown:
            self._on_advance_pressed()
        elif key == Qt.Key.Key_PageUp:
            self.go_back()
        else:
            super().keyPressEvent(event)

    @override
    def closeEvent(self, event: QCloseEvent) -> None:
        question = "\n\n".join(filter(None, (page.unsaved() for page in self._pages)))
        if self._asks and question and not is_agreed_to_close(self, question):
            event.ignore()
            return
        self._later = None
        self._settings.save_geometry(self)
        self.hide()  # jobs in progress may take long to end
        self.operator_view.close()
        self.help_window.close()
        self.page().left()
        for page in self._pages:
            page.shut_down()
        self.closing.emit()
        super().closeEvent(event)

    @override
    def changeEvent(self, event: QEvent) -> None:
        super().changeEvent(event)
        if event.type() == QEvent.Type.WindowStateChange:
            self.setUpdatesEnabled(not self.isMinimized())
            self._emit_attention()
        if event.type() == QEvent.Type.LanguageChange:
            self._retranslate()
            self._refresh()
            self.help_window.set_language(self._options.value().language)

    @override
    def paintEvent(self, event: QPaintEvent) -> None:
        super().paintEvent(event)
        if not self._is_painted:
            self._is_painted = True
            QTimer.singleShot(PAINTED_MS, self._make_more)

    def _make_more(self) -> None:
        """Make the pages while the window answers between them."""
        if self._make_page():
            QTimer.singleShot(0, self._make_more)
            if self._wanted is not None and self._wanted < len(self._pages):
                self._on_step_chosen(self._wanted)
        elif self.isVisible():
            self.completed.emit()

    def _make_page(self) -> bool:
        """Make the next page, and return whether there was one."""
        if self._later is None:
            return False
        page = next(self._later, None)
        if page is None:
            self._later = None
            self._area.order_tabs(
                *self._action_bar.findChildren(QAbstractButton),
                *self._sidebar.findChildren(StepButton),
            )
        else:
            self._add_page(page)
        self._refresh()
        return page is not None

    def _page_at(self, index: int) -> Page:
        """Return a page, made now if it has not been."""
        while index >= len(self._pages) and self._make_page():
            pass
        return self._pages[index]

    def _add_page(self, page: Page) -> None:
        self._pages.append(page)
        if len(self._pages) > 1:
            self._area.add_page(page)
        questions = page.findChildren(AskingBar)
        self._questions.append(questions)

        # Connections
        page.changed.connect(self._refresh)
        for question in questions:
            question.asking_changed.connect(self._refresh)
        page.advance_requested.connect(self.advance)
        page.step_requested.connect(self.show_step)
        page.operator_value_changed.connect(self.operator_view.set_value)
        page.data_folder_requested.connect(self._options.ask_data_folder)
        page.discovery_requested.connect(self._on_discovery_asked)

    def _make_actions(self) -> None:
        self._help_action = self._action(Qt.Key.Key_F1, self._on_help_triggered)
        self._operator_action = QAction(self, checkable=True)
        self._operator_action.setShortcut(Qt.Key.Key_F11)
        self._operator_action.toggled.connect(self._on_operator_toggled)
        self._action(Qt.Key.Key_F10, self._show_options)
        # A presenter's remote sends the page keys.
        self._hands_free_actions = (
            self._action(Qt.Key.Key_Space, self._on_space_pressed),
            self._action(Qt.Key.Key_PageDown, self._on_advance_pressed),
            self._action(Qt.Key.Key_PageUp, self.go_back),
        )
        everywhere = [self._operator_action, self._options.mute_action]
        self.addActions(everywhere)
        self.operator_view.addActions([self._help_action, *everywhere])
        self.help_window.addActions(everywhere)

    def _action(self, key: Qt.Key, slot: Callable[[], object]) -> QAction:
        action = QAction(self)
        action.setShortcut(key)
        action.setAutoRepeat(False)
        action.triggered.connect(lambda _=False: slot())
        self.addAction(action)
        return action

    @override
    def _use_room(self) -> None:
        self._area.set_room(self._room)
        self._sidebar.set_room(self._room)
        self._action_bar.set_room(self._room)

    def _refresh(self) -> None:
        """Show the status of the pages."""
        page = self.page()
        statuses = [
            Status(
                each.title(), each.is_complete(), each.why_closed(), each.is_doubtful()
            )
            for each in self._pages
        ]
        if self._later is not None:
            titles = self._titles()[len(statuses) :]
            statuses += [
                Status(title, complete=False, why_closed="") for title in titles
            ]
        action = self._main_action()
        is_said = bool(action.why_not)
        self._sidebar.set_steps(list_steps(statuses, self._now, is_reason_said=is_said))
        self._area.set_heading(page.heading(), page.lead(), page.lead_tone())
        self._action_bar.set_action(action, can_go_back=self._now > 0)
        for each in self._hands_free_actions:
            each.setEnabled(page.is_hands_free())

    def _main_action(self) -> MainAction:
        """Return the main action of the page, which waits for an open question."""
        action = self.page().main_action()
        questions = self._questions[self._now]
        if action.why_not or all(question.isHidden() for question in questions):
            return action
        return replace(action, why_not=self.tr("Answer the question first."))

    def _focus_page(self) -> None:
        if not focus_first(self.page()):
            self._action_bar.focus_main()

    def _on_focus_changed(self, before: QWidget | None, now: QWidget | None) -> None:
        """Let the page set the focus after the focused widget was removed.

        Otherwise Qt focuses the next widget, such as a button that Enter then presses.
        """
        is_button_here = isinstance(now, QAbstractButton) and now.window() is self
        if before is None or before.isVisible() or not is_button_here:
            return
        if self._area.isAncestorOf(before) and self.page().isAncestorOf(before):
            self._focus_page()

    def _on_discovery_asked(self) -> None:
        is_camera_known = self.page().key == "leds"
        for each in self._services:
            if each.discovers:
                each.discover(self, is_camera_known=is_camera_known)

    def _show_remark(self) -> None:
        remarks = (each.remark() for each in self._services)
        found = next((each for each in remarks if each.text), StatusMessage())
        self._sidebar.set_remark(found)

    def _show_options(self) -> None:
        menu = self._options
        corner = self._sidebar.options.mapToGlobal(QPoint(0, 0))
        menu.popup(corner - QPoint(0, menu.sizeHint().height()))

    def _on_step_chosen(self, index: int) -> None:
        """Show the page of a step, as soon as it is made."""
        is_made = index < len(self._pages) or not self._is_painted
        self._wanted = None if is_made else index
        if is_made:
            self.go_to(index)

    def _on_main_pressed(self) -> None:
        if not is_refusing(self.page()):
            self.page().run_main_action()

    def _on_advance_pressed(self) -> None:
        """Obey a presenter's remote, unless someone must be at the screen."""
        if self.page().main_action().at_screen:
            words = self.tr("Press this button at the computer.")
            self._action_bar.set_status(
                words, lambda: self.page().main_action().at_screen
            )
        else:
            self._action_bar.press_main()

    def _on_remote_advance(self) -> None:
        """Advance for an operator away from the screen, without questions."""
        page = self.page()
        if page.is_hands_free() and page.is_complete():
            self._on_advance_pressed()

    def _on_space_pressed(self) -> None:
        """Press the button that has the focus; pause where none has."""
        button = _focused_button()
        if button is None:
            self.page().toggle_pause()
        else:
            button.click()

    def _on_help_triggered(self) -> None:
        self.help_window.set_topic(self.page().key, self._options.value().language)
        self.help_window.show()
        self.help_window.activateWindow()

    def _on_operator_toggled(self, shown: bool) -> None:
        if shown:
            self.operator_view.open_beside(self)
        else:
            self.operator_view.close()
        self._emit_attention()

    def _emit_attention(self) -> None:
        """Emit whether live images can be seen now."""
        is_seen = not self.isMinimized() or self.operator_view.isVisible()
        self.attention_changed.emit(self.page().shows_images and is_seen)

    def _on_data_folder_chosen(self, words: str) -> None:
        self._notifications.notify(OPTIONS, words, Tone.ACTIVE)

    def _retranslate(self) -> None:
        self.setWindowTitle(self.tr("Pen tip calibration"))
        self._action_bar.set_status("")  # it is in the previous language
        self._show_remark()


def _focused_button() -> QAbstractButton | None:
    """Return the enabled button that has the focus."""
    focused = QApplication.focusWidget()
    if isinstance(focused, QAbstractButton) and focused.isEnabled():
        return focused
    return None
