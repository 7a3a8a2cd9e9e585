"""Fixtures of the application's tests: its own look, whatever the machine has."""

import gc
import shutil
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import replace
from pathlib import Path
from pkgutil import resolve_name
from threading import Event
from typing import Any, NoReturn, TypeAlias

import pytest
from PySide6.QtCore import (
    QDeadlineTimer,
    QEvent,
    QLocale,
    QPoint,
    Qt,
    QThreadPool,
    QTimer,
)
from PySide6.QtGui import QWindow
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QAbstractButton,
    QApplication,
    QCheckBox,
    QComboBox,
    QGroupBox,
    QLabel,
    QLineEdit,
    QListWidget,
    QMenu,
    QMessageBox,
    QScrollArea,
    QTabBar,
    QTableView,
    QTextEdit,
    QWidget,
)
from pytestqt.exceptions import TimeoutError as WaitedInVain
from pytestqt.qtbot import QtBot
from pytestqt.wait_signal import SignalBlocker
from tests.app.disk import disk_watch
from tests.app.patience import PATIENCE_MS
from typing_extensions import override

from lightpen.formats.opened_files import OpenedFiles
from lightpen.live.sources import SourceEnvironment
from lightpen.record.swings.header import Names
from lightpen.record.swings.reading import Record
from lightpen.record.swings.solving import solve_record
from lightpen.swing.preparation import SourceChoice
from lightpen_app.application import SWITCH_INTERVAL, Wizard
from lightpen_app.look.languages import LanguageSwitch
from lightpen_app.look.theme import DARK, apply_theme, load_fonts
from lightpen_app.work.job import Report, collect_if_due
from lightpen_app.work.settings import Settings
from lightpen_app.work.workbench import Workbench
from lightpen_extensions.simulator.camera import SkippingClock
from lightpen_extensions.simulator.hand import SimulatedOperator
from lightpen_extensions.simulator.scenes import Scene
from lightpen_extensions.simulator.simulator import SceneSimulator
from lightpen_extensions.simulator.swings import paper_camera
from lightpen_program.extensions import faces


class PatientBot(QtBot):
    """Waits as long as a loaded machine may take."""

    @override
    def waitUntil(
        self, callback: Callable[[], bool | None], *, timeout: int = PATIENCE_MS
    ) -> None:
        super().waitUntil(callback, timeout=timeout)

    @override
    def waitSignal(
        self, signal: object, *, timeout: int = PATIENCE_MS, **options: Any
    ) -> SignalBlocker:
        return super().waitSignal(signal, timeout=timeout, **options)


@pytest.fixture
def qtbot(qapp: QApplication, request: pytest.FixtureRequest) -> QtBot:
    return PatientBot(request)


@pytest.fixture(scope="session")
def dressed(qapp: QApplication) -> QApplication:
    sys.setswitchinterval(SWITCH_INTERVAL)
    QApplication.setStyle("Fusion")
    load_fonts()
    return qapp


@pytest.fixture(scope="session", autouse=True)
def kept_to_one_thread() -> Iterator[None]:
    """No other thread than that of the windows frees what tests leave behind."""
    gc.disable()
    yield
    gc.enable()


@pytest.fixture(autouse=True)
def collected(kept_to_one_thread: None) -> Iterator[None]:
    """What a test has closed is gone before the next one: each would be styled anew."""
    yield
    QThreadPool.globalInstance().waitForDone(PATIENCE_MS)  # its jobs report there
    QApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
    collect_if_due()


@pytest.fixture(autouse=True)
def window_off_the_disk() -> Iterator[None]:
    """A disk that does not answer stops no window: its thread touches no file."""
    disk_watch().take()
    yield
    assert disk_watch().take() == []


@pytest.fixture(autouse=True)
def look(dressed: QApplication) -> Iterator[None]:
    """Every test begins dark and in English."""
    before = QLocale()
    apply_theme(dressed, DARK)
    yield
    for switch in dressed.findChildren(LanguageSwitch):
        switch.remove()
        switch.deleteLater()
    QLocale.setDefault(before)


