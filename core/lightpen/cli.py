"""The command line: ``lightpen calibrate | simulate | pivot | pen | verify | ...``.

Exit status: 0 done, 1 the data cannot give a tip, 2 wrong usage or unreadable input.
"""

import argparse
import re
import sys
from collections.abc import Collection, Sequence
from importlib.metadata import version
from io import TextIOWrapper
from pathlib import Path
from typing import NoReturn

import cv2

from lightpen.commands.board import add_board
from lightpen.commands.calibrate import add_calibrate
from lightpen.commands.check_camera import add_check_camera
from lightpen.commands.console import BAD_INPUT, NO_TIP, Command, shown
from lightpen.commands.desktop import Desktop, add_desktop, add_open
from lightpen.commands.intrinsics import add_extrinsics, add_intrinsics
from lightpen.commands.pen import add_pen
from lightpen.commands.pen_health import add_improve_pen
from lightpen.commands.pivot import add_pivot
from lightpen.commands.recalculate import add_recalculate
from lightpen.commands.repeatability import add_repeatability
from lightpen.commands.simulate import add_simulate
from lightpen.commands.verify import add_verify
from lightpen.errors import CalibrationError, LightpenError
from lightpen.sentences import Sentence

NEGATIVE_NUMBER = re.compile(r"-\.?[0-9]")
# What to type about what the core says, by its codes.
ADVICE = {
    "pen-file.no-units": "Name them so: --units mm.",
    "pen-file.contradicting-units": "It is given by --units.",
    "pen.too-large": "Name them so: --units um.",
    "pen.too-small": "Name them so: --units m.",
    "pen.not-in-frame": "That is done by: lightpen pen RAW.csv OUT.csv.",
    "pen.neither-framed-nor-handed": "That is done by: lightpen pen RAW.csv OUT.csv.",
    "images.ambiguous": "They are given by --centers FILE.csv.",
}


def main(arguments: Sequence[str] | None = None, desktop: Desktop | None = None) -> int:
    """Run the command line and return the exit status.

    Parameters
    ----------
    arguments : sequence of str, optional
        Those of the process unless given.
    desktop : Desktop, optional
        Without it a command must be given.
    """
    given = sys.argv[1:] if arguments is None else arguments
    parser, commands = _parser(desktop)
    if desktop is not None and _is_file_to_open(given, commands):
        given = ["open", *given]
    # argparse takes "-90." and "-9e1" for options, but not with a blank before them.
    options = parser.parse_args(
        [f" {text}" if NEGATIVE_NUMBER.match(text) else text for text in given]
    )
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):  # a console may lack letters of a name
            stream.reconfigure(errors="backslashreplace")
    cv2.setNumThreads(1)  # images are spread over threads, one each
    run: Command = options.run
    try:
        status = run(options)
    except CalibrationError as error:
        _complain(error.sentence)
        return NO_TIP
    except LightpenError as error:
        _complain(error.sentence)
        return BAD_INPUT
    except KeyboardInterrupt:
        print("lightpen: stopped.", file=sys.stderr)
        return BAD_INPUT
    return status


def _complain(trouble: Sentence) -> None:
    """Print what is wrong, and what to type about it."""
    advice = [ADVICE[each.code] for each in trouble.parts() if each.code in ADVICE]
    print(shown(" ".join(map(str, ["lightpen:", trouble, *advice]))), file=sys.stderr)


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        super().error(shown(message))


def _parser(
    desktop: Desktop | None,
) -> tuple[argparse.ArgumentParser, Collection[str]]:
    """Return the parser, and the names of its commands."""
    has_window = desktop is not None
    parser = _Parser(
        prog="lightpen",
        description="Calibrate the probe tip of a light pen."
        + (" Without a command, a window opens and leads through it." * has_window),
        epilog="Exit status: 0 done, 1 the data cannot give a tip, 2 wrong usage or "
        "unreadable input.",
    )
    parser.add_argument("--version", action="version", version=version("lightpen"))
    commands = parser.add_subparsers(required=not has_window, metavar="COMMAND")
    if desktop is not None:
        add_desktop(parser, desktop)
        add_open(commands.add_parser("open", help="show a recorded swing"), desktop)
    add_calibrate(commands.add_parser("calibrate", help="find the tip from a swing"))
    add_simulate(commands.add_parser("simulate", help="write a simulated swing"))
    add_pivot(commands.add_parser("pivot", help="find the tip from given poses"))
    add_pen(commands.add_parser("pen", help="put measured LEDs into the pen frame"))
    add_verify(commands.add_parser("verify", help="prove a tip by touching"))
    add_repeatability(
        commands.add_parser("repeatability", help="compare calibrations of one tip")
    )
    add_recalculate(
        commands.add_parser(
            "recalculate", help="solve calibrations again, and check U by Monte Carlo"
        )
    )
    add_improve_pen(
        commands.add_parser("improve-pen", help="a better LED file by several swings")
    )
    add_intrinsics(
        commands.add_parser("intrinsics", help="calibrate a camera by a board")
    )
    add_extrinsics(
        commands.add_parser("extrinsics", help="find how two cameras stand, by a board")
    )
    add_board(commands.add_parser("board", help="make a board to be printed"))
    add_check_camera(
        commands.add_parser(
            "check-camera", help="whether camera and file agree, by a swing"
        )
    )
    return parser, commands.choices


def _is_file_to_open(given: Sequence[str], commands: Collection[str]) -> bool:
    """Return whether there is nothing but a file, as icons hand it over."""
    return len(given) == 1 and given[0] not in commands and Path(given[0]).exists()
