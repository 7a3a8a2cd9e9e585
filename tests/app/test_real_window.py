"""The wizard in windows of a real screen, that of an X server without a monitor.

Where there is no X server, the wizard is walked without a screen.
"""

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from ctypes.util import find_library
from pathlib import Path

import pytest

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
FILE = str(HERE / "in_real_window.py")
WALK = f"{FILE}::test_the_simulated_pen_by_the_mouse"
LONGEST_S = 400  # on a machine that does other things besides


def why_no_screen() -> str:
    """Return what an X server, or a window on it, lacks here; nothing as a rule."""
    if shutil.which("Xvfb") is None:
        return "Xvfb is not installed"
    if find_library("xcb-cursor") is None:
        return "the library libxcb-cursor, which Qt needs, is not installed"
    return ""


@contextmanager
def display() -> Iterator[str]:
    """Start an X server and give the name of its display."""
    reading, writing = os.pipe()
    command = ("Xvfb", "-displayfd", str(writing), "-screen", "0", "1280x1024x24")
    with subprocess.Popen(
        command, pass_fds=(writing,), stderr=subprocess.DEVNULL
    ) as process:
        os.close(writing)
        with os.fdopen(reading) as pipe:
            number = pipe.readline().strip()
        assert number, "Xvfb did not start"
        try:
            yield f":{number}"
        finally:
            process.terminate()


def passed(test: str, environment: dict[str, str]) -> str:
    """Run tests in a process of its own, and return what it says of those passed."""
    command = (sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "-q", test)
    outcome = subprocess.run(
        command,
        cwd=ROOT,
        env=os.environ | environment,
        capture_output=True,
        encoding="utf-8",
        timeout=LONGEST_S,
        check=False,
    )

    assert outcome.returncode == 0, outcome.stdout[-6000:] + outcome.stderr[-2000:]
    return outcome.stdout


def test_on_a_real_screen() -> None:
    lack = why_no_screen()
    if lack:
        assert "1 passed" in passed(WALK, {"QT_QPA_PLATFORM": "offscreen"})
        pytest.skip(f"{lack}: walked without a screen")

    with display() as name:
        on_screen = {"DISPLAY": name, "QT_QPA_PLATFORM": "xcb"}
        assert "2 passed" in passed(FILE, on_screen)
