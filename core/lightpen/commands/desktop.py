"""What the command line starts beside its commands: the window and all with it."""

import argparse
from functools import partial
from pathlib import Path
from typing import Protocol


class Desktop(Protocol):
    """Starts what has a window or a place on a desktop; returns an exit status."""

    def show_window(self, swing: Path | None) -> int:
        """Open the window; with what leads to a recorded swing, show that."""

    def play_demo(self) -> int:
        """Play a calibration with a simulated operator."""

    def test_itself(self, report: Path) -> int:
        """Try what the program needs, and write a report."""

    def install_entry(self) -> int:
        """Put the program into the menu of the desktop."""

    def remove_entry(self) -> int:
        """Take it out of the menu again."""


def add_desktop(parser: argparse.ArgumentParser, desktop: Desktop) -> None:
    """Add what is started without a command."""
    parser.set_defaults(run=partial(_start, desktop))
    starts = parser.add_mutually_exclusive_group()
    starts.add_argument(
        "--demo",
        action="store_true",
        help="play a whole calibration with a simulated operator",
    )
    starts.add_argument(
        "--self-test",
        type=Path,
        metavar="REPORT.json",
        help="try all that the program needs on this computer, and write a report",
    )
    starts.add_argument(
        "--install-desktop-entry",
        action="store_true",
        help="put the program into the menu of a Linux desktop",
    )
    starts.add_argument(
        "--remove-desktop-entry", action="store_true", help="take it out again"
    )


def add_open(parser: argparse.ArgumentParser, desktop: Desktop) -> None:
    """Add the words of ``lightpen open``."""
    parser.set_defaults(run=lambda options: desktop.show_window(options.swing))
    parser.add_argument(
        "swing",
        type=Path,
        metavar="SWING",
        help="the record of a swing, the file swing.lightpen in it, or a result",
    )


def _start(desktop: Desktop, options: argparse.Namespace) -> int:
    if options.demo:
        return desktop.play_demo()
    if options.self_test is not None:
        return desktop.test_itself(options.self_test)
    if options.install_desktop_entry:
        return desktop.install_entry()
    if options.remove_desktop_entry:
        return desktop.remove_entry()
    return desktop.show_window(None)