@pytest.fixture(autouse=True)
def unhurried(monkeypatch: pytest.MonkeyPatch) -> None:
    """Images come, and plots are drawn, less often than usual: each takes long."""
    monkeypatch.setattr("lightpen_extensions.simulator.camera.USUAL_FRAME_RATE", 7.0)
    monkeypatch.setattr("lightpen_app.steps.swing.page.PLOTTING_MS", 1000)
    # Deleted under a thread that still runs, it would end the process.
    monkeypatch.setattr("lightpen_app.work.workbench.LONGEST_FAREWELL", 60.0)
    # Nobody in a test presses a key twice by accident, unless it says so.
    monkeypatch.setattr("lightpen_app.shell.page_area.GUARD_MS", 0)
    monkeypatch.setattr("lightpen_app.steps.review.page.READING_MS", 0)


@pytest.fixture
def settings(tmp_path: Path) -> Iterator[Settings]:
    settings = Settings(tmp_path / "config" / "lightpen.json")
    yield settings
    assert settings.await_saved(120.0)


class HastyClock(SkippingClock):
    """A clock by which all goes `SPEED` times as fast, but waits for a slow machine.

    A live camera that goes by it misses no image, however late its reader is.
    """

    SPEED = 4

    @override
    def wait(self, seconds: float, wake: Event | None = None) -> bool:
        if wake is not None:
            wake.wait(seconds / self.SPEED)
        else:
            time.sleep(max(seconds, 0.0) / self.SPEED)
        return super().wait(seconds, wake)


@pytest.fixture(scope="session")
def small_scene() -> Scene:
    """The paper's scene seen with a quarter of the pixels."""
    return Scene(camera=paper_camera(binning=2))


@pytest.fixture(scope="session")
def around(small_scene: Scene) -> SourceEnvironment:
    """Return the small scene, in which all goes four times as fast as usual."""
    return SourceEnvironment(
        SceneSimulator(small_scene), HastyClock(), found_cameras=tuple
    )


SolvingOn: TypeAlias = Callable[[], AbstractContextManager[None]]
NAMES = Names("Hall 2", "Ann", "LP-04", "T-10", "C-1", 10.0)


@pytest.fixture(scope="session")
def samples(
    small_scene: Scene, tmp_path_factory: pytest.TempPathFactory
) -> OpenedFiles:
    """The simulated pen's files, written and read once; copy before you change them."""
    folder = tmp_path_factory.mktemp("samples")
    return SceneSimulator(small_scene).write_files(folder)


@pytest.fixture
def workbench(
    settings: Settings, tmp_path: Path, around: SourceEnvironment, samples: OpenedFiles
) -> Iterator[Workbench]:
    """A workbench with names and the simulated pen's files; its camera is not open yet.

    `workbench.camera.open()` opens it; images then come four times as fast as usual.
    """
    workbench = Workbench(settings, tmp_path / "data", around)
    choose_samples(workbench, samples, tmp_path / "samples")
    yield workbench
    workbench.shut_down()


def choose_samples(workbench: Workbench, samples: OpenedFiles, folder: Path) -> None:
    """Choose names, and a copy of the simulated pen's files in another folder."""
    camera, pen = samples.camera_file, samples.pen_file
    assert camera is not None
    assert pen is not None
    shutil.copytree(camera.path.parent, folder)
    workbench.selection.set_preparation(
        replace(
            workbench.selection.preparation,
            names=NAMES,
            camera_file=replace(camera, path=folder / camera.path.name),
            pen_file=replace(pen, path=folder / pen.path.name),
            source=SourceChoice(),
        )
    )


@pytest.fixture
def solving_on(monkeypatch: pytest.MonkeyPatch) -> SolvingOn:
    """Return a context in which a tip is computed until that is cancelled."""

    def solve(record: Record, report: Report) -> NoReturn:
        solve_record(record, report)
        while True:
            report(1.0)
            time.sleep(0.01)

    @contextmanager
    def patched() -> Iterator[None]:
        with monkeypatch.context() as endless:
            endless.setattr("lightpen.swing.solving.solve_record", solve)
            yield

    return patched


