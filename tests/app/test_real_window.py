"""The wizard in windows of a real screen, that of an X server without a monitor."""

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from ctypes.util import find_library
from pathlib import Path

import pytest

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
WALK = f"{HERE / 'test_walk.py'}::test_the_simulated_pen_by_the_mouse"
LONGEST_S = 400  # on a machine that does other things besides


@pytest.fixture(scope="module")
def display() -> Iterator[str]:
    """Start an X server and give the name of its display."""
    server = shutil.which("Xvfb")
    if server is None:
        pytest.skip("Xvfb is not installed")
    if find_library("xcb-cursor") is None:
        pytest.skip("the library libxcb-cursor, which Qt needs, is not installed")
    reading, writing = os.pipe()
    command = (server, "-displayfd", str(writing), "-screen", "0", "1280x1024x24")
    with subprocess.Popen(
        command, pass_fds=(writing,), stderr=subprocess.DEVNULL
    ) as process:
        os.close(writing)
        with os.fdopen(reading) as pipe:
            number = pipe.readline().strip()
        assert number, "Xvfb did not start"
        yield f":{number}"
        process.terminate()


def test_on_a_real_screen(display: str) -> None:
    tests = WALK, str(HERE / "in_real_window.py")
    command = (sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "-q", *tests)
    outcome = subprocess.run(
        command,
        cwd=ROOT,
        env=os.environ | {"DISPLAY": display, "QT_QPA_PLATFORM": "xcb"},
        capture_output=True,
        encoding="utf-8",
        timeout=LONGEST_S,
        check=False,
    )

    assert outcome.returncode == 0, outcome.stdout[-6000:] + outcome.stderr[-2000:]
    assert "2 passed" in outcome.stdout
