"""The shell leads from step to step, by mouse and by keys alone."""

from collections.abc import Callable, Iterator

import pytest
from PySide6.QtCore import QEvent, QPoint, QPointF, QRect, Qt, QUrl
from PySide6.QtGui import QKeyEvent, QMouseEvent, QTextDocument
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QApplication,
    QCheckBox,
    QLineEdit,
    QMenu,
    QMessageBox,
    QPushButton,
    QTextBrowser,
    QVBoxLayout,
    QWidget,
)
from pytestqt.qtbot import QtBot
from typing_extensions import override

from lightpen.model.names import Origin
from lightpen.record.swings.header import Names
from lightpen_app.look.languages import LanguageSwitch
from lightpen_app.look.theme import Appearance
from lightpen_app.shell.main_window import MainWindow
from lightpen_app.shell.menus import HelpWindow
from lightpen_app.shell.page_area import ActionBar, NoticeBar
from lightpen_app.shell.sidebar import StepButton, StepState, Subject
from lightpen_app.widgets.bars import Question, QuestionBar
from lightpen_app.widgets.fitting import FittedText, FittedWindow, fitted_place
from lightpen_app.widgets.operator_view import OperatorValue
from lightpen_app.widgets.page import MainAction, Page, step_titles
from lightpen_app.work.job import Notifications
from lightpen_app.work.settings import Preferences, Settings
from lightpen_resources import SOURCE_LANGUAGE

Key = Qt.Key


class Leaf(Page):
    """A page that notes what happens to it."""

    def __init__(self, name: str) -> None:
        super().__init__()
        self.key = name.lower()
        self.name = name
        self.closed_because = ""
        self.why_not = ""
        self.at_screen = False
        self.hands_free = False
        self.question = ""
        self.log: list[str] = []
        self.field = QLineEdit()
        self.button = QPushButton(name)
        self.asks = QuestionBar()
        self.asks.set_words(lambda: Question("Really?", "Yes", "No"))
        layout = QVBoxLayout(self)
        layout.addWidget(self.asks)
        layout.addWidget(self.field)
        layout.addWidget(self.button)

    @override
    def title(self) -> str:
        return self.name

    @override
    def is_complete(self) -> bool:
        return bool(self.field.text())

    @override
    def why_closed(self) -> str:
        return self.closed_because

    @override
    def main_action(self) -> MainAction:
        return MainAction(f"Leave {self.name}", self.why_not, self.at_screen)

    @override
    def is_hands_free(self) -> bool:
        return self.hands_free

    @override
    def toggle_pause(self) -> None:
        self.log.append("pause")

    @override
    def entered(self) -> None:
        self.log.append("entered")

    @override
    def left(self) -> None:
        self.log.append("left")

    @override
    def unsaved(self) -> str:
        return self.question

    @override
    def shut_down(self) -> None:
        self.log.append("shut down")


class Shell:
    """A window over three pages."""

    def __init__(self, settings: Settings) -> None:
        self.pages = [Leaf("Start"), Leaf("Camera"), Leaf("Swing")]
        self.chosen: list[Preferences] = []
        self.notifications = Notifications()
        self.window = MainWindow(
            self.pages, settings, Preferences(), self.notifications
        )
        self.window.preferences_changed.connect(self.chosen.append)

    @property
    def shown(self) -> str:
        return self.window.page().title()

    @property
    def main_button(self) -> QPushButton:
        button = self.window.findChild(QPushButton, "main_button")
        assert isinstance(button, QPushButton)
        return button


@pytest.fixture
def shell(qtbot: QtBot, settings: Settings) -> Shell:
    shell = Shell(settings)
    qtbot.addWidget(shell.window)
    shell.window.show()
    qtbot.waitActive(shell.window).__enter__()
    return shell


@pytest.fixture
def press(qtbot: QtBot) -> Callable[[Key], None]:
    """Press a key where the focus is, as a keyboard does."""

    def press_key(key: Key) -> None:
        target = QApplication.focusWidget() or QApplication.activeWindow()
        assert target is not None
        QTest.keyClick(target, key)

    return press_key


def test_a_shell_without_pages_is_refused(settings: Settings) -> None:
    with pytest.raises(ValueError, match="at least one page"):
        MainWindow([], settings, Preferences(), Notifications())