# The whole wizard, used as an operator uses it

LOOK_MS = 30  # between two looks at what the window shows
LONGEST_ROUND = 200  # presses of the Tab key
LEFT = Qt.MouseButton.LeftButton
NONE = Qt.KeyboardModifier.NoModifier


class Walker:
    """Somebody at the window: reads what is shown, presses keys, and clicks.

    Controls are found by the words on them or by their accessible names. Keys go to the
    control that has the focus, clicks to the window, which hands them on.
    """

    def __init__(self, qtbot: QtBot, wizard: Wizard) -> None:
        self._qtbot = qtbot
        self.wizard = wizard
        self.workbench, self.services = wizard.workbench, wizard.services
        self.window = wizard.window
        self.n_inputs = 0
        self.window.resize(1280, 800)
        with qtbot.waitSignal(wizard.started):
            wizard.show()
        self.take_window()

    def take_window(self) -> None:
        """Turn to the window, as its user does who has closed another one."""
        self.window.activateWindow()
        self.until(self.window.isActiveWindow)

    # Reads

    def texts(self, root: QWidget | None = None) -> list[str]:
        """All that a window says, to the eye or to a screen reader."""
        return [text for each in self.seen(root) for text in texts_of(each) if text]

    def seen(self, root: QWidget | None = None) -> list[QWidget]:
        """The visible widgets of a window; that of the wizard unless given."""
        return list(_visible(root or self.window))

    def says(self, text: str) -> bool:
        """Whether a label, a button or a banner says this and no more."""
        return text in self.texts()

    def tells(self, words: str) -> bool:
        """Whether this is part of what is said anywhere."""
        return any(words in text for text in self.texts())

    def title(self) -> str:
        return self.window.page().title()

    def steps(self) -> dict[str, str]:
        """How far each step is."""
        names = (w.accessibleName() for w in self.seen() if _is_step(w))
        return dict(name.rsplit(", ", 1) for name in names)

    def main_button(self) -> QAbstractButton:
        button = self.window.findChild(QAbstractButton, "main_button")
        assert isinstance(button, QAbstractButton)
        return button

    def names(self, control: QWidget) -> set[str]:
        """The words by which a control is found."""
        return set(texts_of(control)) - {""}

    def control(self, name: str, root: QWidget | None = None) -> QWidget:
        """The visible control of this name."""
        found = [w for w in self.seen(root) if _is_control(w) and name in _names(w)]
        assert len(found) == 1, (name, found)
        return found[0]

    def offers(self, name: str) -> bool:
        """Whether there is such a control, and it can be used."""
        controls = (w for w in self.seen() if _is_control(w) and name in _names(w))
        return any(control.isEnabled() for control in controls)

    def until(self, happened: Callable[[], bool]) -> None:
        deadline = QDeadlineTimer(PATIENCE_MS)
        while not happened():
            if deadline.hasExpired():
                raise WaitedInVain
            self._qtbot.wait(LOOK_MS)

    def until_says(self, text: str) -> None:
        self._until_said(text, self.says)

    def until_tells(self, words: str) -> None:
        self._until_said(words, self.tells)

    def until_shows(self, title: str) -> None:
        self.until(lambda: self.title() == title)

    # Presses keys

    def press(self, key: Qt.Key, modifiers: Qt.KeyboardModifier = NONE) -> None:
        self.n_inputs += 1
        QTest.keyClick(self._front(), key, modifiers)

    def type(self, text: str) -> None:
        for character in text:
            self.n_inputs += 1
            QTest.keyClick(self._front(), ord(character))

    def tab_to(self, name: str) -> None:
        """Press Tab until the control of this name has the focus."""
        wanted = self.control(name)
        for _ in range(LONGEST_ROUND):
            now = QApplication.focusWidget()
            if now is wanted or (now is not None and wanted.focusProxy() is now):
                return
            self.press(Qt.Key.Key_Tab)
        raise AssertionError(f"The Tab key does not lead to {name!r}.")

    def tab_round(self) -> list[QWidget]:
        """The controls to which the Tab key leads, until it comes to the first."""
        visited: list[QWidget] = []
        for _ in range(LONGEST_ROUND):
            self.press(Qt.Key.Key_Tab)
            now = QApplication.focusWidget()
            assert now is not None
            if visited and now is visited[0]:
                return visited
            visited.append(now)
        raise AssertionError("The Tab key does not come round.")

    def enter(self, name: str, text: str) -> None:
        """Go to a field by the Tab key and type, instead of what is there."""
        self.tab_to(name)
        self.press(Qt.Key.Key_A, Qt.KeyboardModifier.ControlModifier)
        self.type(text)

    # Clicks

    def click(self, name: str) -> None:
        self.click_on(self.control(name))

    def click_anywhere(self, x: int, y: int) -> None:
        """Click a point of the window."""
        self._click_at(self.window.windowHandle(), QPoint(x, y))

    def click_on(self, control: QWidget) -> None:
        """Click what can be seen of a control; scroll to it if need be."""
        assert control.isEnabled(), (control, control.toolTip())
        if control.visibleRegion().isEmpty():
            _scroll_to(control)
        place = control.visibleRegion().boundingRect().center()
        if isinstance(control, QCheckBox):
            place.setX(10)
        window = control.window()
        self._click_at(window.windowHandle(), control.mapTo(window, place))

    def click_step(self, title: str) -> None:
        """Click a step of the list."""
        (step,) = (
            widget
            for widget in self.seen()
            if _is_step(widget) and widget.accessibleName().startswith(f"{title}, ")
        )
        self.click_on(step)

    def click_into(self, name: str, text: str) -> None:
        """Click into a field and type, instead of what is there."""
        self.click(name)
        self.press(Qt.Key.Key_A, Qt.KeyboardModifier.ControlModifier)
        self.type(text)

    def choose(self, *names: str) -> None:
        """Click entries of the menu that is open, the last of them in submenus."""
        for name in names:
            menu = QApplication.activePopupWidget()
            assert isinstance(menu, QMenu)
            (entry,) = (a for a in menu.actions() if a.text().replace("&", "") == name)
            place = menu.actionGeometry(entry).center()
            self._click_at(menu.windowHandle(), place)

    @contextmanager
    def answering(
        self, role: QMessageBox.ButtonRole = QMessageBox.ButtonRole.AcceptRole
    ) -> Iterator[list[str]]:
        """Answer the questions that stop the window meanwhile; gives what they are."""
        asked: list[str] = []

        def answer() -> None:
            box = QApplication.activeModalWidget()
            if isinstance(box, QMessageBox) and box.isVisible():
                asked.append(box.text())
                (button,) = (b for b in box.buttons() if box.buttonRole(b) == role)
                QTest.mouseClick(button, LEFT)

        timer = QTimer(interval=20)
        timer.timeout.connect(answer)
        timer.start()
        try:
            yield asked
        finally:
            timer.stop()

    # Takes the simulated pen

    @property
    def operator(self) -> SimulatedOperator:
        """Who holds the simulated pen."""
        operator = self.workbench.live.operator
        assert isinstance(operator, SimulatedOperator)
        return operator

    def swing(self) -> None:
        """Seat the tip and follow the arrow, as a person at the cone does."""
        self.operator.seat()
        self.workbench.live.set_following(True)

    def close(self) -> None:
        """Close the window, whatever it asks."""
        with self.answering():
            self.window.close()
        others = self.window.operator_view, self.window.help_window
        for each in (*others, self.window, self.wizard):
            each.deleteLater()
        QApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)

    def _until_said(self, text: str, is_said: Callable[[str], bool]) -> None:
        try:
            self.until(lambda: is_said(text))
        except WaitedInVain as error:
            raise AssertionError(f"{text!r} is not said: {self.texts()}") from error

    def _front(self) -> QWidget:
        """Who gets the keys: a menu, or the control that has the focus."""
        return (
            QApplication.activePopupWidget()
            or QApplication.focusWidget()
            or QApplication.activeWindow()
            or self.window
        )

    def _click_at(self, window: QWindow, place: QPoint) -> None:
        self.n_inputs += 1
        QTest.mouseClick(window, LEFT, NONE, place)


