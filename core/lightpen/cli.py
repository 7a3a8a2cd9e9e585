"""The command line: ``lightpen calibrate | simulate | pivot | pen | verify | ...``.

Exit status: 0 done, 1 the data cannot give a tip or the archive was changed, 2 wrong
usage or unreadable input; with ``--exit-by-verdict`` 3 REPEAT and 4 CHECK.
"""

import argparse
import logging
import re
import sys
from collections.abc import Collection, Sequence
from contextlib import suppress
from io import TextIOWrapper
from pathlib import Path
from typing import Any, NoReturn

import cv2
import platformdirs
from typing_extensions import override

from lightpen import __version__
from lightpen.commands.arguments import use_window
from lightpen.commands.console import BAD_INPUT, NO_TIP, Command, shown
from lightpen.commands.desktop import Desktop, add_desktop, add_open, is_absent
from lightpen.errors import CalibrationError, LightpenError, UsageError
from lightpen.extension import Extension, Subcommand
from lightpen.logs import LEVEL_VARIABLE, LEVELS, log_level, running_log, write_log_to
from lightpen.messages import Message

COMMANDS = (
    Subcommand(
        "calibrate",
        "calibrate the tip from the images of a swing",
        "lightpen.commands.calibrate:add_calibrate",
    ),
    Subcommand(
        "pivot",
        "calibrate the tip from given poses",
        "lightpen.commands.pivot:add_pivot",
    ),
    Subcommand(
        "pen",
        "transform measured LED coordinates into the pen frame",
        "lightpen.commands.pen:add_pen",
    ),
)
OF_ARCHIVE = (
    Subcommand(
        "archive",
        "check, list, deliver and fetch entries",
        "lightpen.commands.archive:add_archive",
    ),
    Subcommand(
        "tips",
        "manage the library of pens, tips and cones",
        "lightpen.commands.tips:add_tips",
    ),
)
OPENED = (".lightpen", ".json")  # suffixes of the files that the window opens
NEGATIVE_NUMBER = re.compile(r"-\.?[0-9]")
# Advice for the command line, by the message codes of the core.
ADVICE = {
    "pen-file.no-units": "Name them so: --units mm.",
    "poses.several-tools": "Name it so: --tool NAME.",
    "pen-file.contradicting-units": "It is given by --units.",
    "pen.too-large": "Name them so: --units um.",
    "pen.too-small": "Name them so: --units m.",
    "pen.not-in-frame": "That is done by: lightpen pen RAW.csv OUT.csv.",
    "images.other-size": "Binned or cropped: --binning 2, --roi 0 0 640 480.",
    "images.ambiguous": "They are given by --centers FILE.csv.",
}

_logger = logging.getLogger(__name__)


def usual_data_folder() -> Path:
    """Return the default data folder."""
    return platformdirs.user_data_path("lightpen", appauthor=False)


def main(
    arguments: Sequence[str] | None = None,
    desktop: Desktop | None = None,
    extensions: Sequence[Extension] = (),
) -> int:
    """Run the command line and return the exit status.

    By default the arguments of the process are parsed. Without a desktop a command must
    be given. The extensions add their commands.
    """
    given = sys.argv[1:] if arguments is None else arguments
    parser, commands = _parser(given, desktop, extensions)
    if desktop is not None and _names_file(given, commands):
        given = ["open", *given]
    # argparse takes "-90." and "-9e1" for options, but not with a blank before them.
    options = parser.parse_args(
        [f" {text}" if NEGATIVE_NUMBER.match(text) else text for text in given]
    )
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):  # a console may lack letters of a name
            stream.reconfigure(errors="backslashreplace")
    cv2.setNumThreads(1)  # images are spread over threads, one each
    try:
        level = log_level(options.log_level)
    except UsageError as error:
        _complain(error.message)
        return BAD_INPUT
    with running_log(level, is_verbose=options.verbose):
        if options.log_folder is not None:
            _write_log_to_existing(options.log_folder())
        _logger.info("lightpen %s started with %s", __version__, given)
        status = _run(options)
        _logger.info("ended with status %d", status)
        return status


def _write_log_to_existing(data: Path) -> None:
    """Log to a data folder; a command does not make one."""
    with suppress(OSError):  # it is not accessible
        if data.is_dir():
            write_log_to(data)


def _run(options: argparse.Namespace) -> int:
    run: Command = options.run
    try:
        use_window(options)
        return run(options)
    except CalibrationError as error:
        _complain(error.message)
        return NO_TIP
    except LightpenError as error:
        _complain(error.message)
        return BAD_INPUT
    except KeyboardInterrupt:
        print("lightpen: stopped.", file=sys.stderr)
        _logger.info("stopped by the user")
        return BAD_INPUT


def _complain(fault: Message) -> None:
    """Print an error, with advice for the command line."""
    advice = [ADVICE[each.code] for each in fault.parts() if each.code in ADVICE]
    print(shown(" ".join(map(str, ["lightpen:", fault, *advice]))), file=sys.stderr)
    _logger.error("%s: %s", fault.code, fault)


class _Parser(argparse.ArgumentParser):
    """A parser, also of a command, that takes the options of the log."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        log = self.add_argument_group("log")
        log.add_argument(
            "-v",
            "--verbose",
            action="store_true",
            default=argparse.SUPPRESS,
            help="also print the log on standard error",
        )
        log.add_argument(
            "--log-level",
            type=str.lower,
            choices=LEVELS,
            default=argparse.SUPPRESS,
            help=f"log level (default: info, or {LEVEL_VARIABLE})",
        )

    @override
    def error(self, message: str) -> NoReturn:
        super().error(shown(message))


def _parser(
    given: Sequence[str], desktop: Desktop | None, extensions: Sequence[Extension]
) -> tuple[argparse.ArgumentParser, Collection[str]]:
    """Return the parser, and the names of the commands."""
    has_window = desktop is not None
    parser = _Parser(
        prog="lightpen",
        description="Calibrate the probe tip of a light pen."
        + (" Without a command, the wizard opens." * has_window),
        epilog="Exit status: 0 done, 1 no result from these data or a modified "
        "archive, 2 wrong usage or unreadable input; with --exit-by-verdict 3 REPEAT "
        "and 4 CHECK.",
    )
    parser.set_defaults(
        verbose=False,
        log_level=None,
        log_folder=None,
        replicate=next((e.replicate for e in extensions if e.replicate), None),
    )
    parser.add_argument("--version", action="version", version=__version__)
    commands = parser.add_subparsers(required=not has_window, metavar="COMMAND")

    def added(name: str, help_text: str) -> argparse.ArgumentParser:
        sentence = f"{help_text[0].upper()}{help_text[1:]}."
        return commands.add_parser(name, help=help_text, description=sentence)

    if desktop is not None:
        add_desktop(parser, desktop)
        add_open(added("open", "open a recorded swing"), desktop)
    folder = usual_data_folder if desktop is None else desktop.data_folder
    of_extensions = (c for e in extensions for c in e.commands)
    for each in (*COMMANDS, *of_extensions, *OF_ARCHIVE):
        command = added(each.name, each.purpose)
        command.set_defaults(
            log_folder=usual_data_folder, data_folder=folder, extensions=extensions
        )
        if each.name in given:
            each.add_options(command)
    return parser, commands.choices


def _names_file(given: Sequence[str], commands: Collection[str]) -> bool:
    """Return whether the only argument is a file, as after a double click."""
    if len(given) != 1 or given[0] in commands or given[0].startswith("-"):
        return False
    path = Path(given[0])
    return len(path.parts) > 1 or path.suffix in OPENED or not is_absent(path)