def test_the_main_button_leads_to_the_next_page(shell: Shell, qtbot: QtBot) -> None:
    QTest.mouseClick(shell.main_button, Qt.MouseButton.LeftButton)

    assert shell.shown == "Camera"
    assert shell.pages[0].log == ["entered", "left"]
    assert shell.pages[1].log == ["entered"]
    assert shell.main_button.text() == "Leave Camera"


@pytest.mark.parametrize("key", [Key.Key_Return, Key.Key_Enter, Key.Key_PageDown])
def test_keys_press_the_main_button_even_from_a_field(
    shell: Shell, press: Callable[[Key], None], key: Key
) -> None:
    shell.pages[0].field.setFocus()

    press(key)

    assert shell.shown == "Camera"


def test_page_up_goes_back_and_keeps_what_was_typed(
    shell: Shell, press: Callable[[Key], None]
) -> None:
    shell.pages[0].field.setText("LP-04")
    press(Key.Key_PageDown)
    press(Key.Key_PageUp)

    assert shell.shown == "Start"
    assert shell.pages[0].field.text() == "LP-04"


def test_enter_on_another_button_presses_that_one(
    shell: Shell, qtbot: QtBot, press: Callable[[Key], None]
) -> None:
    shell.pages[0].button.setFocus()

    with qtbot.waitSignal(shell.pages[0].button.clicked):
        press(Key.Key_Return)

    assert shell.shown == "Start"


def test_enter_on_a_check_box_presses_the_main_button(
    shell: Shell, press: Callable[[Key], None]
) -> None:
    box = QCheckBox(shell.pages[0])
    box.show()
    box.setFocus()

    press(Key.Key_Return)

    assert not box.isChecked()
    assert shell.shown == "Camera"


def test_escape_neither_leaves_the_page_nor_closes_the_window(
    shell: Shell, press: Callable[[Key], None]
) -> None:
    shell.pages[0].hands_free = True
    shell.pages[0].changed.emit()

    press(Key.Key_Escape)

    assert shell.window.isVisible()
    assert shell.pages[0].log == ["entered"]


