"""A bug is written down and reported, and the program goes on."""

import logging
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
from pytestqt.qtbot import QtBot

from lightpen.logs import running_log
from lightpen_app.crash import MAX_REPORTS, CrashHook, versions

# The hooks are taken over in a process of its own, as pytest has its own hooks.
PROGRAM = """
import faulthandler, sys, threading
from pathlib import Path
from PySide6.QtCore import QCoreApplication, QTimer
from lightpen_app.crash import CrashHook

application = QCoreApplication([])
hook = CrashHook(Path(sys.argv[1]))
hook.install()

def bug():
    raise RuntimeError("in a slot")

def thread_bug():
    raise RuntimeError("in a thread")

def go_on():
    worker = threading.Thread(target=thread_bug)
    worker.start()
    worker.join()
    print("still alive", faulthandler.is_enabled())
    application.quit()

QTimer.singleShot(0, bug)
QTimer.singleShot(20, go_on)
application.exec()
hook.remove()
assert sys.excepthook is sys.__excepthook__
"""


def raise_and_report(hook: CrashHook, text: str) -> None:
    try:
        raise RuntimeError(text)
    except RuntimeError as error:
        hook.report(type(error), error, error.__traceback__)


@pytest.fixture
def hook(tmp_path: Path) -> Iterator[CrashHook]:
    hook = CrashHook(tmp_path / "crashes")
    yield hook
    hook.deleteLater()


def test_a_bug_in_a_slot_or_a_thread_leaves_the_program_running(tmp_path: Path) -> None:
    result = subprocess.run(
        [sys.executable, "-c", PROGRAM, str(tmp_path)],
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )

    assert result.returncode == 0, result.stderr
    assert result.stdout == "still alive True\n"
    reports = [path.read_text("utf-8") for path in sorted(tmp_path.glob("crash-*"))]
    assert len(reports) == 2
    assert any("RuntimeError: in a slot" in report for report in reports)
    assert any("RuntimeError: in a thread" in report for report in reports)


def test_a_report_says_what_happened_where_and_with_which_versions(
    qtbot: QtBot, hook: CrashHook
) -> None:
    with qtbot.waitSignal(hook.reported) as blocker:
        raise_and_report(hook, "the bug")

    assert blocker.args is not None
    text = Path(blocker.args[0]).read_text("utf-8")
    assert "RuntimeError: the bug" in text
    assert "raise_and_report" in text
    assert next(iter(versions())) == "lightpen"
    for name, number in versions().items():
        assert f"{name}: {number}" in text


def test_a_report_ends_with_the_last_lines_of_the_log(
    qtbot: QtBot, hook: CrashHook
) -> None:
    with running_log(logging.INFO):
        logging.getLogger("lightpen").info("camera 7: lost")
        with qtbot.waitSignal(hook.reported) as blocker:
            raise_and_report(hook, "the bug")

    assert blocker.args is not None
    text = Path(blocker.args[0]).read_text("utf-8")
    _, _, log = text.partition("The last lines of the log:\n")
    assert "INFO" in log
    assert "lightpen: camera 7: lost\n" in log
    assert "CRITICAL" in log
    assert "RuntimeError: the bug" in log


def test_the_same_bug_is_reported_once(qtbot: QtBot, hook: CrashHook) -> None:
    reported: list[str] = []
    hook.reported.connect(reported.append)

    for _ in range(3):
        raise_and_report(hook, "in every paint event")

    assert len(reported) == 1


def test_ever_new_bugs_do_not_fill_the_disk(hook: CrashHook) -> None:
    reported: list[str] = []
    hook.reported.connect(reported.append)

    for number in range(MAX_REPORTS + 5):
        raise_and_report(hook, f"number {number}")

    assert len(set(reported)) == MAX_REPORTS


def test_a_bug_is_reported_even_if_no_report_can_be_written(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("not a folder")
    hook = CrashHook(tmp_path / "file")
    reported: list[str] = []
    hook.reported.connect(reported.append)

    raise_and_report(hook, "the bug")

    assert reported == [""]


def test_a_report_reaches_the_window_on_its_own_thread(
    qtbot: QtBot, hook: CrashHook
) -> None:
    worker = threading.Thread(target=raise_and_report, args=(hook, "elsewhere"))

    with qtbot.waitSignal(hook.reported):
        worker.start()

    worker.join()


def test_a_report_does_not_tell_whose_home_folder_it_is(
    qtbot: QtBot, hook: CrashHook
) -> None:
    with qtbot.waitSignal(hook.reported) as blocker:
        raise_and_report(hook, f"cannot open {Path.home() / 'data' / 'tip.json'}")

    assert blocker.args is not None
    text = Path(blocker.args[0]).read_text("utf-8")
    assert str(Path.home()) not in text
    assert str(Path("~", "data", "tip.json")) in text
