"""The wizard in windows of a real screen, that of an X server without a monitor."""

import configparser
import os
import shlex
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from ctypes.util import find_library
from pathlib import Path

import pytest
from installer.linux.menu_entry import write_menu_entry

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
FILE = str(HERE / "in_real_window.py")
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


@pytest.mark.slow
def test_on_a_real_screen() -> None:
    lack = why_no_screen()
    if lack:
        pytest.skip(lack)

    with display() as name:
        on_screen = {"DISPLAY": name, "QT_QPA_PLATFORM": "xcb"}
        assert "1 passed" in passed(FILE, on_screen)


@pytest.mark.slow
def test_the_entry_in_the_menu_opens_the_window(tmp_path: Path) -> None:
    lack = why_no_screen() or ("" if shutil.which("xwininfo") else "no xwininfo")
    if lack:
        pytest.skip(lack)
    program = Path(sys.executable).with_name("lightpen")
    own = {f"XDG_{name}_HOME": str(tmp_path) for name in ("CONFIG", "DATA")}
    environment = os.environ | own
    environment.pop("QT_QPA_PLATFORM", None)
    write_menu_entry(tmp_path, program)
    parser = configparser.RawConfigParser()
    parser.read(tmp_path / "applications" / "lightpen.desktop", encoding="utf-8")
    words = shlex.split(parser["Desktop Entry"]["Exec"])
    command = [word for word in words if word != "%f"]  # a menu has no file

    with display() as name:
        environment |= {"DISPLAY": name, "QT_QPA_PLATFORM": "xcb"}
        with subprocess.Popen(command, env=environment) as window:
            try:
                until = time.monotonic() + LONGEST_S
                while "Lightpen" not in windows_of(name):
                    assert window.poll() is None, "it ended"
                    assert time.monotonic() < until, "no window"
                    time.sleep(0.2)
            finally:
                window.terminate()


def windows_of(name: str) -> str:
    """Return the list of all windows of a display."""
    listing = ["xwininfo", "-display", name, "-root", "-tree"]
    return subprocess.run(listing, capture_output=True, text=True, check=True).stdout
