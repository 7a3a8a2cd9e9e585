"""Main works without any extension, its demo with the simulator alone."""

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Collection
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
COPIED = ("core", "app", "resources", "tests", "benchmarks", "docs", "installer")
QUICK = (
    *("core/cameras", "core/model", "core/pen_check", "core/runners"),
    *("app/look", "app/shell", "app/work"),
)
OPENED = """
import sys
from pathlib import Path
from PySide6.QtCore import QTimer
from lightpen.live.sources import SourceEnvironment
from lightpen_app.application import Wizard, make_application
from lightpen_app.work.settings import Settings
from lightpen_program.extensions import faces, simulator

application = make_application(["lightpen"])
around = SourceEnvironment(simulator())
settings = Settings(Path("s.json"))
wizard = Wizard(application, faces(), settings, Path("data"), around)
wizard.started.connect(wizard.window.close)
wizard.show()
application.exec()
print(*(step.title for step in wizard.window.steps()))
"""
PROGRAM = ("-m", "lightpen_program")

pytestmark = [pytest.mark.slow, pytest.mark.timeout(3600)]


def copy_tree(copy: Path, kept: Collection[str]) -> Path:
    """Copy the tree without other extensions, named by its root no more."""
    for folder in COPIED:
        ignored = shutil.ignore_patterns("__pycache__", "screens")
        shutil.copytree(ROOT / folder, copy / folder, ignore=ignored)
    shutil.copy(ROOT / "pyproject.toml", copy)
    places = "*/lightpen*_extensions/*/", "tests/*/extensions/*/"
    folders = [each for place in places for each in copy.glob(place)]
    gone = {each.name for each in folders} - {*kept}
    for each in folders:
        if each.name in gone:
            shutil.rmtree(each)
    root = copy / "app" / "lightpen_program" / "extensions.py"
    lines = root.read_text("utf-8").splitlines(keepends=True)
    names = re.compile(rf"\b({'|'.join(map(str.upper, gone))})\b")
    root.write_text("".join(each for each in lines if not names.search(each)), "utf-8")
    return copy


@pytest.fixture(scope="module")
def tree(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a copy of the tree with the simulator alone."""
    return copy_tree(tmp_path_factory.mktemp("tree"), ["simulator"])


@pytest.fixture(scope="module")
def bare(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a copy of the tree without any extension."""
    return copy_tree(tmp_path_factory.mktemp("bare"), [])


def run(tree: Path, folder: Path, *words: str, status: int = 0) -> str:
    """Run Python on a copy of the tree in a folder, unseen; return what it prints."""
    path = os.pathsep.join(str(tree / name) for name in ("core", "app", "resources"))
    homes = {f"XDG_{name}_HOME": str(folder) for name in ("CONFIG", "DATA")}
    unseen = {"QT_QPA_PLATFORM": "offscreen", "HOME": str(folder)}
    unseen["LIGHTPEN_WITHOUT_EXTENSIONS"] = "1"
    around = {**os.environ, **homes, **unseen, "PYTHONPATH": path}
    around.pop("PYTEST_XDIST_WORKER", None)  # no part of the tests here
    done = subprocess.run(
        [sys.executable, *words],
        cwd=folder,
        env=around,
        capture_output=True,
        encoding="utf-8",
        check=False,
    )
    assert done.returncode == status, done.stdout[-3000:] + done.stderr[-3000:]
    return done.stdout if status == 0 else done.stderr


def test_the_command_line_has_main_and_what_is_kept(
    tree: Path, bare: Path, tmp_path: Path
) -> None:
    said = run(tree, tmp_path, *PROGRAM, "--help")
    said_bare = run(bare, tmp_path, *PROGRAM, "--help")

    assert "  calibrate " in said
    assert "  calibrate " in said_bare
    assert "  simulate " in said
    assert "  simulate " not in said_bare
    assert "  verify " not in said


def test_calibrate_finds_the_tip_without_any_extension(
    tree: Path, bare: Path, tmp_path: Path
) -> None:
    run(tree, tmp_path, *PROGRAM, "simulate", "set", "--images", "20")

    files = ("--camera", "set/camera.yaml", "--pen", "set/leds.csv")
    said = run(bare, tmp_path, *PROGRAM, "calibrate", "set/images", *files)

    assert re.search(r"^ *joint .*\d", said, re.MULTILINE)


def test_the_window_opens_with_the_steps_of_main(bare: Path, tmp_path: Path) -> None:
    said = run(bare, tmp_path, "-c", OPENED)

    assert said.split() == ["Start", "Camera", "LEDs", "Swing", "Review", "History"]


def test_the_demo_accepts_a_tip(tree: Path, tmp_path: Path) -> None:
    said = run(tree, tmp_path, *PROGRAM, "--demo")

    assert re.search(r"^ *joint .*\d", said, re.MULTILINE)


def test_the_demo_without_the_simulator_says_what_it_needs(
    bare: Path, tmp_path: Path
) -> None:
    said = run(bare, tmp_path, *PROGRAM, "--demo", status=2)

    assert "extension that simulates a pen" in said


@pytest.mark.parametrize(
    ("n_processes", "folders", "n_least"),
    [(0, QUICK, 300), (2, ("core", "app"), 4000)],
    ids=["quick", "all"],
)
def test_the_tests_of_main_pass(
    tree: Path, n_processes: int, folders: Collection[str], n_least: int
) -> None:
    places = [str(tree / "tests" / each) for each in folders]
    options = ("-q", "-p", "no:cacheprovider", "--rootdir", str(tree))
    parallel = ("--numprocesses", str(n_processes), "--dist", "loadfile")
    said = run(tree, tree, "-m", "pytest", *options, *parallel, *places)

    (n_passed,) = re.findall(r"(\d+) passed", said)
    assert int(n_passed) > n_least  # what needs an extension is skipped