def texts_of(widget: QWidget) -> Iterator[str]:
    """Yield what a widget says, to the eye or to a screen reader."""
    match widget:
        case QLabel() | QAbstractButton():
            yield _plain(widget.text())
        case QLineEdit():
            yield widget.text() or widget.placeholderText()
        case QComboBox():
            yield widget.currentText()
        case QGroupBox():
            yield widget.title()
        case QTabBar():
            yield from (widget.tabText(index) for index in range(widget.count()))
        case QTextEdit():
            yield widget.toPlainText()
        case QTableView():
            yield from _cells_of(widget)
        case QListWidget():
            yield from (widget.item(index).text() for index in range(widget.count()))
    yield widget.accessibleName()
    yield widget.accessibleDescription()


def _visible(widget: QWidget) -> Iterator[QWidget]:
    """Yield a widget and all in it that can be seen; what is hidden holds none."""
    if widget.isVisible():
        yield widget
        for child in widget.children():
            if isinstance(child, QWidget):
                yield from _visible(child)


def _cells_of(table: QTableView) -> Iterator[str]:
    model, sideways = table.model(), Qt.Orientation.Horizontal
    for column in range(model.columnCount()):
        if table.isColumnHidden(column):
            continue
        yield str(model.headerData(column, sideways) or "")
        for row in range(model.rowCount()):
            yield str(model.index(row, column).data() or "")


