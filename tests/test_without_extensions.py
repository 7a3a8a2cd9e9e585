"""Main works without any extension but the simulator: in a copy of the tree."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
KEPT = "simulator"
OTHER = re.compile(r"lightpen_extensions\.(?!simulator)|lightpen_app_extensions")
OF_MAIN = ("core/comparisons", "core/live", "core/pen_check", "core/swing", "app/shell")
OPENED = """
import sys
from pathlib import Path
from PySide6.QtCore import QTimer
from lightpen_app.application import Wizard, make_application
from lightpen_app.work.settings import Settings
from lightpen_app_program import FACES

application = make_application(["lightpen"])
wizard = Wizard(application, FACES, Settings(Path("s.json")), Path("data"))
wizard.started.connect(wizard.window.close)
wizard.show()
application.exec()
print(*(step.title for step in wizard.window.steps()))
"""

pytestmark = [pytest.mark.slow, pytest.mark.timeout(1200)]


@pytest.fixture(scope="module")
def tree(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a copy of the tree without extensions, named by its roots no more."""
    copy = tmp_path_factory.mktemp("tree")
    for folder in ("core", "app", "resources", "tests", "benchmarks", "docs"):
        ignored = shutil.ignore_patterns("__pycache__", "screens")
        shutil.copytree(ROOT / folder, copy / folder, ignore=ignored)
    shutil.copy(ROOT / "pyproject.toml", copy)
    core, app = (
        copy / "core" / "lightpen_extensions",
        copy / "app" / "lightpen_app_extensions",
    )
    gone = {each.name for each in core.iterdir() if each.is_dir()} - {KEPT}
    for each in (*core.iterdir(), *app.iterdir()):
        if each.is_dir() and each.name in gone:
            shutil.rmtree(each)
    for program in ("core/lightpen_program", "app/lightpen_app_program"):
        root = copy / program / "__init__.py"
        lines = root.read_text("utf-8").splitlines(keepends=True)
        kept = (line for line in lines if not any(k in line.lower() for k in gone))
        root.write_text("".join(kept), "utf-8")
    return copy


def run(tree: Path, folder: Path, *words: str) -> str:
    """Run Python on a copy of the tree in a folder, unseen."""
    path = os.pathsep.join(str(tree / name) for name in ("core", "app", "resources"))
    homes = {f"XDG_{name}_HOME": str(folder) for name in ("CONFIG", "DATA")}
    unseen = {"QT_QPA_PLATFORM": "offscreen", "HOME": str(folder)}
    done = subprocess.run(
        [sys.executable, *words],
        cwd=folder,
        env={**os.environ, **homes, **unseen, "PYTHONPATH": path},
        capture_output=True,
        encoding="utf-8",
        check=False,
    )
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    return done.stdout


def test_the_command_line_has_main_and_what_is_kept(tree: Path, tmp_path: Path) -> None:
    said = run(tree, tmp_path, "-m", "lightpen_program", "--help")

    assert "  calibrate " in said
    assert "  simulate " in said
    assert "  verify " not in said


def test_calibrate_finds_the_tip(tree: Path, tmp_path: Path) -> None:
    program = ("-m", "lightpen_program")
    run(tree, tmp_path, *program, "simulate", "set", "--images", "20")

    files = ("--camera", "set/camera.yaml", "--pen", "set/leds.csv")
    said = run(tree, tmp_path, *program, "calibrate", "set/images", *files)

    assert re.search(r"^ *joint .*\d", said, re.MULTILINE)


def test_the_window_opens_with_the_steps_of_main(tree: Path, tmp_path: Path) -> None:
    said = run(tree, tmp_path, "-c", OPENED)

    assert said.split() == ["Start", "Camera", "LEDs", "Swing", "Review", "History"]


def test_the_demo_accepts_a_tip(tree: Path, tmp_path: Path) -> None:
    said = run(tree, tmp_path, "-m", "lightpen_app", "--demo")

    assert re.search(r"^ *joint .*\d", said, re.MULTILINE)


def test_the_tests_of_main_pass(tree: Path, tmp_path: Path) -> None:
    files = [
        str(file)
        for folder in OF_MAIN
        for file in sorted((tree / "tests" / folder).rglob("test_*.py"))
        if not OTHER.search(file.read_text("utf-8"))
    ]
    options = ("-q", "-p", "no:cacheprovider", "--rootdir", str(tree))

    assert len(files) > 15
    run(tree, tree, "-m", "pytest", *options, *files)
