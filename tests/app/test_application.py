"""The application starts fast, changes language and theme, and remembers both."""

import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot
from typing_extensions import override

from lightpen_app.application import Services, Wizard
from lightpen_app.languages import Language
from lightpen_app.pages.page import MainAction, Page
from lightpen_app.settings import Preferences, Settings
from lightpen_app.theme import LIGHT, Appearance, colors_of

STARTED = """
import sys, time
begin = time.perf_counter()
from pathlib import Path
from PySide6.QtCore import QTimer
from lightpen_app.application import Wizard, make_application
from lightpen_app.pages.page import MainAction, Page
from lightpen_app.settings import Settings
from lightpen_app.widgets import exposure_bar, image_view, plots, posture_dial

class Only(Page):
    key = "start"
    def title(self): return "Start"
    def is_complete(self): return True
    def main_action(self): return MainAction("Continue")

application = make_application(["lightpen"])
folder = Path(sys.argv[1])
wizard = Wizard(
    application, lambda services: [Only()], Settings(folder / "a.ini"), folder
)
wizard.window.show()
QTimer.singleShot(0, application.quit)
application.exec()
print(time.perf_counter() - begin)
"""


class Only(Page):
    """The least that a page can be."""

    key = "start"

    @override
    def title(self) -> str:
        return "Start"

    @override
    def is_complete(self) -> bool:
        return True

    @override
    def main_action(self) -> MainAction:
        return MainAction("Continue")


def only_page(services: Services) -> Sequence[Page]:
    return [Only()]


def open_wizard(qtbot: QtBot, settings: Settings) -> Wizard:
    application = QApplication.instance()
    assert isinstance(application, QApplication)
    wizard = Wizard(application, only_page, settings, settings.file.parent)
    qtbot.addWidget(wizard.window)
    wizard.window.show()
    return wizard


def test_the_window_can_be_used_within_two_and_a_half_seconds(tmp_path: Path) -> None:
    """The best of three: other programs on the machine only make it slower."""
    environment = dict(os.environ, QT_QPA_PLATFORM="offscreen")

    seconds = [
        float(
            subprocess.run(
                [sys.executable, "-c", STARTED, str(tmp_path)],
                capture_output=True,
                text=True,
                check=True,
                env=environment,
            ).stdout
        )
        for _ in range(3)
    ]

    assert min(seconds) <= 2.5


def test_choices_take_effect_at_once_and_are_remembered(
    qtbot: QtBot, settings: Settings
) -> None:
    settings.set_preferences(Preferences())
    wizard = open_wizard(qtbot, settings)
    chosen = Preferences(language=Language.CHINESE, appearance=Appearance.LIGHT)

    wizard.window.preferences_changed.emit(chosen)
    QApplication.processEvents()

    assert wizard.window.windowTitle().endswith("\u5149\u7b14\u6d4b\u5934\u6821\u51c6")
    assert colors_of(wizard.window.palette()) is LIGHT
    again = open_wizard(qtbot, Settings(settings.file))
    assert again.window.windowTitle() == wizard.window.windowTitle()
    for each in (wizard, again):
        each.setParent(None)


def test_settings_that_cannot_be_saved_are_told_and_stop_nothing(
    qtbot: QtBot, tmp_path: Path
) -> None:
    (tmp_path / "file").write_text("not a folder")
    wizard = open_wizard(qtbot, Settings(tmp_path / "file" / "lightpen.ini"))

    wizard.window.preferences_changed.emit(Preferences(muted=True))

    assert any("cannot be saved" in each for each in wizard.window.words())
    wizard.setParent(None)


def test_a_crash_is_shown_in_the_window(qtbot: QtBot, settings: Settings) -> None:
    wizard = open_wizard(qtbot, settings)
    error = RuntimeError("the bug")

    wizard.crash_hook.report(RuntimeError, error, None)

    words = " ".join(wizard.window.words())
    assert "The program made a mistake of its own" in words
    assert str(settings.file.parent / "crashes") in words
    wizard.setParent(None)


@pytest.mark.parametrize("folder_exists", [True, False])
def test_a_first_start_needs_no_folder(
    qtbot: QtBot, tmp_path: Path, folder_exists: bool
) -> None:
    folder = tmp_path / "new"
    if folder_exists:
        folder.mkdir()

    wizard = open_wizard(qtbot, Settings(folder / "lightpen.ini"))

    assert wizard.window.isVisible()
    wizard.setParent(None)
