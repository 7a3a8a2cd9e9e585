"""Run the tests of the core with the Windows Python that is installed.

``python installer/check_core.py PAYLOAD [WORDS]``, where PAYLOAD is the folder that the
installer was packed from, and WORDS are those of pytest. Under Wine on Linux; what
cannot be tried there or on Windows says so where it is skipped.
"""

import argparse
import os
import shutil
import sys
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from installer import runtime
from installer.downloads import download_wheels
from installer.locked import windows_pins
from installer.machine import fresh_machine
from installer.payload import unpack_wheels
from installer.places import IS_WINDOWS, ROOT

# Of the tools in requirements-dev.lock, what the tests import.
TOOLS = {
    *("hypothesis", "sortedcontainers", "filelock", "fonttools", "iniconfig"),
    *("execnet", "packaging", "pluggy", "pygments", "pytest", "pytest-qt"),
    *("pytest-timeout", "pytest-xdist", "xmlschema", "elementpath"),
}
USUAL = ("tests/core", "-q", "-p", "no:cacheprovider")
PATHS_FILE = runtime.LIBRARY.replace(".zip", "._pth")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run them, and return the exit status of pytest."""
    options = _parser().parse_args(arguments)
    with (
        fresh_machine("offscreen") as machine,
        TemporaryDirectory(prefix="lightpen-core-") as name,
    ):
        folder = Path(name) / "program"
        tools = Path(name) / "tools"
        shutil.copytree(options.payload, folder, copy_function=os.link)
        lock = (ROOT / "requirements-dev.lock").read_text("utf-8")
        pins = windows_pins(lock, runtime.VERSION)
        wheels = download_wheels(pin for pin in pins if pin.name.lower() in TOOLS)
        unpack_wheels(wheels, tools)
        # Processes that the tests start find all of it, too.
        places = [machine.windows_path(place) for place in (tools, ROOT)]
        paths = folder / "runtime" / PATHS_FILE
        paths.unlink()  # its content would be that of the payload
        paths.write_text(runtime.PATHS + "\r\n".join([*places, ""]), newline="")
        python = machine.windows_path(folder / "runtime" / "python.exe")
        plugins = () if IS_WINDOWS else ("-p", "installer.wine.without_copyfile2")
        # Without start.py each process finds its modules in the folders, and the first
        # leaves their compiled form there, in this copy.
        words = [python, "-m", "pytest", *plugins, *(options.words or USUAL)]
        process = machine.start(words, ROOT)
        if process.stdout is not None:
            for line in process.stdout:  # told as it comes: it takes many minutes
                sys.stdout.write(line.decode("utf-8", errors="replace"))
                sys.stdout.flush()
        return process.wait()


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description="Run the core's tests on Windows.")
    parser.add_argument("payload", type=Path, metavar="PAYLOAD")
    parser.add_argument("words", nargs=argparse.REMAINDER, metavar="WORDS")
    return parser


if __name__ == "__main__":
    sys.exit(main())
