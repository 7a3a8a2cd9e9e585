"""The commands that need Qt."""

import argparse
from functools import partial
from pathlib import Path
from typing import Protocol

from lightpen.errors import UsageError


class Desktop(Protocol):
    """Starts what has a window, which gives an exit status."""

    def show_window(self, swing: Path | None) -> int:
        """Open the window, at a recorded swing if a path leads to one."""

    def play_demo(self) -> int:
        """Play a calibration with a simulated operator."""

    def test_itself(self, report: Path) -> int:
        """Test the installation and write a report."""

    def data_folder(self) -> Path:
        """Return the chosen folder of records, results and archive."""


def add_desktop(parser: argparse.ArgumentParser, desktop: Desktop) -> None:
    """Add the options without a command."""
    parser.set_defaults(run=partial(_start, desktop))
    starts = parser.add_mutually_exclusive_group()
    starts.add_argument(
        "--demo",
        action="store_true",
        help="run a complete calibration with a simulated operator",
    )
    starts.add_argument(
        "--self-test",
        type=Path,
        metavar="REPORT.json",
        help="test the installation on this computer and write a report",
    )


def add_open(parser: argparse.ArgumentParser, desktop: Desktop) -> None:
    """Add ``lightpen open``."""
    parser.set_defaults(run=lambda options: _open(desktop, options.swing))
    parser.add_argument(
        "swing",
        nargs="?",  # the menu of a desktop starts the program without a file
        type=Path,
        metavar="SWING",
        help="record of a swing, the file swing.lightpen in it, or a result; "
        "without it the window opens as usual",
    )


def _start(desktop: Desktop, options: argparse.Namespace) -> int:
    if options.demo:
        return desktop.play_demo()
    if options.self_test is not None:
        return desktop.test_itself(options.self_test)
    return desktop.show_window(None)


def _open(desktop: Desktop, swing: Path | None) -> int:
    if swing is not None and is_absent(swing):
        raise UsageError("cli.no-such-file", path=swing)
    return desktop.show_window(swing)


def is_absent(path: Path) -> bool:
    """Return whether there is surely no such file or folder."""
    try:
        return not path.exists()
    except OSError:  # no access; the window reports it
        return False