def _plain(text: str) -> str:
    """The words of a label without the mark of the letter that goes with Alt."""
    return text.replace("&", "")


def _names(control: QWidget) -> set[str]:
    text = control.text() if isinstance(control, QAbstractButton) else ""
    return {control.accessibleName(), _plain(text)}


def _is_control(widget: QWidget) -> bool:
    if isinstance(widget, QAbstractButton):
        return True
    return widget.focusPolicy() is not Qt.FocusPolicy.NoFocus


def _is_step(widget: QWidget) -> bool:
    return type(widget).__name__ == "StepButton"


def _scroll_to(control: QWidget) -> None:
    parent = control.parentWidget()
    while parent is not None and not isinstance(parent, QScrollArea):
        parent = parent.parentWidget()
    assert isinstance(parent, QScrollArea), control
    parent.ensureWidgetVisible(control)


OpenWizard = Callable[..., Walker]


@pytest.fixture
def open_wizard(
    qtbot: QtBot,
    dressed: QApplication,
    tmp_path: Path,
    settings: Settings,
    around: SourceEnvironment,
) -> Iterator[OpenWizard]:
    """Return a function that starts the program, always on the same folder."""
    opened: list[Walker] = []

    def start(source: SourceEnvironment = around) -> Walker:
        folder = tmp_path / "data"
        dressed.setStyleSheet("")  # which the wizard gives it
        wizard = Wizard(dressed, faces(), settings, folder, source)
        opened.append(Walker(qtbot, wizard))
        return opened[-1]

    yield start
    while opened:
        opened.pop().close()


@pytest.fixture
def walker(open_wizard: OpenWizard) -> Walker:
    """The program at its first start."""
    return open_wizard()


class HeldBack(Event):
    """Has a function begin once it is set."""

    def __init__(self) -> None:
        super().__init__()
        self.is_reached = Event()  # the function was called


HoldBack = Callable[..., HeldBack]


@pytest.fixture
def hold_back(monkeypatch: pytest.MonkeyPatch) -> Iterator[HoldBack]:
    """Return a function that has others, by their places, begin once that is set."""
    held: list[HeldBack] = []

    def hold(*places: str) -> HeldBack:
        may_begin = HeldBack()
        held.append(may_begin)
        for place in places:
            monkeypatch.setattr(place, _once_set(may_begin, resolve_name(place)))
        return may_begin

    yield hold
    for may_begin in held:
        may_begin.set()


def _once_set(may_begin: HeldBack, function: Callable[..., Any]) -> Callable[..., Any]:
    def held(*arguments: Any) -> Any:
        may_begin.is_reached.set()
        may_begin.wait()
        return function(*arguments)

    return held
