"""The application starts fast, changes language and theme, and remembers both."""

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot
from tests.app.blank_page import BlankPage

from lightpen_app.application import Wizard
from lightpen_app.face import Service
from lightpen_app.look.sounds import Sounds
from lightpen_app.look.theme import LIGHT, Appearance, colors_of
from lightpen_app.shell.main_window import LEAST_SIZE
from lightpen_app.widgets.page import Page
from lightpen_app.work.settings import Preferences, Settings
from lightpen_app.work.workbench import Workbench

OPENING = """
import sys
from PySide6.QtCore import QPoint, QTimer
from PySide6.QtWidgets import QApplication, QPushButton
from lightpen_app.application import run
from lightpen_app.face import Service

def tell():
    (window,) = [w for w in QApplication.topLevelWidgets() if w.objectName() == "main"]
    button = window.findChild(QPushButton, "main_button")
    corner = button.mapToGlobal(QPoint(button.width(), button.height()))
    print(window.width(), window.height(), corner.x(), corner.y())
    QApplication.quit()

def face(workbench):
    QTimer.singleShot(500, tell)
    return Service(workbench)

sys.exit(run([face], None))
"""


BEFORE_THE_PAINT = """
import sys
from PySide6.QtWidgets import QApplication
from lightpen_app import application
from lightpen_program.extensions import faces

make_pages = application.make_pages

def pages(*given):
    made = make_pages(*given)
    yield next(made)  # the others are wanted once the window is painted
    print(*sorted(sys.modules))
    print(any(w.isVisible() for w in QApplication.topLevelWidgets()))
    QApplication.quit()

application.make_pages = pages
sys.exit(application.run(faces(), None))
"""
LATER = {
    *("pyqtgraph", "scipy", "sqlalchemy", "asyncio", "harvesters"),
    *(
        "lightpen_app_extensions.simulator.demo",
        "lightpen_app_extensions.discover.window",
    ),
    *(f"lightpen_app.steps.{step}.page" for step in ("camera", "leds", "swing")),
    *(f"lightpen_app.steps.{step}.page" for step in ("review", "history")),
    *("lightpen_app_extensions.measure.verify_page",),
}


def only_page(
    workbench: Workbench, sounds: Sounds, services: Sequence[Service]
) -> Sequence[Page]:
    return [BlankPage("start")]


def open_wizard(qtbot: QtBot, settings: Settings) -> Wizard:
    application = QApplication.instance()
    assert isinstance(application, QApplication)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("lightpen_app.application.make_pages", only_page)
        wizard = Wizard(application, (), settings, settings.file.parent)
    qtbot.addWidget(wizard.window)
    wizard.window.show()
    return wizard


def test_choices_take_effect_at_once_and_are_remembered(
    qtbot: QtBot, settings: Settings
) -> None:
    settings.set_preferences(Preferences())
    wizard = open_wizard(qtbot, settings)
    chosen = Preferences(language="zh_CN", appearance=Appearance.LIGHT)

    wizard.window.preferences_changed.emit(chosen)
    QApplication.processEvents()

    assert wizard.window.windowTitle().endswith("\u5149\u7b14\u6d4b\u5934\u6807\u5b9a")
    assert colors_of(wizard.window.palette()) is LIGHT
    assert settings.await_saved(120.0)
    again = open_wizard(qtbot, Settings(settings.file))
    assert again.window.windowTitle() == wizard.window.windowTitle()
    for each in (wizard, again):
        each.setParent(None)


def test_settings_that_cannot_be_saved_are_reported_and_stop_nothing(
    qtbot: QtBot, tmp_path: Path
) -> None:
    (tmp_path / "file").write_text("not a folder")
    wizard = open_wizard(qtbot, Settings(tmp_path / "file" / "lightpen.json"))

    wizard.window.preferences_changed.emit(Preferences(muted=True))

    qtbot.waitUntil(
        lambda: any(
            "). Check free space and write permission of its folder." in each
            for each in wizard.window.words()
        )
    )
    wizard.setParent(None)


def test_a_crash_is_shown_in_the_window(qtbot: QtBot, settings: Settings) -> None:
    wizard = open_wizard(qtbot, settings)
    error = RuntimeError("the bug")

    wizard.crash_hook.report(RuntimeError, error, None)

    words = " ".join(wizard.window.words())
    assert "An internal error occurred" in words
    assert str(settings.file.parent / "crashes") in words
    wizard.setParent(None)


def test_a_fault_that_is_over_is_no_longer_reported(
    qtbot: QtBot, settings: Settings
) -> None:
    wizard = open_wizard(qtbot, settings)
    notifications = wizard.workbench.notifications

    notifications.notify("a swing", "The disk is full.")
    assert "The disk is full." in wizard.window.words()
    notifications.withdraw("a swing")

    assert "The disk is full." not in wizard.window.words()
    wizard.setParent(None)


@pytest.mark.parametrize("folder_exists", [True, False])
def test_a_first_start_needs_no_folder(
    qtbot: QtBot, tmp_path: Path, folder_exists: bool
) -> None:
    folder = tmp_path / "new"
    if folder_exists:
        folder.mkdir()

    wizard = open_wizard(qtbot, Settings(folder / "lightpen.json"))

    assert wizard.window.isVisible()
    wizard.setParent(None)


def printed_by(program: str, home: Path, **variables: str) -> str:
    """Return what a Python program prints whose user has nothing in the home yet."""
    homes = ("XDG_CONFIG_HOME", "XDG_DATA_HOME", "HOME", "APPDATA", "LOCALAPPDATA")
    outcome = subprocess.run(
        [sys.executable, "-c", program],
        cwd=home,
        env=os.environ | dict.fromkeys(homes, str(home)) | variables,
        capture_output=True,
        encoding="utf-8",
        check=False,
    )
    assert outcome.returncode == 0, outcome.stderr
    return outcome.stdout


@pytest.mark.slow
def test_nothing_that_only_later_steps_need_is_imported_before_the_first_paint(
    tmp_path: Path,
) -> None:
    modules, is_shown = printed_by(BEFORE_THE_PAINT, tmp_path).splitlines()

    assert is_shown == "True"
    assert LATER.isdisjoint(modules.split())


@pytest.mark.slow
def test_on_a_screen_of_twice_the_scale_the_main_button_can_be_seen(
    tmp_path: Path,
) -> None:
    names = ("name", "x", "y", "width", "height", "logicalDpi", "dpr")
    screen = dict(zip(names, ("screen", 0, 0, 1920, 1080, 96, 1), strict=True))
    (tmp_path / "screens.json").write_text(json.dumps({"screens": [screen]}))
    printed = printed_by(
        OPENING,
        tmp_path,
        QT_QPA_PLATFORM="offscreen:configfile=screens.json",
        QT_SCALE_FACTOR="2",
    )

    width, height, right, bottom = map(int, printed.split())
    assert width >= LEAST_SIZE.width()
    assert height >= LEAST_SIZE.height()
    assert right <= 1920 // 2
    assert bottom <= 1080 // 2
