"""The window opens, and a calibration gives the same tip, in any locale of the system.

Qt's classes take properties by keyword and look for their setters with the letters of
the locale: "setinterval" has no capital I in Turkish.
"""

import ast
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from subprocess import CompletedProcess

import pytest

import lightpen_app

USUAL = "C"  # in which the demo is played by tests/app/test_demo.py
LOCALES = ("tr_TR", "de_DE", "fa_IR", USUAL)

DEMO = """
import sys
from dataclasses import replace
from pathlib import Path
from PySide6.QtCore import QLocale, QTimer
import lightpen.simulator.camera
from lightpen.cameras.clock import SkippingClock
from lightpen.live.sources import SourceEnvironment
from lightpen.model.limits import SwingLimits
from lightpen.simulator.scenes import Scene
from lightpen.simulator.swings import paper_camera
from lightpen_app.application import Wizard, make_application
from lightpen_app.demo import Demo
from lightpen_app.wizard_pages import make_pages
from lightpen_app.work.settings import Settings

lightpen.simulator.camera.USUAL_FRAME_RATE = 7.0  # looking at images takes long
folder = Path(sys.argv[1])
application = make_application(["lightpen"])
settings = Settings(folder / "lightpen.json")
scene = Scene(camera=paper_camera(binning=2))
around = SourceEnvironment(scene, SkippingClock(rests=True))
wizard = Wizard(application, make_pages, settings, folder, around)
demo = Demo(wizard.window, wizard.workbench, is_watched=False)
demo.ended.connect(wizard.window.close_unasked)
wizard.window.show()
wizard.workbench.start()
limits = SwingLimits(max_uncertainty=0.05, min_images=12, min_per_field=0)
selection = wizard.workbench.selection
selection.set_preparation(replace(selection.preparation, limits=limits))
QTimer.singleShot(0, demo.start)
application.exec()
print(QLocale.system().name(), demo.is_accepted, wizard.workbench.shut_down(60.0))
"""

TIMER_BY_KEYWORD = """
from PySide6.QtCore import QCoreApplication, QTimer
application = QCoreApplication([])
QTimer(application, interval=0)
"""


@pytest.fixture(scope="session")
def environment_of(
    tmp_path_factory: pytest.TempPathFactory,
) -> Callable[[str], dict[str, str]]:
    """Return a function that makes a locale, where the system can, and chooses it."""
    folder = tmp_path_factory.mktemp("locales")

    @cache
    def environment(name: str) -> dict[str, str]:
        code = name if name == USUAL else f"{name}.UTF-8"
        if name != USUAL and shutil.which("localedef"):
            words = ["localedef", "-i", name, "-f", "UTF-8", str(folder / code)]
            subprocess.run(words, check=False, capture_output=True)
        here = {"LC_ALL": code, "LANG": code, "LOCPATH": str(folder)}
        return here | {"LANGUAGE": "", "QT_QPA_PLATFORM": "offscreen"}

    return environment


def run(
    code: str, environment: dict[str, str], *arguments: str
) -> CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-X", "utf8", "-c", code, *arguments],
        env=os.environ | environment,
        capture_output=True,
        encoding="utf-8",
        check=False,
    )


def properties_by_keyword(source: str) -> list[str]:
    """Return the classes of Qt that are made with a property by keyword."""
    calls = (node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.Call))
    return [
        f"{ast.unparse(call.func)}({keyword.arg}=)"
        for call in calls
        if ast.unparse(call.func).rpartition(".")[2].startswith("Q")
        for keyword in call.keywords
        if keyword.arg != "parent"
    ]


@pytest.mark.parametrize("name", [name for name in LOCALES if name != USUAL])
def test_the_demo_opens_the_window_and_plays_in_any_locale(
    environment_of: Callable[[str], dict[str, str]], tmp_path: Path, name: str
) -> None:
    outcome = run(DEMO, environment_of(name), str(tmp_path))

    assert outcome.returncode == 0, outcome.stderr
    assert outcome.stdout.split() == [name, "True", "True"]


def test_a_calibration_gives_the_same_tip_in_any_locale(
    environment_of: Callable[[str], dict[str, str]],
    scene: Callable[..., Path],
    script: Callable[..., CompletedProcess[str]],
    tmp_path: Path,
) -> None:
    folder = scene("--images", "8", "--seed", "3")
    words = ("--camera", folder / "camera.yaml", "--pen", folder / "leds.csv")
    tips = {}
    for name in LOCALES:
        file = tmp_path / f"{name}.json"
        outcome = script(
            *("calibrate", folder / "images", *words, "--json", file),
            environment=environment_of(name),
        )
        assert outcome.returncode == 0, outcome.stderr
        tips[name] = json.loads(file.read_bytes())["tip_pen_mm"]

    assert all(tip == tips[USUAL] for tip in tips.values())


def test_no_property_of_qt_is_set_by_keyword() -> None:
    root = Path(lightpen_app.__file__).parent
    found = {
        str(path.relative_to(root)): calls
        for path in sorted(root.rglob("*.py"))
        if (calls := properties_by_keyword(path.read_text("utf-8")))
    }

    assert found == {}


def test_a_property_that_is_set_by_keyword_is_noticed() -> None:
    source = "QTimer(self, interval=5)\nQtGui.QAction(parent=self, checkable=True)"

    assert properties_by_keyword(source) == [
        "QTimer(interval=)",
        "QtGui.QAction(checkable=)",
    ]


@pytest.mark.skipif(not shutil.which("localedef"), reason="needs a Turkish locale")
def test_the_turkish_locale_of_these_tests_has_what_made_the_window_fail(
    environment_of: Callable[[str], dict[str, str]],
) -> None:
    outcome = run(TIMER_BY_KEYWORD, environment_of("tr_TR"))

    assert "'interval' is not a Qt property" in outcome.stderr