def test_a_key_pressed_twice_leads_on_by_one_step(
    shell: Shell, press: Callable[[Key], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("lightpen_app.shell.page_area.GUARD_MS", 60_000)

    for key in (Key.Key_Return, Key.Key_Return, Key.Key_PageDown):
        press(key)
    QTest.mouseClick(shell.main_button, Qt.MouseButton.LeftButton)

    assert shell.shown == "Camera"


def test_a_key_meant_for_what_the_button_did_before_does_nothing(
    shell: Shell, press: Callable[[Key], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("lightpen_app.shell.page_area.GUARD_MS", 60_000)
    shell.pages[0].name = "Another"
    shell.pages[0].changed.emit()

    press(Key.Key_Return)

    assert shell.pages[0].log == ["entered"]


def test_an_open_question_disables_the_main_button(
    shell: Shell, press: Callable[[Key], None]
) -> None:
    question = shell.pages[0].asks
    question.ask()

    press(Key.Key_PageDown)

    assert shell.shown == "Start"
    assert not shell.main_button.isEnabled()
    assert "Answer the question first." in shell.window.words()

    question.hide()
    press(Key.Key_PageDown)
    assert shell.shown == "Camera"


def test_a_main_action_that_is_not_possible_says_why(
    shell: Shell, press: Callable[[Key], None]
) -> None:
    shell.pages[0].why_not = "Choose the pen first."
    shell.pages[0].changed.emit()

    press(Key.Key_Return)

    assert shell.shown == "Start"
    assert not shell.main_button.isEnabled()
    assert shell.main_button.accessibleDescription() == "Choose the pen first."
    assert "Choose the pen first." in shell.window.words()


def test_the_same_sentence_does_not_stand_twice_in_the_bar(shell: Shell) -> None:
    page = shell.pages[0]
    page.why_not = "Choose the pen first."
    page.changed.emit()
    shell.notifications.show_status("Choose the pen first.")
    assert shell.window.words().count("Choose the pen first.") == 1

    page.why_not = ""
    page.changed.emit()
    assert shell.window.words().count("Choose the pen first.") == 1


def test_a_control_that_vanishes_gives_its_focus_to_no_button(shell: Shell) -> None:
    page = shell.pages[0]
    shell.window.activateWindow()
    going = QLineEdit()
    layout = page.layout()
    assert layout is not None
    layout.addWidget(going)
    going.show()
    going.setFocus()

    going.hide()

    assert page.field.hasFocus()


def test_the_main_button_keeps_the_focus_while_it_cannot_be_pressed(
    shell: Shell, press: Callable[[Key], None], qtbot: QtBot
) -> None:
    page = shell.pages[0]
    shell.window.activateWindow()
    shell.main_button.setFocus()
    for why_not in ("Wait a moment.", ""):
        page.why_not = why_not
        page.changed.emit()

    assert shell.main_button.hasFocus()

    page.field.setFocus()
    for why_not in ("Wait a moment.", ""):
        page.why_not = why_not
        page.changed.emit()
    assert page.field.hasFocus()


def test_a_page_leads_to_any_step_by_its_key(shell: Shell) -> None:
    shell.pages[0].step_requested.emit("swing")

    assert shell.shown == "Swing"
    shell.pages[2].step_requested.emit("start")
    assert shell.shown == "Start"


def test_the_window_opens_with_the_focus_on_the_first_control_of_the_page(
    shell: Shell,
) -> None:
    assert QApplication.focusWidget() is shell.pages[0].field


def test_a_closed_step_says_why_in_the_list_and_when_it_is_asked_for(
    shell: Shell,
) -> None:
    shell.pages[2].closed_because = "Needs a camera."
    shell.pages[0].changed.emit()
    steps = shell.window.steps()

    shell.window.go_to(2)

    assert steps[2].state is StepState.CLOSED
    assert steps[2].why_closed == "Needs a camera."
    assert shell.shown == "Start"
    assert "Needs a camera." in shell.window.words()


def test_every_step_can_be_reached_and_pressed_by_keys_alone(
    shell: Shell, qtbot: QtBot
) -> None:
    """Tab goes round all controls; from the list, Space opens a step."""
    seen = []
    while (widget := QApplication.focusWidget()) not in seen:
        seen.append(widget)
        QTest.keyClick(widget or shell.window, Key.Key_Tab)
    names = {widget.accessibleName() for widget in seen if widget is not None}

    assert {"Start, now", "Camera, to do", "Swing, to do"} <= names
    assert shell.main_button in seen
    assert shell.pages[0].field in seen

    camera = next(w for w in seen if w and w.accessibleName() == "Camera, to do")
    QTest.keyClick(camera, Key.Key_Space)
    assert shell.shown == "Camera"


def test_b_mutes_but_can_be_typed(shell: Shell, press: Callable[[Key], None]) -> None:
    shell.pages[0].field.setFocus()
    press(Key.Key_B)
    assert shell.pages[0].field.text() == "b"
    assert shell.chosen == []

    shell.main_button.setFocus()
    press(Key.Key_B)
    press(Key.Key_B)

    assert [preferences.muted for preferences in shell.chosen] == [True, False]
    assert "Sounds are on." in shell.window.words()


def test_f11_opens_the_operator_view_and_escape_leaves_only_that(
    shell: Shell, qtbot: QtBot
) -> None:
    view = shell.window.operator_view
    QTest.keyClick(shell.window, Key.Key_F11)
    assert view.isVisible()

    QTest.keyClick(view, Key.Key_Escape)

    assert not view.isVisible()
    assert shell.window.isVisible()
    assert shell.pages[0].log == ["entered"]
    QTest.keyClick(shell.window, Key.Key_F11)
    assert view.isVisible()
    QTest.keyClick(view, Key.Key_F11)
    assert not view.isVisible()


def test_the_operator_view_takes_the_keys_of_a_remote(
    shell: Shell, qtbot: QtBot
) -> None:
    view, page = shell.window.operator_view, shell.pages[0]
    page.hands_free = True
    page.field.setText("done")
    QTest.keyClick(shell.window, Key.Key_F11)

    QTest.keyClick(view, Key.Key_Space)
    QTest.keyClick(view, Key.Key_PageDown)

    assert shell.shown == "Camera"
    assert page.log == ["entered", "pause", "left"]


def test_space_presses_the_button_that_has_the_focus_and_pauses_elsewhere(
    shell: Shell, press: Callable[[Key], None]
) -> None:
    page = shell.pages[0]
    page.hands_free = True
    page.changed.emit()
    page.button.clicked.connect(lambda: page.log.append("clicked"))

    page.button.setFocus()
    press(Key.Key_Space)
    page.setFocus()
    press(Key.Key_Space)

    assert page.log == ["entered", "clicked", "pause"]


def test_the_operator_view_goes_nowhere_behind_the_operators_back(shell: Shell) -> None:
    view, page = shell.window.operator_view, shell.pages[0]
    QTest.keyClick(shell.window, Key.Key_F11)
    keys = (Key.Key_Return, Key.Key_PageDown, Key.Key_PageUp)

    page.field.setText("done")  # but the page is for somebody at the screen
    for key in keys:
        QTest.keyClick(view, key)
    page.hands_free = True
    page.field.clear()  # and now something is missing, which it would ask about
    for key in keys:
        QTest.keyClick(view, key)

    assert shell.shown == "Start"


def test_the_operator_view_names_pen_origin_notice_and_the_key_that_leaves_it(
    shell: Shell,
) -> None:
    QTest.keyClick(shell.window, Key.Key_F11)
    view = shell.window.operator_view

    shell.window.set_subject(Subject(Names(pen="LP-04", tip="T-10"), Origin.RECORDED))
    shell.notifications.notify("The disk is full.", "The disk is full.")

    words = [text.text() for text in view.findChildren(FittedText) if text.isVisible()]
    subject = "Pen LP-04  \u00b7  Tip T-10  \u00b7  RECORDED"
    assert {subject, "The disk is full."} <= set(words)
    assert any("Esc" in text for text in words)
    shell.notifications.withdraw("The disk is full.")
    assert not any(
        text.isVisible() and "disk" in text.text()
        for text in view.findChildren(FittedText)
    )


def test_nobody_looks_at_images_on_a_page_without_them_or_at_a_window_put_away(
    shell: Shell, qtbot: QtBot
) -> None:
    reported: list[bool] = []
    shell.window.attention_changed.connect(reported.append)
    shell.pages[1].shows_images = True

    shell.window.go_to(1)
    shell.window.showMinimized()
    QTest.keyClick(shell.window, Key.Key_F11)  # the operator still looks
    QTest.keyClick(shell.window.operator_view, Key.Key_F11)
    shell.window.showNormal()
    shell.window.go_to(0)

    assert reported == [True, False, True, False, True, False]


def test_what_must_be_pressed_at_the_screen_is_not_pressed_from_afar(
    shell: Shell, press: Callable[[Key], None]
) -> None:
    shell.pages[0].at_screen = True
    shell.pages[0].hands_free = True
    shell.pages[0].field.setText("done")
    view = shell.window.operator_view
    QTest.keyClick(shell.window, Key.Key_F11)
    QTest.keyClick(view, Key.Key_PageDown)
    QTest.keyClick(view, Key.Key_Return)
    QTest.keyClick(view, Key.Key_F11)
    QTest.keyClick(shell.window, Key.Key_PageDown)
    assert shell.shown == "Start"
    assert "Press this button at the computer." in shell.window.words()

    QTest.keyClick(shell.window, Key.Key_Return)

    assert shell.shown == "Camera"


METHOD = {  # the title of the description, and a word of it
    "en": ("Method: tip centre and uncertainty", "restricted maximum likelihood"),
    "zh_CN": ("测头中心及其不确定度", "最大似然"),
}


@pytest.mark.parametrize("language", METHOD)
def test_the_help_of_review_links_how_the_tip_is_found(
    language: str, qtbot: QtBot
) -> None:
    window = HelpWindow()
    qtbot.addWidget(window)
    window.set_topic("review", language)
    window.show()

    browser = window.findChild(QTextBrowser)
    assert browser is not None
    QTest.keyClick(browser, Key.Key_Tab)
    QTest.keyClick(browser, Key.Key_Return)

    title, method = METHOD[language]
    assert title in window.text().splitlines()[0]
    assert method in window.text()
    figure = QTextDocument.ResourceType.ImageResource.value
    assert browser.loadResource(figure, QUrl("method.png")) is not None


def test_f11_works_while_the_help_is_in_front(shell: Shell) -> None:
    QTest.keyClick(shell.window, Key.Key_F1)

    QTest.keyClick(shell.window.help_window, Key.Key_F11)

    assert shell.window.operator_view.isVisible()


def test_a_page_speaks_through_the_window(shell: Shell) -> None:
    page = shell.pages[0]
    shell.notifications.show_status("21 images a second")
    shell.window.set_subject(Subject(Names(pen="LP-04", tip="T-10"), Origin.SIMULATED))
    shell.notifications.notify(page.key, "The file holds no LED.")
    page.operator_value_changed.emit(OperatorValue(instruction="Tilt right"))

    words = shell.window.words()

    assert {
        "21 images a second",
        "Pen LP-04\nTip T-10",
        "The file holds no LED.",
    } <= set(words)
    assert shell.window.operator_view.value().instruction == "Tilt right"
    shell.notifications.withdraw(page.key)
    assert "The file holds no LED." not in shell.window.words()


def test_what_a_page_said_in_one_language_does_not_stay_in_another(
    shell: Shell, qapp: QApplication, qtbot: QtBot
) -> None:
    shell.notifications.show_status("26 entries")
    assert "26 entries" in shell.window.words()

    LanguageSwitch(qapp).set_language("zh_CN")

    qtbot.waitUntil(lambda: "26 entries" not in shell.window.words())


def test_f1_shows_the_help_of_the_step(shell: Shell, qtbot: QtBot) -> None:
    shell.window.advance()

    QTest.keyClick(shell.window, Key.Key_F1)

    assert "Stray light" in shell.window.help_window.text()
    QTest.keyClick(shell.window.help_window, Key.Key_Escape)
    assert not shell.window.help_window.isVisible()


@pytest.mark.qt_log_ignore(
    "^This plugin does not support (raise|grabbing)", extend=True
)
def test_options_open_by_key_and_change_the_appearance(
    shell: Shell, qtbot: QtBot
) -> None:
    QTest.keyClick(shell.window, Key.Key_F10)
    down, right, enter = Key.Key_Down, Key.Key_Right, Key.Key_Return
    for key in (down, down, right, down, enter):
        menu = QApplication.activePopupWidget()
        assert isinstance(menu, QMenu)
        QTest.keyClick(menu, key)
    assert [preferences.appearance for preferences in shell.chosen] == [
        Appearance.LIGHT
    ]


def test_an_error_of_a_page_goes_with_it_but_a_crash_stays(shell: Shell) -> None:
    shell.notifications.notify(shell.pages[0].key, "The file holds no LED.")
    shell.window.go_to(1)
    assert "The file holds no LED." not in shell.window.words()

    shell.notifications.notify("crash", "See /data/crash-1.txt")
    shell.window.go_to(0)

    assert any("/data/crash-1.txt" in each for each in shell.window.words())


def test_the_present_step_is_always_in_view(qtbot: QtBot, settings: Settings) -> None:
    names = "Start", "Camera", "LEDs", "Swing", "Review", "Verify", "History"
    pages = [Leaf(name) for name in names]
    window = MainWindow(pages, settings, Preferences(), Notifications())
    qtbot.addWidget(window)
    window.resize(940, 500)
    window.show()
    for i in (6, 0, 5):
        window.go_to(i)
        buttons = window.findChildren(StepButton)
        (present,) = (b for b in buttons if b.value().title == names[i])
        assert present.visibleRegion().boundingRect().height() == present.height()


def test_later_pages_are_made_after_the_paint_and_named_before(
    qtbot: QtBot, settings: Settings
) -> None:
    made = [Leaf("Start")]

    def more() -> Iterator[Page]:
        for name in list(step_titles().values())[1:]:
            made.append(Leaf(name))
            yield made[-1]

    window = MainWindow(
        made[:1], settings, Preferences(), Notifications(), later=more()
    )
    qtbot.addWidget(window)
    assert [step.title for step in window.steps()] == [*step_titles().values()]
    assert len(made) == 1

    with qtbot.waitSignal(window.completed):
        window.show()

    assert list(window.pages()) == made
    assert [step.title for step in window.steps()] == [*step_titles().values()]
    assert [step.state for step in window.steps()].count(StepState.NOW) == 1


def test_a_step_chosen_before_its_page_is_made_waits_for_it_alone(
    qtbot: QtBot, settings: Settings
) -> None:
    names = list(step_titles().values())
    made, shown = [Leaf("Start")], list[Page]()

    def more() -> Iterator[Page]:
        for name in names[1:]:
            made.append(Leaf(name))
            yield made[-1]
            if len(made) == 2:
                window.findChildren(StepButton)[3].click()
            shown.append(window.page())

    window = MainWindow(
        made[:1], settings, Preferences(), Notifications(), later=more()
    )
    qtbot.addWidget(window)
    with qtbot.waitSignal(window.completed):
        window.show()

    assert shown == [made[0], made[0], *[made[3]] * (len(names) - 3)]


def test_pages_made_later_come_before_the_main_button_for_the_tab_key(
    qtbot: QtBot, settings: Settings, press: Callable[[Key], None]
) -> None:
    first, second = Leaf("Start"), Leaf("Camera")
    window = MainWindow(
        *([first], settings, Preferences(), Notifications(), iter([second])),
        lambda: ("Start", "Camera"),
    )
    qtbot.addWidget(window)
    with qtbot.waitSignal(window.completed):
        window.show()
    qtbot.waitActive(window).__enter__()
    window.go_to(1)
    order = [second.field, second.button]

    for each in order:
        assert each.hasFocus()
        press(Qt.Key.Key_Tab)

    (bar,) = window.findChildren(ActionBar)
    back, main = bar.findChildren(QPushButton)
    assert (back.text(), main.objectName()) == ("Back", "main_button")
    assert back.hasFocus()
    press(Qt.Key.Key_Tab)
    assert main.hasFocus()


def test_a_notice_pushes_the_page_down_and_covers_nothing(shell: Shell) -> None:
    page, window = shell.pages[0], shell.window
    window.activateWindow()
    page.field.setFocus()
    before = page.mapTo(window, QPoint()).y()

    shell.notifications.notify("cause", "The disk is full. " * 12)
    QApplication.processEvents()

    notice = notice_of(window)
    bottom = notice.mapTo(window, QPoint(0, notice.height())).y()
    assert page.mapTo(window, QPoint()).y() >= max(bottom, before)
    assert page.field.hasFocus()

    shell.notifications.withdraw("cause")
    QApplication.processEvents()
    assert page.mapTo(window, QPoint()).y() == before


def notice_of(window: MainWindow) -> QWidget:
    (notice,) = window.findChildren(NoticeBar)
    assert isinstance(notice, NoticeBar)
    return notice


def test_why_a_step_was_closed_is_said_until_it_is_open(shell: Shell) -> None:
    shell.pages[2].closed_because = "Swing the pen first."
    shell.window.go_to(2)
    shell.pages[0].changed.emit()
    assert "Swing the pen first." in shell.window.words()

    shell.pages[2].closed_because = ""
    shell.pages[0].changed.emit()

    assert "Swing the pen first." not in shell.window.words()


def test_that_someone_must_be_at_the_screen_is_said_until_they_need_not(
    shell: Shell,
) -> None:
    shell.pages[0].at_screen = True
    QTest.keyClick(shell.window, Key.Key_PageDown)
    shell.pages[0].changed.emit()
    assert "Press this button at the computer." in shell.window.words()

    shell.pages[0].at_screen = False  # as once the tip is accepted
    shell.pages[0].changed.emit()

    assert "Press this button at the computer." not in shell.window.words()


def test_a_page_takes_no_notice_away_that_another_page_raised(shell: Shell) -> None:
    shell.notifications.notify(shell.pages[1].key, "There is no camera.")
    shell.notifications.notify(shell.pages[0].key, "The file holds no LED.")
    shell.notifications.withdraw(shell.pages[1].key)
    assert "The file holds no LED." in shell.window.words()

    shell.notifications.withdraw(shell.pages[0].key)
    assert "The file holds no LED." not in shell.window.words()


def test_closing_leaves_the_page_and_stops_every_page(shell: Shell) -> None:
    shell.window.operator_view.show()

    assert shell.window.close()

    assert shell.pages[0].log == ["entered", "left", "shut down"]
    assert shell.pages[2].log == ["shut down"]
    assert not shell.window.operator_view.isVisible()


@pytest.mark.parametrize(
    ("answer", "closes"), [("Keep open", False), ("Close anyway", True)]
)
def test_closing_asks_where_something_would_be_lost(
    shell: Shell, monkeypatch: pytest.MonkeyPatch, answer: str, closes: bool
) -> None:
    shell.pages[1].question = "The LED table has unsaved changes."
    asked = []

    def choose(box: QMessageBox) -> int:
        asked.append(box.text())
        (button,) = [each for each in box.buttons() if each.text() == answer]
        button.click()
        return 0

    monkeypatch.setattr(QMessageBox, "exec", choose)

    assert shell.window.close() is closes

    assert asked == ["The LED table has unsaved changes."]
    assert ("shut down" in shell.pages[1].log) is closes
    shell.pages[1].question = ""


def test_closing_where_nobody_can_answer_asks_nothing(
    shell: Shell, monkeypatch: pytest.MonkeyPatch
) -> None:
    shell.pages[1].question = "The LED table has unsaved changes."
    monkeypatch.setattr(QMessageBox, "exec", lambda box: pytest.fail(box.text()))

    shell.window.close_unasked()

    assert not shell.window.isVisible()
    assert shell.pages[1].log == ["shut down"]


def test_the_window_is_gone_before_it_waits_for_what_is_under_way(shell: Shell) -> None:
    seen: list[bool] = []
    shell.window.closing.connect(lambda: seen.append(shell.window.isVisible()))
    shell.window.close()

    assert seen == [False]


def test_the_window_comes_back_where_it_was(
    shell: Shell, qtbot: QtBot, settings: Settings
) -> None:
    shell.window.setGeometry(20, 40, 760, 640)
    place = shell.window.geometry()
    shell.window.close()

    again = Shell(settings)
    qtbot.addWidget(again.window)

    assert again.window.geometry() == place


@pytest.mark.parametrize("place", [(20, 30, 3000, 2000), (5000, -700, 760, 640)])
def test_a_window_of_another_screen_comes_back_within_this_one(
    shell: Shell, qtbot: QtBot, settings: Settings, place: tuple[int, int, int, int]
) -> None:
    shell.window.setGeometry(*place)
    shell.window.close()

    again = Shell(settings)
    qtbot.addWidget(again.window)
    again.window.show()

    available = again.window.screen().availableGeometry()
    assert available.contains(again.window.geometry())


@pytest.mark.parametrize(
    ("place", "fitted"),
    [
        ((10, 70, 700, 400), (10, 70, 700, 400)),
        ((10, 50, 1280, 800), (4, 62, 952, 470)),
        ((-300, 0, 700, 400), (4, 62, 700, 400)),
        ((900, 500, 700, 400), (256, 132, 700, 400)),
    ],
)
def test_a_place_is_changed_only_as_far_as_the_screen_asks_for(
    place: tuple[int, int, int, int], fitted: tuple[int, int, int, int]
) -> None:
    available = QRect(0, 30, 960, 510)  # below a panel

    assert fitted_place(QRect(*place), available) == QRect(*fitted)


def test_a_window_opens_over_its_parent_and_stays_where_it_is_moved(
    shell: Shell, qtbot: QtBot
) -> None:
    class Window(FittedWindow, QWidget):
        pass

    shell.window.setGeometry(60, 80, 640, 480)
    window = Window(shell.window, Qt.WindowType.Window)
    window.resize(300, 200)
    window.show()
    assert window.geometry().center() == shell.window.geometry().center()

    window.move(90, 100)
    place = window.geometry()
    window.hide()
    window.show()
    assert window.geometry() == place


def test_a_double_click_on_the_main_button_leads_one_step_on(shell: Shell) -> None:
    button = shell.main_button
    QTest.mouseClick(button, Qt.MouseButton.LeftButton)
    at = QPointF(button.rect().center())
    left, none = Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier
    for kind in (QEvent.Type.MouseButtonDblClick, QEvent.Type.MouseButtonRelease):
        event = QMouseEvent(kind, at, button.mapToGlobal(at), left, left, none)
        QApplication.sendEvent(button, event)

    assert shell.shown == "Camera"


@pytest.mark.parametrize("key", [Key.Key_Return, Key.Key_PageDown])
def test_a_key_held_too_long_leads_one_step_on(shell: Shell, key: Key) -> None:
    shell.pages[0].field.setFocus()
    QTest.keyClick(shell.pages[0].field, key)
    held = QKeyEvent(
        QEvent.Type.KeyPress, key, Qt.KeyboardModifier.NoModifier, "", True
    )
    QApplication.sendEvent(shell.pages[1].field, held)

    assert shell.shown == "Camera"


def test_the_help_that_is_read_stays_when_the_language_changes(
    shell: Shell, qapp: QApplication
) -> None:
    window = shell.window.help_window
    window.set_topic("start", SOURCE_LANGUAGE)
    english = window.text()
    shell.window.go_to(1)
    LanguageSwitch(qapp).set_language("zh_CN")
    QApplication.processEvents()

    assert window.text() == english
